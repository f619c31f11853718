"""Single values from Python, checked as those of a spec are."""

from __future__ import annotations

from typing import Any

from pydantic import TypeAdapter, ValidationError

from stemcal.errors import UsageError
from stemcal.study.reading.messages import finding_of


def checked(kind: Any, given: object, name: str) -> Any:
    """Return a value of a type of the model, such as `Size` for ``8`` or ``"8 mm"``.

    Raises
    ------
    UsageError
        With what is wrong with it, and the remedy.
    """
    try:
        return TypeAdapter(kind).validate_python(given)
    except ValidationError as error:
        wrong = finding_of(error.errors(include_url=False)[0], (name,), (name,))
        raise UsageError(f"{name}: {wrong.message}; {wrong.remedy}") from None
