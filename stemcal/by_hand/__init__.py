"""Manual runs: the run sheet, the solver that reads results from it, and the check of the results that people enter."""
