"""Runs that people do: the sheet of those that are awaited, and entering its results."""
