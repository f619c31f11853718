"""The Python face: what scripts and notebooks use; nothing here prints or exits."""
