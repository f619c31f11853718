"""The exit codes of the commands; `stemcal.errors` has that of each error, `stemcal.cli.guard` ends the command."""

EXIT_CODES = {
    0: ("done", "success"),
    1: ("fault", "system error (disk, memory), damaged file or internal error"),
    2: ("wrong", "invalid spec or command line"),
    3: ("runs_failed", "runs failed"),
    4: ("unreachable", "the target is out of reach"),
    5: ("in_use", "another process is using the study folder"),
    6: ("waiting", "results of manual runs are pending"),
    130: ("interrupted", "interrupted by Ctrl-C"),
    143: ("terminated", "terminated by SIGTERM"),
}
"""The exit codes: the `status` in the JSON envelope, and what each means."""
