"""`python -m stemcal` is the command `stemcal`."""

import gc
import sys

from stemcal.processes.interrupts import Terminated, heard, ignore_signals


def main() -> None:
    """Entry point of the console script; Ctrl-C while the command is still loading ends it without a word."""
    try:
        with heard():
            from stemcal.cli.app import main as command

            command()
    except KeyboardInterrupt as interrupt:
        sys.exit(143 if isinstance(interrupt, Terminated) else 130)
    finally:
        ignore_signals()
        gc.freeze()  # the interpreter would search all that is loaded for garbage before it ends: half a second


if __name__ == "__main__":
    main()
