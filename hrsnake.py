"""The `hrsnake` command from its first moment: beside the packages, as Ctrl-C can come while they load."""

from __future__ import annotations

import signal
import sys

__all__ = ["main"]


def main() -> None:
    """Load and run the command. Ctrl-C that comes meanwhile waits, as amid an import it can be any error."""
    pressed: list[int] = []
    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:  # else somebody ignores it, as `nohup` does
        signal.signal(signal.SIGINT, lambda number, _frame: pressed.append(number))
    from planners import cli

    try:
        signal.signal(signal.SIGINT, before)
        if pressed:
            raise KeyboardInterrupt
        cli.main()
    except KeyboardInterrupt:
        print(cli.STOPPED, file=sys.stderr)
        sys.exit(cli.INTERRUPTED)


if __name__ == "__main__":
    main()
