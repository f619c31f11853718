"""Runs of a solver: executors, the recorded answers, and the repetition of failed runs."""
