"""A window on the screen that shows frames. It alone needs pygame, and only once it opens."""

from __future__ import annotations

import os
import sys
import weakref
from typing import Any, ClassVar

import gymnasium as gym

from hrsnake_env.errors import InputError
from hrsnake_env.rendering import Frame

__all__ = ["Window", "import_pygame", "open_display"]


def import_pygame() -> Any:
    """Return pygame.

    Raises
    ------
    gymnasium.error.DependencyNotInstalled
        If it is not installed.
    """
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    try:
        import pygame
    except ImportError as error:
        raise gym.error.DependencyNotInstalled(
            'Expected pygame to be installed, to show a window: pip install "hrsnake[play]".'
        ) from error
    return pygame


def open_display(size: tuple[int, int], title: str) -> Any:
    """Open a window, or make the one that is open fit.

    Of pygame only the display is started: no sound, no fonts.

    Parameters
    ----------
    size : tuple of two ints
        Width and height in pixels.
    title : str
        Of the window.

    Returns
    -------
    surface : pygame.Surface
        What the window shows after `pygame.display.flip`.

    Raises
    ------
    InputError
        If there is no display. SDL_VIDEODRIVER=dummy is one that nobody sees.
    """
    pygame = import_pygame()
    # SDL would open an invisible window, and its libraries would complain.
    hidden = sys.platform == "linux" and not any(
        os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER")
    )
    reason = "neither DISPLAY nor WAYLAND_DISPLAY is set"
    if not hidden:
        try:
            pygame.display.init()
            surface = pygame.display.set_mode(size)
        except pygame.error as error:
            hidden, reason = True, str(error)
    if hidden:
        raise InputError(f"Expected a display to open a window on, got none: {reason}.")
    pygame.display.set_caption(title)
    return surface


class Window:
    """Show frames in a window, at a steady rate; all of a process share one window.

    If its user closes it, it stays closed, and `show` does nothing, until `close`.

    Parameters
    ----------
    size : tuple of two ints
        Width and height of the frames, in pixels.
    fps : float
        Frames per second, at most.
    title : str
        Of the window.

    Attributes
    ----------
    dismissed : bool
        Whether its user has closed it.
    """

    _shown: ClassVar[weakref.WeakSet[Window]] = weakref.WeakSet()

    def __init__(self, size: tuple[int, int], *, fps: float, title: str) -> None:
        self.size, self.fps, self.title = size, fps, title
        self.dismissed = False
        self._clock: Any = None

    def show(self, frame: Frame) -> None:
        """Show a frame, and wait until it is time for the next.

        Raises
        ------
        InputError
            If there is no display.
        gymnasium.error.DependencyNotInstalled
            If pygame is not installed.
        """
        if self.dismissed:
            return
        pygame = import_pygame()
        surface = pygame.display.get_surface() if pygame.display.get_init() else None
        if surface is None or surface.get_size() != self.size or self not in Window._shown:
            surface = open_display(self.size, self.title)
            Window._shown.add(self)
        if self._clock is None:
            self._clock = pygame.time.Clock()
        surface.blit(pygame.image.frombuffer(frame.tobytes(), self.size, "RGB"), (0, 0))
        pygame.display.flip()
        if any(event.type == pygame.QUIT for event in pygame.event.get()):
            for window in tuple(Window._shown):
                window.close()
                window.dismissed = True
        self._clock.tick(self.fps)

    def close(self) -> None:
        """Close the window, unless another one's frames are shown in it; the next `show` opens it again."""
        self.dismissed = False
        if self in Window._shown:
            Window._shown.discard(self)
            if not Window._shown:
                import_pygame().display.quit()

    def __getstate__(self) -> dict[str, Any]:
        # A copy has no window yet.
        return {**vars(self), "_clock": None, "dismissed": False}
