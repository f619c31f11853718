"""The version of stemcal, below everything else, so that any module may name it."""

__version__ = "0.3.0"
