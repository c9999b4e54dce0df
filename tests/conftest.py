"""Settings of the whole suite."""

import os
import signal

import pytest
from hypothesis import settings

# Windows open on a display that nobody sees; pygame reads this when it starts.
os.environ.setdefault("SDL_VIDEODRIVER", "dummy")

# A job in the background of a shell ignores Ctrl-C; what the tests start would, too.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Kernels are compiled at their first call, which no deadline should count.
settings.register_profile("local", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "local")


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    """Return a headless Chromium, started for the first test that wants one."""
    from browser import start_browser  # it needs what only some systems have

    chromium = start_browser(tmp_path_factory.mktemp("browser"))
    yield chromium
    chromium.close()
