"""Run the command line with ``python -m thermaxis``."""

from thermaxis.cli import main

if __name__ == "__main__":
    raise SystemExit(main())
