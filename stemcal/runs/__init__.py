"""Runs: from a request to a recorded answer, and what becomes of those that fail."""
