"""Types of the fields of sections: quantities with a unit, lengths, files next to the spec, names.

The same models validate specs and values from Python. In a spec (validation context ``{"spec": folder}``), a quantity
is a text with its unit, and a file name is relative to the folder of the spec; from Python both are used unchanged.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Union
from unicodedata import category

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    InstanceOf,
    PlainSerializer,
    StringConstraints,
    TypeAdapter,
    ValidationError,
    WithJsonSchema,
)
from pydantic import GetJsonSchemaHandler as JsonHandler
from pydantic_core import CoreSchema, InitErrorDetails, PydanticCustomError, PydanticKnownError, core_schema

from stemcal.formats import listed, nearest
from stemcal.registry import Registry
from stemcal.storage.encodings import unprintable
from stemcal.study.types import units


def complain(message: str, remedy: str = "") -> PydanticCustomError:
    """Return an error to raise in a validator, which is reported as one `SpecProblem`."""
    return PydanticCustomError("stemcal", "{message}", {"message": message, "remedy": remedy})


class Frozen(BaseModel):
    """Base of all sections: immutable, without unknown keys, with finite numbers only.

    For the section of a stage, `rules` yield mistakes in a spec, and `doubts` probable mistakes.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)
    rules: ClassVar[tuple[Callable[[Any], Iterator[Any]], ...]] = ()
    doubts: ClassVar[Callable[[Any], Iterable[Any]]] = lambda _study: ()

    if not TYPE_CHECKING:  # a type checker that saw this method would accept every attribute

        def __getattr__(self, name: str) -> Any:
            if name in type(self).model_fields:
                raise Missing(f"{type(self).__name__}.{name}")
            return super().__getattr__(name)


class Missing(Exception):
    """Raised by access to a field that is invalid in the spec; the reader of the section reports the mistake."""


def without_fields(section: BaseModel, names: Iterable[str]) -> None:
    """Remove the fields that are invalid in the spec from a section, so that access to them raises `Missing`."""
    for name in names:
        section.__dict__.pop(name, None)


def has_fields(section: BaseModel, *names: str) -> bool:
    """Check that a section has all of these fields, so that access raises no `Missing`."""
    return section.__dict__.keys() >= set(names)


def field_or_none(section: object, name: str) -> Any:
    """Return a field of a section; None if the section or the field is missing or does not exist."""
    return None if section is None else vars(section).get(name)


@dataclass(frozen=True)
class OneOf:
    """Validates a section whose keys depend on its key `kind`; messages name the kind as `noun`.

    With `first_is_usual`, `kind` may be omitted for the first kind unless the keys indicate another kind.
    """

    kinds: Registry[Any]
    noun: str
    first_is_usual: bool = False

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(self._read)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: JsonHandler) -> dict[str, Any]:
        options: Any = Union[tuple(kind.options for kind in self.kinds.all)]  # noqa: UP007
        return handler(TypeAdapter(Annotated[options, Field(discriminator="kind")]).core_schema)

    def _read(self, raw: Any, info: core_schema.ValidationInfo) -> Any:
        if isinstance(raw, Frozen):
            return raw
        if not isinstance(raw, Mapping):
            raise PydanticKnownError("dict_type")
        names = [kind.name for kind in self.kinds.built_in]
        if "kind" not in raw:
            known = {kind.name: len(raw.keys() & kind.options.model_fields.keys()) for kind in self.kinds.built_in}
            likely = max(names, key=lambda name: known[name])
            if not self.first_is_usual or likely != names[0]:
                raise complain("'kind' is missing", f"add kind: {likely if known[likely] else listed(names)}")
            raw = {"kind": likely, **raw}
        name = raw["kind"] if isinstance(raw["kind"], str) else ""
        if (kind := self.kinds.named(name)) is not None:
            return kind.options.model_validate(raw, context=info.context)
        near = nearest(name, names)
        remedy = f"did you mean {near}?" if near else f"write kind: {listed(names)}"
        if (broken := self.kinds.broken.get(name)) is not None:
            remedy = f"the package that defines this kind cannot be loaded: {broken}"
        wrong = complain(f"{str(raw['kind'])[:60]!r} is not a known kind of {self.noun}", remedy)
        raise ValidationError.from_exception_data("kind", [InitErrorDetails(type=wrong, loc=("kind",), input=raw)])


