"""The commented spec that `stemcal init` writes: a whole study to start from."""

import json
import re
import textwrap
from collections.abc import Collection, Iterator

from pydantic import TypeAdapter, ValidationError

from stemcal.errors import UsageError
from stemcal.study.reading.crops import CROPS, Crop, Range
from stemcal.study.reading.json_schema import choices_of, keys_of, meaning_of
from stemcal.study.types.field_types import StudyName
from stemcal.study.types.strict_yaml import NodePath
from stemcal.words import did_you_mean


def template(name: str = "my-study", crop: str | None = None) -> str:
    """Return a commented spec called `name`, with the published ranges of a crop if one is given.

    Raises
    ------
    UsageError
        If no folder can have that name, or nothing is known of the crop.
    """
    if crop is not None and crop not in CROPS:
        raise UsageError(f"--crop {crop[:60]!r}: nothing is known of it; {did_you_mean(crop, CROPS)}")
    known = CROPS[crop] if crop is not None else None
    written = {
        "NAME": json.dumps(study_name(name), ensure_ascii=False),
        "OF": _about(known),
        "ELASTIC_MODULUS": _range(known.elastic_modulus if known else Range(800, 1200, "")),
        "YIELD_STRESS": _range((known.yield_stress if known else None) or Range(10, 20, "")),
        **(_MESH_OF_A_CROP if known else _MESH),
    }
    text = _commented(_TEXT)
    for key, value in written.items():
        text = text.replace(f"@{key}@", value, 1)
    return text


def study_name(name: str) -> str:
    """Return the name of a study; raise `UsageError` if no folder can have it."""
    try:
        TypeAdapter(StudyName).validate_python(name)
    except ValidationError as error:
        problem = error.errors()[0].get("ctx", {})
        raise UsageError(f"{problem['message']}; {problem['remedy']}") from None
    return name


def _about(crop: Crop | None) -> str:
    """Return what the head of the spec says of its values."""
    if crop is None:
        return "The values below are those of wild chrysanthemum stems; replace them by yours."
    named = "elastic modulus and yield stress" if crop.yield_stress else "the elastic modulus"
    said = (
        f"The ranges of {named} are those published for {crop.plant}, where a search can begin: narrow them to what "
        f"you know of yours. {crop.remark + '. ' if crop.remark else ''}No range was found for the other values: they "
        "are those of wild chrysanthemum stems, as are diameters and forces; replace them by yours."
    )
    return "\n# ".join(textwrap.wrap(said, 116, break_on_hyphens=False))


def _range(ends: Range) -> str:
    """Return the lines of a factor's range, its source above."""
    source = [f"    # {line}" for line in textwrap.wrap(ends.source, 110, break_on_hyphens=False)]
    return "\n".join([*source, f"    low: {ends.low:g}", f"    high: {ends.high:g}"])


_KEY = re.compile(r"(?P<before> *(?:# )? *)(?P<entry>- )?(?P<key>[a-z_]+):(?: |$)")
"""A line that begins with a key, be it switched off by a # before it."""


def _commented(text: str) -> str:
    """Put above the first line of every key what the model says of it, and above a section which keys it leaves out."""
    lines = list(_lines_with_paths(text))
    written = {path for path, _ in lines}
    commented: list[str] = []
    seen: set[NodePath] = {()}
    for path, line in lines:
        if path not in seen:
            commented += _comment(path, line, written)
        seen.add(path)
        commented.append(line)
    return "\n".join([*commented, ""])


def _lines_with_paths(text: str) -> Iterator[tuple[NodePath, str]]:
    """Yield each line with the path of the key that it begins with; the entries of a list share one."""
    above: dict[int, NodePath] = {}
    for line in text.splitlines():
        found = _KEY.match(line)
        path: NodePath = ()
        if found:
            depth = len(found["before"].replace("# ", ""))
            above = {column: key for column, key in above.items() if column < depth}
            if found["entry"]:
                above[depth] = (*above[max(above)], 0)
                depth += len(found["entry"])
            path = (*(above[max(above)] if above else ()), found["key"])
            above[depth] = (*path, "embedded") if path == ("solver",) else path
        yield path, line


def _comment(path: NodePath, line: str, written: Collection[NodePath]) -> list[str]:
    """Return the lines that say what a key means, its choices, and which keys below it are not written."""
    below = (*path, "embedded") if path == ("solver",) else path
    left_out = [key for key in keys_of(below) if (*below, key) not in written]
    said = " ".join(filter(None, [meaning_of(path), " | ".join(choices_of(path))]))
    more = f"More keys: {', '.join(left_out)}." if left_out else ""
    prefix = _prefix(line)
    width = min(116, 120 - len(prefix))
    return [prefix + text for part in (said, more) for text in textwrap.wrap(part, width, break_on_hyphens=False)]


def _prefix(line: str) -> str:
    """Return what a comment above a line begins with.

    >>> _prefix("  low: 1"), _prefix("  - name: a"), _prefix("# mesh:"), _prefix("#   phases: 5")
    ('  # ', '  # ', '# ', '#   # ')
    """
    found = _KEY.match(line)
    before = found["before"] if found else ""
    return before if before.endswith("# ") else f"{before}# "


