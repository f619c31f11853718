"""Rows of the `targets` of a spec, written from measured forces."""

from collections.abc import Callable, Mapping, Sequence

from stemcal.measured.shear import GradeForces, ShearTests
from stemcal.measured.statistics import Summary

_DIGITS = 4
Show = Callable[[float], str]


def target_rows(tests: ShearTests, travel_and_work: bool = False) -> list[str]:
    """Return a row in YAML for every grade: mean, standard deviation and number of specimens; also comments.

    With `travel_and_work` they also have the travel to the maximum and the work done by then.
    """
    made_up = ["# SYNTHETIC data, not measured"] if tests.synthetic else []
    return [*made_up, *(_row(grade, travel_and_work) for grade in tests.grades)]


def section_of(rows: Sequence[str]) -> str:
    """Return the section `targets` with these rows as YAML."""
    return "".join(["targets:\n", *(f"  {row if row.startswith('#') else f'- {row}'}\n" for row in rows)])


def _row(grade: GradeForces, travel_and_work: bool) -> str:
    means = {"force": (grade.summary, "N")}
    if travel_and_work:
        means |= {"travel": (grade.travel, "mm"), "work": (grade.work, "mJ")}
    return row_of(grade.diameter, means, grade.summary.n, _short)


def row_of(diameter: float, means: Mapping[str, tuple[Summary, str]], n: int, shown: Show, test: str = "") -> str:
    """Return a row of YAML for means by response, each with its unit."""
    values = ", ".join(f"{name}: {shown(mean.mean)} {unit}" for name, (mean, unit) in means.items())
    known = {name: f"{shown(mean.sd)} {unit}" for name, (mean, unit) in means.items() if mean.sd is not None}
    sd = next(iter(known.values()), "")
    if len(means) > 1:
        sd = f"{{{', '.join(f'{name}: {one}' for name, one in known.items())}}}" if known else ""
    of_test = f"test: {test}, " if test else ""
    apart = ",\n     " if len(means) > 2 else ", "
    return f"{{{of_test}diameter: {diameter:g} mm, {values}{sd and f'{apart}sd: {sd}'}, n: {n}}}"


def _short(value: float) -> str:
    """Return a value with as many digits as a laboratory has."""
    return f"{value:.{_DIGITS}g}" if value < 1000 else f"{value:.1f}"
