"""The audit of a paper: everything printed is computed again, and what does not agree is listed."""
