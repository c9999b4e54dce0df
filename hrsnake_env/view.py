"""What is seen of an episode: frames of whatever maze the arm is in, and the window that shows them."""

from __future__ import annotations

from typing import Any

from hrsnake_env.maze import Maze
from hrsnake_env.physics import Physics
from hrsnake_env.rendering import Frame, FrameRenderer
from hrsnake_env.window import Window

__all__ = ["View"]


class View:
    """Draw frames of one size, in which mazes of any shape stand in the middle.

    Parameters
    ----------
    size : int or tuple of two ints, optional
        In pixels, as `FrameRenderer` has it; by default what suits the first maze.
    fps : float
        Of the window.
    """

    def __init__(self, size: int | tuple[int, int] | None = None, *, fps: float) -> None:
        self._size, self._fps = size, fps
        self._renderer: FrameRenderer | None = None
        self._maze: Maze | None = None
        self._window: Window | None = None

    def frame(self, physics: Physics) -> Frame:
        """Draw the arm in its maze, its links coloured by clearance, and what touches.

        Returns
        -------
        frame : uint8 array, shape (height, width, 3)
        """
        if self._renderer is None or self._maze is not physics.maze:
            size = {} if self._size is None else {"size": self._size}
            self._renderer = FrameRenderer(physics.maze, link_radius=physics.arm.link_radius, **size)
            self._maze, self._size = physics.maze, self._renderer.size
        return self._renderer.draw(
            physics.joints,
            clearances=physics.clearance,
            link_length=physics.link_length,
            contacts=physics.pose_contacts,
        )

    def show(self, physics: Physics) -> None:
        """Show a frame in a window, and wait until it is time for the next."""
        frame = self.frame(physics)
        if self._window is None:
            height, width, _ = frame.shape
            self._window = Window((width, height), fps=self._fps, title=physics.maze.name)
        self._window.show(frame)

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()
            self._window = None

    def __getstate__(self) -> dict[str, Any]:
        # A copy has no window yet, and draws its own pictures.
        return {**vars(self), "_window": None, "_renderer": None}
