"""The study: types of values, the model with its keys, rules between them, and reading it from a spec."""
