"""Head and foot of the page: question, calibrated parameters and their scope, next step, citation."""

from dataclasses import dataclass

from stemcal.drawing.showing import RANGE
from stemcal.formats import series, short, significant, unit_written, with_unit
from stemcal.notes import Remedy
from stemcal.report.outcome import cited_ranges, showing_of
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.results import Results
from stemcal.stages.screen.result import ScreenResult
from stemcal.stages.verdict.result import Verdict
from stemcal.stages.verdict.words import brief
from stemcal.study.model.study import Study
from stemcal.study.types.factor import FRICTION, SETTINGS
from stemcal.study.types.units import from_internal
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


def scope(study: Study, results: Results) -> list[tuple[str, str]]:
    """Return the scope of a calibration as titles and sentences; nothing before the calibration."""
    if (solved := results.of(InvertResult)) is None:
        return []
    condition, at = study.naming.condition, [target.condition for target in study.targets.means]
    ends = " to ".join(dict.fromkeys((short(min(at)), short(max(at)))))
    valid = [f"{condition.long} {with_unit(ends, condition.unit)}"] if condition is not None else []
    settings = {name: f"{name} {value.partition(' (')[0]}" for name, value in (solved.depends_on or {}).items()}
    cut, stem = _settings(study) if study.kind.simulates_stems else ([], {})
    valid += [*cut, *(f"the test `{test.name}`" for test in study.tests)]
    valid += [text for name, text in settings.items() if name not in study.places]
    free = [f for f in study.factors if f.name not in solved.point.solution]
    middle = series(f"{f.name} {with_unit(short(f.centre), f.unit)}" for f in free)
    assumed = [f"the middle of the ranges of all other factors ({middle})"] if free else []
    assumed += [text for name, text in (stem | settings).items() if name not in study.names and text not in valid]
    for prior in solved.priors:
        mean, sd = (with_unit(short(value), prior.unit) for value in (prior.mean, prior.sd))
        assumed.append(f"a prior for {prior.factor} of {mean} (standard deviation {sd})")
    lines = [("Valid for", valid), ("Assumed", assumed)]
    screened = results.of(ScreenResult)
    sentences = showing_of(screened).outcome(screened, Wording(study.naming))[-1:] if screened is not None else []
    return [("Factors", text) for text in sentences] + [(title, f"{series(texts)}.") for title, texts in lines if texts]


def _settings(study: Study) -> tuple[list[str], dict[str, str]]:
    """Return texts of the settings of the cut, and texts of the properties of stem, contact and mesh by their names."""
    supports = [key for key in study.supports.keys_in_use if key != "fillet_radius"]
    keys = [*supports, "edge_angle", "edge_radius", "thickness", "speed"]
    numbers = {name: (place.parameter, place.value) for name, place in study.places.items()}
    numbers |= {key: (SETTINGS[key].parameter, getattr(getattr(study, SETTINGS[key].section), key)) for key in keys}
    texts = {}
    for name, (parameter, value) in numbers.items():
        if isinstance(value, int | float):
            unit = "mm/min" if name == "speed" and value < 100.0 else parameter.unit
            label = parameter.label.replace("clearance", "clearance between the supports")
            texts[name] = f"{label} {with_unit(short(from_internal(value, unit)), unit)}".replace(" deg", "°")
    until = "the whole cut" if study.loading.until == "severed" else "the cut up to the first fracture"
    contact, ratio = study.contact, study.specimen.ratio_at(study.targets.calibrate_at)
    return [until, *(texts[key] for key in keys if key not in study.names)], {
        "replicates": "one mesh position (the intervals exclude the scatter over positions; add `replicates: 5`)",
        **{name: texts[name] for name in study.places if name in texts},
        FRICTION: f"friction {contact.static_friction:g} (static) and {contact.dynamic_friction:g} (dynamic)",
        "diameter_ratio": f"a hollow stem with a bore of {ratio:.2g} times the diameter" if ratio else "a solid stem",
        "": "no effect of the strain rate" if study.solver.rate == "none" else f"rate law `{study.solver.rate}`",
    }


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