@dataclass(frozen=True)
class Quantity:
    """Type of a number with a unit: bounds are in internal units; errors suggest `unit`, or the usual unit."""

    dimension: str
    above: float = -math.inf
    at_least: float = -math.inf
    below: float = math.inf
    unit: str = ""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_before_validator_function(self.read, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: JsonHandler) -> dict[str, Any]:
        return {"type": "string", "examples": [f"1 {units.INTERNAL[self.dimension]}"]}

    def read(self, raw: Any, info: core_schema.ValidationInfo) -> float:
        """Return the internal value of `raw`: a text with a unit, or (from Python) a number in internal units."""
        return self.checked(raw, from_yaml=info.context is not None)

    def checked(self, raw: Any, from_yaml: bool) -> float:
        """Return the same as `read`, outside the validation of a model."""
        value = self._parsed(raw, from_yaml)
        unit = units.INTERNAL[self.dimension]
        if not abs(value) <= MOST:
            raise complain(f"{raw} is not between -{MOST:g} and {MOST:g}", "check the number and its unit")
        if not value > self.above:
            raise complain(f"{raw} must be above {self.above:g} {unit}", "write a larger value")
        if not value >= self.at_least:
            raise complain(f"{raw} must not be below {self.at_least:g} {unit}", "write a larger value")
        if not value < self.below:
            raise complain(f"{raw} must be below {self.below:g} {unit}", "write a smaller value")
        return value

    def _parsed(self, raw: Any, from_yaml: bool) -> float:
        usual = self.unit or units.usual_unit(self.dimension)
        if isinstance(raw, str):
            try:
                return units.parse(raw, self.dimension, usual)
            except units.UnitError as error:
                raise complain(error.message, error.remedy) from None
        raw = raw.item() if hasattr(raw, "item") else raw  # convert a numpy scalar to a Python number
        if isinstance(raw, bool) or not isinstance(raw, int | float):
            raise complain("the value is not a number with a unit", f'write a value such as "1 {usual}"')
        if from_yaml:
            raise complain(f"{raw:g} has no unit", units.with_unit(f"{raw:g}", self.dimension, usual))
        return float(raw) if -MOST <= raw <= MOST else math.inf  # float() fails for integers of 400 digits


def _resolve_file(raw: Any, info: core_schema.ValidationInfo) -> Any:
    if info.context is None:
        return raw
    if not isinstance(raw, str) or not raw.strip() or "\0" in raw or len(raw) > 1000:
        raise complain("the value is not a valid file name", "write a path relative to the spec")
    folder: Path = info.context["spec"]
    outside = complain(f"{raw!r} is outside the spec folder", "copy the file into the spec folder")
    windows = PureWindowsPath(raw)
    if Path(raw).is_absolute() or windows.drive or windows.root or ".." in windows.parts:
        raise outside
    try:
        path = (folder / raw).resolve()
        is_file = path.is_file()
    except (OSError, RuntimeError, ValueError):
        raise complain(f"the file {raw!r} cannot be opened", "check the file name") from None
    if not path.is_relative_to(folder.resolve()):
        raise outside
    if not is_file:
        raise complain(f"the file {raw!r} does not exist ({path})", "write the path relative to the spec")
    return path


SpecFile = Annotated[
    Path,
    BeforeValidator(_resolve_file),
    WithJsonSchema({"type": "string", "description": "Path of a file, relative to the spec."}),
]
"""Resolved path of a file inside the folder of the spec; only for a path in YAML, the file is known to exist."""

MOST = 1e30  # largest absolute value of a number, so that its powers do not overflow
Number = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-MOST, le=MOST)]
Whole = Annotated[int, Field(strict=True)]

Size = Annotated[float, Quantity("length", above=0)]
SizeOrZero = Annotated[float, Quantity("length", at_least=0)]
Time = Annotated[float, Quantity("time", above=0)]
Speed = Annotated[float, Quantity("speed", above=0)]
Flag = Annotated[bool, Field(strict=True)]
Share = Annotated[Number, Field(gt=0, le=1)]


