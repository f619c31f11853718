"""Runs done by hand: the run sheet, the solver that reads it, and the results that people enter."""
