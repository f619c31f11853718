"""The study folder: records of runs, stage files, tables, lock and log."""
