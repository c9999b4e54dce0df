"""`python -m planners` is `hrsnake`."""

from planners.cli import main

if __name__ == "__main__":
    main()
