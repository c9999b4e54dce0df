"""What hypothesis draws for the laws: mazes with arms, similarities, and motions in them."""

from __future__ import annotations

from hypothesis import strategies as st

from benchmarks.trust.maze_draws import KINDS, draw_case, draw_similarity

__all__ = ["FromHypothesis", "cases", "similarities"]


class FromHypothesis:
    """Draw numbers as a NumPy generator does, so that hypothesis can shrink them."""

    def __init__(self, draw) -> None:
        self._draw = draw

    def uniform(self, low, high):
        """Draw a number from low to high."""
        return self._draw(st.floats(low, high))

    def integers(self, low, high):
        """Draw a whole number from low to high, the latter left out."""
        return self._draw(st.integers(low, high - 1))


@st.composite
def cases(draw, kinds=tuple(KINDS)):
    """Draw a maze and an arm that fits its feeder."""
    return draw_case(FromHypothesis(draw), draw(st.sampled_from(kinds)))


@st.composite
def similarities(draw):
    """Draw how a maze is moved, turned, mirrored and scaled."""
    return draw_similarity(FromHypothesis(draw))
