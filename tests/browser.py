"""A real browser for the tests of pages: a headless Chromium, its pages, mouse, keys, fingers and files."""

import base64
import contextlib
import fcntl
import json
import os
import select
import shutil
import signal
import time
from pathlib import Path

import pytest

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
PATIENCE = 30.0  # s: for anything a browser is asked for
PHONE = {"width": 360, "height": 740, "mobile": True}
ERRORS = "document.documentElement.dataset.errors"
SHIFT, CONTROL = 8, 2  # modifiers of keys

# What a key does by itself, such as moving the focus, hangs on its number.
NUMBERS = {"Backspace": 8, "Tab": 9, "Enter": 13, "Escape": 27, " ": 32, "PageUp": 33, "PageDown": 34}
NUMBERS |= {"End": 35, "Home": 36, "ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40}
NUMBERS |= {"Delete": 46}


def start_browser(folder):
    """Return a headless Chromium with a profile in a folder; without one, skip the test or fail it."""
    found = [path for path in map(shutil.which, BROWSERS) if path]
    if not found:
        reason = f"needs a browser: none of {', '.join(BROWSERS)} is on the PATH"
        if os.environ.get("HRSNAKE_REQUIRE_BROWSER"):
            pytest.fail(reason)
        pytest.skip(reason)
    return Browser(found[0], folder)


class Browser:
    """Drive a headless Chromium through its debugging pipe: file descriptors 3 and 4, JSON, ended by NUL."""

    def __init__(self, command, folder):
        ours_in, theirs_out = os.pipe()
        theirs_in, ours_out = os.pipe()
        # Above 4, so that neither is written over while they are put in place.
        given = [fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 10) for end in (theirs_in, theirs_out)]
        silent = [(os.POSIX_SPAWN_OPEN, number, os.devnull, os.O_RDWR, 0) for number in (0, 1, 2)]
        placed = [(os.POSIX_SPAWN_DUP2, end, number) for number, end in enumerate(given, start=3)]
        settings = [f"--user-data-dir={folder}", "--remote-debugging-pipe", "--no-first-run"]
        # CI has no graphics, little shared memory, and is root, for whom there is no sandbox.
        settings += ["--headless=new", "--disable-gpu", "--disable-dev-shm-usage", "--no-sandbox"]
        self._process = os.posix_spawn(
            command, [command, *settings, "about:blank"], os.environ, file_actions=[*silent, *placed]
        )
        for end in (theirs_in, theirs_out, *given):
            os.close(end)
        self._in, self._out = ours_in, ours_out
        self._rest, self._number, self.events = b"", 0, []

    def close(self):
        """End the browser."""
        with contextlib.suppress(OSError, AssertionError):
            self.call("Browser.close")
        end = time.monotonic() + 10.0
        while os.waitpid(self._process, os.WNOHANG) == (0, 0):
            if time.monotonic() > end:
                os.kill(self._process, signal.SIGKILL)
            time.sleep(0.02)
        os.close(self._in)
        os.close(self._out)

    def call(self, method, session=None, **parameters):
        """Call a method of the protocol, and return its result."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if session is not None:
            message["sessionId"] = session
        os.write(self._out, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._read()
            if answer.get("id") == self._number:
                assert "error" not in answer, f"{method}: {answer['error']}"
                return answer["result"]
            self.events.append(answer)

    def _read(self):
        while b"\0" not in self._rest:
            ready, _, _ = select.select([self._in], [], [], PATIENCE)
            assert ready, "the browser does not answer"
            part = os.read(self._in, 1 << 20)
            assert part, "the browser has ended"
            self._rest += part
        message, _, self._rest = self._rest.partition(b"\0")
        return json.loads(message)


class Page:
    """Hold one page of the browser, and what went wrong on it.

    It is open when its document element has data-ready="1". `allowed` are beginnings of addresses that it
    may ask for; without them it is one file that asks for nothing but itself.
    """

    def __init__(self, browser, url, width, height, dark=False, mobile=False, allowed=()):
        self.browser, self.allowed, self._expected = browser, tuple(allowed), []
        self._target = browser.call("Target.createTarget", url="about:blank")["targetId"]
        attached = browser.call("Target.attachToTarget", targetId=self._target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Runtime", "Network", "Page", "Log"):
            self.call(f"{domain}.enable")
        self.resize(width, height, mobile)
        self.set_scheme(dark)
        if mobile:
            self.call("Emulation.setTouchEmulationEnabled", enabled=True)
        self.call("Page.navigate", url=url)
        self.wait("document.documentElement?.dataset.ready === '1'")

    def resize(self, width, height, mobile=False):
        """Give the page a size, in CSS pixels."""
        size = {"width": width, "height": height, "deviceScaleFactor": 2 if mobile else 1, "mobile": mobile}
        self.call("Emulation.setDeviceMetricsOverride", **size)

    def set_scheme(self, dark):
        """Prefer dark pages, or light ones."""
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])

    def call(self, method, **parameters):
        """Call a method of the protocol on this page."""
        return self.browser.call(method, self._session, **parameters)

    def evaluate(self, code):
        """Return the value of an expression of JavaScript."""
        answer = self.call("Runtime.evaluate", expression=code, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait(self, condition, patience=PATIENCE):
        """Wait until an expression is true."""
        end = time.monotonic() + patience
        while not self.evaluate(condition):
            assert time.monotonic() < end, f"never came: {condition}; {self.evaluate(ERRORS)}"
            time.sleep(0.02)

    def frames(self, number=2):
        """Wait until the page has drawn."""
        for _ in range(number):
            self.evaluate("new Promise((done) => requestAnimationFrame(() => done(1)))")

    def pose(self):
        """Return the pose that is shown."""
        self.frames()
        return int(self.evaluate("document.documentElement.dataset.pose"))

    # Keys, mouse, fingers

    def key(self, key, text="", **settings):
        """Press a key. `text` is what it writes: needed for letters, and for Enter on a button."""
        number = {"windowsVirtualKeyCode": NUMBERS[key]} if key in NUMBERS else {}
        if key == "Enter":
            text = "\r"
        for kind in ("keyDown", "keyUp"):
            given = {"text": text} if text and kind == "keyDown" else {}
            self.call("Input.dispatchKeyEvent", type=kind, key=key, **number, **given, **settings)

    def type(self, text):
        """Write a text into what has the focus."""
        self.call("Input.insertText", text=text)

    def mouse(self, kind, x, y, **settings):
        """Move the mouse, its wheel or a button."""
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **settings)

    def click(self, x, y, count=1):
        """Click once, or twice."""
        for number in range(1, count + 1):
            self.mouse("mousePressed", x, y, button="left", clickCount=number)
            self.mouse("mouseReleased", x, y, button="left", clickCount=number)

    def drag(self, *places, **settings):
        """Move the mouse along places with its left button held."""
        self.mouse("mousePressed", *places[0], button="left", buttons=1, clickCount=1, **settings)
        for place in places[1:]:
            self.mouse("mouseMoved", *place, button="left", buttons=1, **settings)
        self.mouse("mouseReleased", *places[-1], button="left", clickCount=1, **settings)

    def box(self, selector):
        """Return left, top, width and height of an element on the screen, once it is scrolled to."""
        return self.evaluate(
            f"(() => {{ const part = document.querySelector({json.dumps(selector)});"
            " part.scrollIntoView({ block: 'nearest', behavior: 'instant' });"
            " const b = part.getBoundingClientRect(); return [b.left, b.top, b.width, b.height]; })()"
        )

    def click_on(self, selector, count=1):
        """Click on the middle of an element."""
        left, top, width, height = self.box(selector)
        assert width > 0 and height > 0, f"not shown: {selector}"
        self.click(left + width / 2, top + height / 2, count)

    def touch(self, kind, *places):
        """Put fingers on places ("touchStart"), move them ("touchMove") or lift all ("touchEnd")."""
        points = [{"x": x, "y": y, "id": number} for number, (x, y) in enumerate(places, start=1)]
        self.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)

    def tap(self, x, y):
        """Touch a place with one finger, and lift it."""
        self.touch("touchStart", (x, y))
        self.touch("touchEnd")

    # Files

    def set_files(self, selector, *paths):
        """Choose files in an `<input type="file">`."""
        code = f"document.querySelector({json.dumps(selector)})"
        found = self.call("Runtime.evaluate", expression=code)["result"]
        self.call("DOM.setFileInputFiles", files=[str(path) for path in paths], objectId=found["objectId"])

    def download(self, action, folder, patience=PATIENCE):
        """Return the path of the one file that the page hands over when `action()` is done."""
        folder = Path(folder)
        before = set(folder.iterdir())
        self.browser.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(folder))
        action()
        end = time.monotonic() + patience
        while True:
            self.evaluate("1")
            new = set(folder.iterdir()) - before
            if new and not any(path.name.endswith(".crdownload") or path.name[0] == "." for path in new):
                break
            assert time.monotonic() < end, f"no file came: {self.evaluate(ERRORS)}"
            time.sleep(0.02)
        (path,) = new
        return path

    def save_picture(self, path):
        """Write what is seen (.png)."""
        data = self.call("Page.captureScreenshot", format="png")["data"]
        Path(path).write_bytes(base64.b64decode(data))

    # What went wrong

    def expect(self, words):
        """Take complaints of the browser with these words for what the test is about: a refusal, say."""
        self._expected.append(words)

    def complaints(self):
        """Return what the browser complained of that was not expected."""
        mine = self._events("Runtime.exceptionThrown", "Log.entryAdded")
        texts = [json.dumps(event["params"]) for event in mine]
        return [text for text in texts if not any(words in text for words in self._expected)]

    def _events(self, *methods):
        mine = [event for event in self.browser.events if event.get("sessionId") == self._session]
        return [event for event in mine if event["method"] in methods]

    def close(self):
        """Close the page, after a look at whether it has complained or asked for more than it may."""
        try:
            assert self.evaluate(ERRORS) == ""
            assert self.complaints() == []
            urls = [e["params"]["request"]["url"] for e in self._events("Network.requestWillBeSent")]
            allowed = (*self.allowed, "data:", "blob:") if self.allowed else ("file:", "data:")
            assert [url for url in urls if not url.startswith(allowed)] == []
            assert self.allowed or len(urls) <= 1
        finally:
            self.browser.call("Target.closeTarget", targetId=self._target)
            events = self.browser.events
            events[:] = [event for event in events if event.get("sessionId") != self._session]
