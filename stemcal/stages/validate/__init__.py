"""The validation: every measured diameter against the calibrated model."""
