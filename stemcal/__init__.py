"""Calibrate finite element models of plant stems against measured cutting force."""

__version__ = "0.1.0"
