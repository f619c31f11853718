"""The Python interface for scripts and notebooks, whose functions neither print nor end the process."""
