"""The spec as data: a class for each section and a field for each key, in internal units."""
