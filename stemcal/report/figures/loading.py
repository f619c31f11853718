"""What drawing needs that takes a while to load."""

from __future__ import annotations


def load() -> None:
    """Load every figure's module and matplotlib. Runs in a worker that has nothing else to do."""
    import stemcal.report.figures.gallery  # noqa: F401
    from stemcal.report.figures.style import installed_fonts

    installed_fonts()
