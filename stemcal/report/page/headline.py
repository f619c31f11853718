"""Head and foot of the page: the question of the study, the calibrated parameters, the next step, the citation."""

from dataclasses import dataclass

from stemcal.drawing.showing import RANGE
from stemcal.formats import series, significant, unit_written
from stemcal.notes import Remedy
from stemcal.report.outcome import cited_ranges
from stemcal.stages.results import Results
from stemcal.stages.verdict.result import Verdict
from stemcal.stages.verdict.words import brief
from stemcal.study.model.study import Study
from stemcal.version import __version__, code_version
from stemcal.vocabulary import Wording

_REPORT = Remedy("Report the parameter values, their confidence intervals and the simulation settings.")
_LOOK = Remedy("See the reasons below.")


@dataclass(frozen=True)
class Card:
    """A calibrated parameter: name, value, unit, and confidence interval (`range`), all as text."""

    name: str
    value: str
    unit: str
    range: str

    @property
    def limited(self) -> bool:
        """Whether the interval ends at a limit of the search range, so that its true end is unknown."""
        return "≤" in self.range or "≥" in self.range

    def __str__(self) -> str:
        value = f"{self.name} = {self.value} {self.unit}".rstrip()
        return f"{value} ({RANGE}: {self.range})" if self.range else value


def headline(results: Results, study: Study, holds: bool = True) -> list[Card]:
    """Return a card for each calibrated parameter; its interval is empty if the study is not calibrated."""
    ranges, cards = cited_ranges(results), []
    for name, value in (results.parameters if ranges else {}).items():
        if name in ranges:
            factor = study.factor(name)
            unit = unit_written(factor.unit)
            limits = f"{ranges[name]} {unit}".rstrip() if holds and ranges[name] else ""
            cards.append(Card(factor.label or name, significant(value), unit, limits))
    return cards


def lead(verdict: Verdict, use: str) -> list[str]:
    """Return a line for each reason of the verdict; without a reason, `use`: where the result may be used."""
    return [brief(reason) for reason in verdict.reasons] or ([use] if use else [])


def first_remedy(verdict: Verdict) -> Remedy:
    """Return the remedy of the first reason that has one; without any, what to do with the result."""
    remedies = [reason.remedy for reason in verdict.reasons if reason.remedy]
    return remedies[0] if remedies else _REPORT if verdict.holds else _LOOK


def quantity_calibrated(study: Study) -> str:
    """Return the subject of the study, such as "Calibration of a stem-cutting model"."""
    if study.goal is not None:
        return "Optimisation of a cutter" if study.naming.is_cutting else "Optimisation of a simulated response"
    if study.naming.is_cutting:
        return "Calibration of a stem-cutting model"
    return f"Calibration of a simulation against the measured {_fitted(study)}"


def question(study: Study) -> str:
    """Return the question that the study answers, such as "Which parameter values reproduce the measured force?"."""
    naming = study.naming
    if (goal := study.goal) is not None:
        ways = {"minimise": goal.minimise, "maximise": goal.maximise}
        wanted = (f"{way} the {series(naming.named(n).long for n in names)}" for way, names in ways.items() if names)
        return f"Which {series(factor.label.lower() for factor in study.factors)} {' and '.join(wanted)}?"
    targets = study.joint_targets or (study.calibration_target,)
    place = ""
    if naming.condition is not None:
        place = Wording(naming).at(*(target.condition for target in targets))
        place = place.replace(" at ", " of stems with ", 1) if naming.is_cutting else place
    return f"Which parameter values reproduce the measured {_fitted(study)}{place}?"


def _fitted(study: Study) -> str:
    return series(study.naming.named(name).long for name in study.fitted_responses)


def made_with(study: Study, spec_hash: str) -> list[tuple[str, str]]:
    """Return (name, value) rows on spec, solver and program, with which a reader can repeat and cite the study."""
    return [
        ("Spec", f"{study.source.name}, SHA-256 {spec_hash}" if spec_hash else study.source.name),
        ("Solver", study.solver.program_name),
        ("Written by", f"stemcal {code_version()}"),
        (
            "Cite",
            f"The stemcal developers: stemcal, version {__version__}. Publish the spec together with your results.",
        ),
    ]
