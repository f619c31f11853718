"""The scope of a calibration: significant factors, the tests for which the parameters are valid, and assumptions."""

from stemcal.formats import series, short, with_unit
from stemcal.report.outcome import showing_of
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.results import Results
from stemcal.stages.screen.result import ScreenResult
from stemcal.study.model.study import Study
from stemcal.study.types.factor import FRICTION, SETTINGS
from stemcal.study.types.units import from_internal
from stemcal.vocabulary import Wording


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