def _readable(text: str) -> str:
    """Refuse control and invisible characters, which could change a terminal or the direction of a line of text."""
    if (character := unprintable(text)) is not None:
        raise complain(f"the text contains the invisible or control character {character}", "remove the character")
    if text and not any(category(letter)[0] in "LNPS" for letter in text):
        raise complain(f"the text {text!a} has no visible character", "write a letter or a digit")
    return text


Readable = AfterValidator(_readable)
Title = Annotated[
    str, StringConstraints(strict=True, max_length=300), AfterValidator(lambda text: _readable(" ".join(text.split())))
]
Label = Annotated[str, StringConstraints(strict=True, strip_whitespace=True, min_length=1, max_length=80), Readable]

_RESERVED_COLUMNS = {"run", "row", "response", "condition", "force", "diameter", "status", "key", "reason"}


def _column_name(name: str) -> str:
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name):
        remedy = "use letters, digits and underscores, as in `yield_stress`"
        raise complain(f"{name[:60]!r} is not allowed as a column name", remedy)
    return name


def _factor_name(name: str) -> str:
    _column_name(name)
    if name.lower() in _RESERVED_COLUMNS:
        raise complain(f"{name!r} is the name of a result column", "choose another name")
    return name


_COLUMN = WithJsonSchema({"type": "string", "pattern": "^[A-Za-z_][A-Za-z0-9_]*$", "maxLength": 40})
FactorName = Annotated[str, StringConstraints(strict=True, max_length=40), AfterValidator(_factor_name), _COLUMN]
ColumnName = Annotated[str, StringConstraints(strict=True, max_length=40), AfterValidator(_column_name), _COLUMN]

_DEVICES = {"con", "prn", "aux", "nul"} | {f"{port}{i}" for port in ("com", "lpt") for i in range(10)}


def _study_name(name: str) -> str:
    if not re.fullmatch(r"[\w-]([\w. -]{0,62}[\w-])?", name) or len(name.encode()) > 200:
        remedy = "use up to 64 letters, digits, hyphens and underscores"
        raise complain(f"{name[:80]!r} is not allowed as a folder name", remedy)
    if name.split(".")[0].rstrip().lower() in _DEVICES:
        raise complain(f"{name!r} is a reserved device name on Windows", "choose another name")
    return name


StudyName = Annotated[
    str,
    StringConstraints(strict=True),
    AfterValidator(_study_name),
    WithJsonSchema({"type": "string", "maxLength": 64}),
]
_SHARE = re.compile(r"d\s*/\s*([0-9]+(?:\.[0-9]*)?|\.[0-9]+)", re.ASCII)


@dataclass(frozen=True)
class Length:
    """A length in mm, such as ``0.5 mm``, or the stem's outer diameter over `divisor`, such as ``d/8``."""

    mm: float = 0.0
    divisor: float | None = None

    def at(self, condition: float) -> float:
        """Return the length for a stem whose outer diameter is `condition`, mm."""
        return self.mm if self.divisor is None else condition / self.divisor

    def __str__(self) -> str:
        return f"{self.mm:g} mm" if self.divisor is None else f"d/{self.divisor:g}"


def _reader(millimetres: Quantity) -> BeforeValidator:
    def read(raw: Any, info: core_schema.ValidationInfo) -> Any:
        if isinstance(raw, Length):
            return raw
        share = _SHARE.fullmatch(raw.strip()) if isinstance(raw, str) else None
        if share is None:
            return Length(millimetres.read(raw, info))
        if not 0.1 <= float(share[1]) <= 1000.0:
            remedy = "divide the diameter by a number from 0.1 to 1000, as in `d/8`"
            raise complain(f"{raw} is not a plausible fraction of a diameter", remedy)
        return Length(divisor=float(share[1]))

    return BeforeValidator(read)


_ABOVE_ZERO, _FROM_ZERO = Quantity("length", above=0), Quantity("length", at_least=0)
_AS_TEXT = PlainSerializer(str, return_type=str)
_TEXT = WithJsonSchema({"type": "string", "examples": ["1 mm", "d/8"]})

StemLength = Annotated[InstanceOf[Length], _reader(_ABOVE_ZERO), _AS_TEXT, _TEXT]
StemLengthOrZero = Annotated[InstanceOf[Length], _reader(_FROM_ZERO), _AS_TEXT, _TEXT]
