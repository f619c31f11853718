"""The Python interface for scripts and notebooks; nothing here prints or exits."""
