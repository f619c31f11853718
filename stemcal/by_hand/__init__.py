"""Runs that people do: the sheet of those that are awaited, and what becomes of a sheet that is filled in."""
