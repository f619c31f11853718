"""`python -m stemcal` is the command `stemcal`."""

import atexit
import signal
import sys

from stemcal.interrupts import QuietHook, heard
from stemcal.leaving import leave_at_once

_INTERRUPTED = (130, 143)  # exit codes of Ctrl-C and SIGTERM


class _Ending:
    """Ends the process with a code once all else that was to be done at exit is done."""

    def __init__(self) -> None:
        self.code = 1
        # the first to be registered is the last to be called
        atexit.register(lambda: leave_at_once(self.code))


def main() -> None:
    """Entry point of the console script; Ctrl-C while the command is still loading ends it without a word.

    For a process of its own: this is how it will end.
    """
    ending = _Ending()
    sys.unraisablehook = quiet = QuietHook()
    try:
        with heard(signal.SIGINT):
            from stemcal.cli.app import main as command

            command()
        ending.code = 0
    except SystemExit as left:
        ending.code = left.code if isinstance(left.code, int) else int(left.code is not None)
        quiet.interrupted |= ending.code in _INTERRUPTED
        raise
    except KeyboardInterrupt:
        ending.code, quiet.interrupted = 130, True
        sys.exit(130)


if __name__ == "__main__":
    main()
