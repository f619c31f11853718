"""The plan of a study (its runs and their cost), its status, and the checks of its files."""
