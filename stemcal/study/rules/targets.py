"""Rules on what was measured and what was published: diameters, forces, other responses, claims."""

from __future__ import annotations

import math
from collections.abc import Iterator

from stemcal.study.model import Target
from stemcal.study.spec.draft import Draft, Finding
from stemcal.words import did_you_mean

_CLOSE = 1e-9
CLAIMS = (
    "r2",
    "adjusted_r2",
    "predicted_r2",
    "adequate_precision",
    "cv_percent",
    "max_abs_error_percent",
    "mean_abs_error_percent",
)


def diameters_differ(draft: Draft) -> Iterator[Finding]:
    """Each diameter has one target."""
    seen: dict[float, int] = {}
    for index, target in enumerate(draft.targets.forces if draft.targets else ()):
        first = seen.setdefault(round(target.diameter, 9), index)
        if first != index:
            message = f"diameter {target.diameter:g} mm has two forces"
            remedy = "keep one; give the mean force with sd and n"
            yield Finding(("targets", "forces", index, "diameter"), message, remedy)


def calibration_has_target(draft: Draft) -> Iterator[Finding]:
    """The diameter to calibrate at is one of the measured ones."""
    if draft.targets is None:
        return
    diameters = [target.diameter for target in draft.targets.forces]
    at = draft.targets.calibrate_at
    if not any(math.isclose(at, diameter, rel_tol=_CLOSE) for diameter in diameters):
        measured = ", ".join(f"{diameter:g}" for diameter in diameters[:20])
        message = f"no force is given for {at:g} mm, only for {measured} mm"
        yield Finding(("targets", "calibrate_at"), message, "add its force or calibrate at another diameter")


def joint_diameters_measured(draft: Draft) -> Iterator[Finding]:
    """`invert.diameters` names measured diameters, and the solver can answer at each."""
    if draft.invert is None or draft.invert.diameters is None or draft.targets is None:
        return
    if draft.solver and draft.solver.kind == "table":
        message = "the tables hold forces of one diameter only"
        yield Finding(("invert", "diameters"), message, "remove it, or use the embedded solver")
    if draft.invert.diameters == "all":
        return
    measured = [target.diameter for target in draft.targets.forces]
    for index, diameter in enumerate(draft.invert.diameters):
        if not any(math.isclose(diameter, other, rel_tol=_CLOSE) for other in measured):
            listing = ", ".join(f"{other:g}" for other in measured[:20])
            message = f"no force is given for {diameter:g} mm, only for {listing} mm"
            yield Finding(("invert", "diameters", index), message, "add its force to targets, or remove it here")


def process_fits_one_force(draft: Draft) -> Iterator[Finding]:
    """A Gaussian process proposes points for one measured force."""
    invert, refine = draft.invert, draft.refine
    if invert is None or refine is None or refine.model == "quadratic":
        return
    if invert.diameters is not None or len(invert.responses) > 1:
        message = "a joint fit is refined on quadratics"
        yield Finding(("refine", "model"), message, "leave it out, or fit one force: leave invert.diameters out")


def responses_measured(draft: Draft) -> Iterator[Finding]:
    """What is fitted beside the force is measured, with its scatter as the weight, and simulated."""
    if draft.invert is None or draft.targets is None or draft.invert.responses == ("force",):
        return
    path, names = ("invert", "responses"), draft.invert.responses
    if draft.solver and draft.solver.kind != "embedded":
        yield Finding(path, f"solver {draft.solver.kind} answers with a force only", "remove it")
    if "force" not in names or len(set(names)) < len(names):
        message = f"{', '.join(names)}: the force belongs there, and each once"
        yield Finding(path, message, "write [force, travel, work]")
    for name in names:
        yield from _weighed(draft.targets.forces, name)


def _weighed(targets: tuple[Target, ...], name: str) -> Iterator[Finding]:
    """Demand a value and a standard deviation of a response at one diameter at least."""
    sd = "sd" if name == "force" else f"{name}_sd"
    given = [target for target in targets if getattr(target, name) is not None]
    if not given:
        yield Finding(("invert", "responses"), f"no {name} is given in targets.forces", "add it, or remove it here")
    elif all(getattr(target, sd) is None for target in given):
        message = f"{name} has no {sd} at any diameter: there is nothing to weigh it by"
        yield Finding(("invert", "responses"), message, f"add {sd} to a target")


def published_factors_exist(draft: Draft) -> Iterator[Finding]:
    """A published solution names factors of the study."""
    for section in ("solution", "called") if draft.published else ():
        for name in getattr(draft.published, section):
            if name not in draft.names:
                message = f"{name[:60]!r} is not a factor of this study"
                remedy = did_you_mean(name, draft.names)
                yield Finding(("published", section, name), message, remedy, at_key=True)


def claims_known(draft: Draft) -> Iterator[Finding]:
    """A printed claim is about a number that the audit computes."""
    for name in draft.published.claims if draft.published else ():
        if name not in CLAIMS:
            message = f"{name[:60]!r} is no claim the audit knows"
            yield Finding(("published", "claims", name), message, did_you_mean(name, CLAIMS), at_key=True)
