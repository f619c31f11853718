"""Least squares, and the quadratic surface that rests on it."""
