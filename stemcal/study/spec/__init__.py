"""Reading a spec: from a YAML file to a `Study`, or to every problem in it with its line and what to do."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stemcal.study.spec.reading import load_study, read_study

__all__ = ["load_study", "read_study"]


def __getattr__(name: str) -> object:
    """Return the reader when it is first asked for: the model of a study is made of field types that lie here too."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from stemcal.study.spec import reading

    return getattr(reading, name)