_MESH = {"PENALTY": "0.25", "COARSENING": "6", "AROUND": "2"}
# Many a crop's stem does not break within the stroke: its force is a stiffness, and feels how the supports give way.
_MESH_OF_A_CROP = {
    "PENALTY": "0.75  # softer supports make a stem that does not break too soft",
    "COARSENING": "2  # longer ones over the supports are too soft where the stem does not break",
    "AROUND": "1",
}

_TEXT = """\
# stemcal study: one file says everything. `stemcal check` names every mistake in it with its line, `stemcal plan` says
# what would be computed, `stemcal run` does it all, `stemcal explain KEY` says what a key means.
#
# Quantities are written with their unit: 8 mm, 100 mm/min, 0.5 s, 37.5 deg, 159.2 N.
# Pure numbers (ratios, friction, counts) have none.
#
# @OF@

schema_version: 1
name: @NAME@
title: Cutting force of a plant stem

factors:
  - name: density
    label: Density
    unit: kg/m3
    low: 1000
    high: 1200
  - name: elastic_modulus
    label: Elastic modulus
    unit: MPa
@ELASTIC_MODULUS@
    expected_sign: "+"
  - name: poisson_ratio
    label: Poisson's ratio
    low: 0.2
    high: 0.4
  - name: yield_stress
    label: Yield stress
    unit: MPa
@YIELD_STRESS@
    expected_sign: "+"
  - name: tangent_modulus
    label: Tangent modulus
    unit: MPa
    low: 0.4
    high: 0.6
    expected_sign: "+"
  - name: hardening_parameter
    label: Hardening parameter
    low: 0
    high: 0.1
  - name: strain_rate_c
    label: Strain rate parameter C
    unit: 1/s
    low: 80
    high: 100
    expected_sign: "-"
  - name: strain_rate_p
    label: Strain rate parameter P
    low: 4
    high: 12
  - name: failure_strain
    label: Failure strain
    low: 0.01
    high: 0.05
    expected_sign: "+"
# Two more can be factors; each takes the place of fixed values below:
#  - {name: stem_friction, low: 0.1, high: 0.4}               # of the friction under contact
#  - {name: wall_thickness, unit: mm, low: 1.5, high: 3}      # of specimen.diameter_ratio

specimen:
  outer_diameter: 8 mm
  diameter_ratio: 0.41
  length: 50 mm

blade:
  length: 90 mm
  width: 28 mm
  thickness: 2.3 mm
  edge_angle: 37.5 deg
  bevel: both
  edge_radius: 0.1 mm
  edge_spread: d/9.5

# A parameter that is not to be calibrated leaves `factors` and gets its value here, such as `density: 1100 kg/m3`.
material:
  internal_length: d/4.5

supports:
  clearance: 20 mm
  fillet_radius: 1 mm

loading:
  speed: 100 mm/min
  duration: 0.5 s
  gap: 0.001 mm

contact:
  static_friction: 0.15
  dynamic_friction: 0.10
  decay: 0 s/mm
  penalty: @PENALTY@
  damping: 0.5

solver:
  kind: embedded
  rate_law: paper
  symmetry: quarter
  element_size: d/16
  edge_over: nodes
  coarsening: @COARSENING@
  coarsening_around: @AROUND@
  hourglass:
    form: stiffness
    coefficient: 0.01
  mass_scaling: 1e4
  time_step: 40 us
  time_step_safety: 0.9
  outputs: 500
  filter_window: 10 ms
  break_drop: 0.5

targets:
  calibrate_at: 8 mm
  forces:
    - diameter: 7 mm
      force: 120 N
      # sd: 6 N
      n: 6
    - {diameter: 8 mm, force: 159.2 N, n: 6}
    - {diameter: 9 mm, force: 213.8 N, n: 6}
    - {diameter: 10 mm, force: 300 N, n: 6}
    - {diameter: 11 mm, force: 378.2 N, n: 6}

screen:
  design: plackett-burman
  centre_points: 0
  fold_over: false
  alpha: 0.05

rsm:
  factors: significant
  design: central-composite
  centre_points: 6
  alpha: rotatable
  core: full
  extra_runs: 0
  reduce: none
  # coding: {yield_stress: {center: 15, half_step: 3}}

invert:
  rule: least_coded_distance

refine:
  tolerance_percent: 1
  budget: 10

# mesh:
#   phases: 5
#   sizes: [d/24]

# transfer:
#   solver: {kind: openradioss, home: /opt/openradioss, element_size: 1 mm}
#   adjust: [failure_strain]
#   diameters: all
#   tolerance_percent: 2
#   budget: 8

# climb:
#   steps: 5
#   step_sizes: {yield_stress: 2}
#   shrink: 0.5

runs:
  tries: 2
  # time_limit: 2 h
  quorum: 0.5
  keep_going: true
  censored: warn
"""
