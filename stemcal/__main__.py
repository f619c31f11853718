"""`python -m stemcal` is the command `stemcal`."""

import sys


def main() -> None:
    """Entry point of the console script; Ctrl-C while the command is still loading ends it without a word."""
    try:
        from stemcal.cli.app import main as command

        command()
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
