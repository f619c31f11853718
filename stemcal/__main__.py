"""`python -m stemcal` is the command `stemcal`."""

import gc
import sys

from stemcal.processes.interrupts import Terminated, ignore_signals, raising_interrupts


def main() -> None:
    """Entry point of the console script; Ctrl-C during the imports ends the process without a message."""
    try:
        with raising_interrupts():
            from stemcal.cli.app import main as command

            command()
    except KeyboardInterrupt as interrupt:
        sys.exit(143 if isinstance(interrupt, Terminated) else 130)
    finally:
        ignore_signals()
        gc.freeze()  # skips the garbage collection at exit, which takes half a second


if __name__ == "__main__":
    main()
