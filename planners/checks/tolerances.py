"""What the exact checkers allow, in the plane and in space."""

PINCH_TOLERANCE = 1e-3
"""Largest depth between two poses, in link lengths."""

ROUNDING = 1e-9
"""What counts as rounding, in link lengths."""

STEP_LIMIT = 0.05
"""Largest movement of a joint between two poses, in link lengths."""
