"""The one exception that means "the input is at fault, not the program"."""

__all__ = ["InputError"]


class InputError(ValueError):
    """Say in one sentence what was expected, what came, and what would be accepted.

    Raised only at public boundaries. The command line prints it without a traceback and exits with 2;
    any other exception is a bug of ours and keeps its traceback.
    """
