"""Figures, each from a typed result."""
