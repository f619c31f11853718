"""The command line: one file per command; `app` turns errors into exit codes."""
