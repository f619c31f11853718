"""The Python interface for scripts and notebooks; its functions neither print nor exit."""
