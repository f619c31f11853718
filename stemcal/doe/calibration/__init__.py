"""Calibration: factor settings at which surfaces predict the measured responses, and their confidence intervals."""
