"""Rules on the climb: the steps of one's own."""

from __future__ import annotations

from collections.abc import Iterator

from stemcal.study.rules.draft import Draft, Finding
from stemcal.words import did_you_mean


def steps_stay_inside(draft: Draft) -> Iterator[Finding]:
    """`climb.step_sizes` belong to factors, and the first step stays in their ranges."""
    if draft.climb is None:
        return
    known = {factor.name: factor for factor in draft.factors.values()}
    for name, size in draft.climb.step_sizes.items():
        path = ("climb", "step_sizes", name)
        if name not in draft.names:
            message = f"{name[:60]!r} is not a factor of this study"
            yield Finding(path, message, did_you_mean(name, draft.names), at_key=True)
        elif name in known and size > known[name].half_range * (1.0 + 1e-9):
            factor = known[name]
            message = f"a step of {size:g} from the middle, {factor.centre:g}, leaves {factor.low:g} to {factor.high:g}"
            yield Finding(path, message, f"take at most {factor.half_range:g}")
