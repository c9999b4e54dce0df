"""A window in which keys or mouse drive the arm through a maze, and a planner shows how it is done."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium as gym

from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from hrsnake_env.window import import_pygame, open_display
from planners.game import MAZE_SIZE, Game

__all__ = ["play"]

BAR, HELP_BAR = 56, 30
"""Heights of what is written above and below the maze, in pixels."""

HELP = (
    "arrows: steer, feed, retract    mouse: left button to the pointer, right button back    "
    "space: planner    R: reset    Q: quit"
)
INK, PAPER = (28, 33, 40), (244, 245, 247)


class Stopped(Exception):
    """Say that the player has gone while a plan was being made."""


class _Screen:
    """Show a game in a window, and read keys and mouse."""

    def __init__(self, game: Game) -> None:
        self.game, self.pygame = game, import_pygame()
        width, height = MAZE_SIZE
        self.surface = open_display((width, BAR + height + HELP_BAR), f"hrsnake: {game.maze.name}")
        self.pygame.font.init()
        self._font, self._small = (self.pygame.font.Font(None, size) for size in (23, 20))
        keys = self.pygame
        self._keys = {
            keys.K_LEFT: "left",
            keys.K_RIGHT: "right",
            keys.K_UP: "up",
            keys.K_DOWN: "down",
        }
        self._buttons = {1: "to_pointer", 3: "back"}

    def close(self) -> None:
        """Close the window."""
        self.pygame.font.quit()
        self.pygame.display.quit()

    def draw(self, news: str | None = None) -> None:
        """Draw everything; `news` stands for the second line."""
        pygame, game, surface = self.pygame, self.game, self.surface
        surface.fill(PAPER)
        surface.blit(pygame.image.frombuffer(game.frame().tobytes(), MAZE_SIZE, "RGB"), (0, BAR))
        line = game.pointer_line
        if line is not None:
            surface.set_clip((0, BAR, *MAZE_SIZE))
            ends = [(x, y + BAR) for x, y in line]
            pygame.draw.line(surface, (214, 40, 40), *ends, 3)
            pygame.draw.circle(surface, (214, 40, 40), ends[1], 4)
            surface.set_clip(None)
        state, below = game.lines
        for row, text in enumerate((state, news or below)):
            self._write(self._font, text, 8 + 24 * row)
        self._write(self._small, HELP, BAR + MAZE_SIZE[1] + 8)
        pygame.display.flip()

    def _write(self, font: Any, text: str, top: int) -> None:
        """Write a line; what is too long for the window ends in three dots."""
        room = MAZE_SIZE[0] - 20
        while font.size(text)[0] > room:
            text = text[: -len("...") - 2] + "..."
        self.surface.blit(font.render(text, True, INK), (10, top))

    def read(self) -> bool:
        """Read what was done since the last call; return False when the player wants to go."""
        pygame, game = self.pygame, self.game
        hand_over = False
        for event in pygame.event.get():
            if event.type == pygame.QUIT:
                return False
            if event.type == pygame.KEYDOWN:
                if event.key in (pygame.K_ESCAPE, pygame.K_q):
                    return False
                if event.key == pygame.K_r:
                    game.reset()
                hand_over |= event.key in (pygame.K_SPACE, pygame.K_p)
            self._hold(event)
        if hand_over:
            game.hand_over(self._progress)
            game.controls.held.clear()
        return True

    def _hold(self, event: Any) -> None:
        """Remember what is down. A window that is left hears nothing of what is let go."""
        pygame, controls = self.pygame, self.game.controls
        if event.type in (pygame.MOUSEMOTION, pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP):
            controls.pointer = (event.pos[0], event.pos[1] - BAR)
        if event.type in (pygame.KEYDOWN, pygame.KEYUP):
            name = self._keys.get(event.key)
        elif event.type in (pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP):
            name = self._buttons.get(event.button)
        else:
            if event.type == pygame.WINDOWFOCUSLOST:
                controls.held.clear()
            return
        if name is not None:
            down = event.type in (pygame.KEYDOWN, pygame.MOUSEBUTTONDOWN)
            (controls.held.add if down else controls.held.discard)(name)

    def _progress(self, stage: str, share: float) -> None:
        """Say how planning goes on, and stop it if the player wants to go."""
        pygame = self.pygame
        self.draw(f"planner '{self.game.planner}' is thinking: {stage} {share:.0%}")
        for event in pygame.event.get():
            if event.type == pygame.QUIT:
                raise Stopped
            if event.type == pygame.KEYDOWN and event.key in (pygame.K_ESCAPE, pygame.K_q):
                raise Stopped


def play(
    maze: Maze,
    link_length: float | None = None,
    n_links: int | None = None,
    planner: str = "auto",
    *,
    each_frame: Callable[[Game], None] | None = None,
) -> None:
    """Open a window and let somebody drive, until they close it.

    Parameters
    ----------
    maze : Maze
        The maze.
    link_length : float, optional
        In maze units; by default the environment's.
    n_links : int, optional
        By default enough to reach the goal.
    planner : str
        Who drives after the space bar: `auto` or a key of `PLANNERS`.
    each_frame : callable, optional
        Called after each frame.

    Raises
    ------
    InputError
        If there is no display, pygame is not installed, or the arguments do not fit.
    """
    game = Game(maze, link_length, n_links, planner)
    try:
        screen = _Screen(game)
    except gym.error.DependencyNotInstalled as error:
        raise InputError(str(error)) from None
    clock = screen.pygame.time.Clock()
    try:
        while screen.read():
            game.advance()
            screen.draw()
            if each_frame is not None:
                each_frame(game)
            clock.tick(game.env.metadata["render_fps"])
    except Stopped:
        pass
    finally:
        screen.close()
        game.env.close()
