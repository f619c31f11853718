"""The study: types of values, classes for the sections of a spec, rules across sections, and reading of a spec."""
