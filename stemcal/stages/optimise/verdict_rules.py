"""Rules of the verdict on an optimum: limits, failed runs, significance of the gain, ends of ranges."""

from collections.abc import Iterator
from math import isclose

from stemcal.formats import outwards, series, with_unit
from stemcal.notes import Note, Remedy
from stemcal.stages.optimise.analysis import problem_of
from stemcal.stages.optimise.result import OptimiseResult
from stemcal.stages.optimise.search import NoneAllowed
from stemcal.stages.rsm.result import RsmResult
from stemcal.stages.verdict import advice
from stemcal.stages.verdict.verdict_rules import Evidence, Rank, ranked


@ranked(Rank.REACH)
def limits_exclude_all(evidence: Evidence) -> Iterator[Note]:
    """Yield a note if no point of the surfaces satisfies the limits of the goal."""
    surface = evidence.of(RsmResult)
    if surface is not None and evidence.study.goal is not None and evidence.of(OptimiseResult) is None:
        try:
            problem_of(evidence.study, surface).cloud  # noqa: B018
        except NoneAllowed as error:
            yield Note("limits_exclude_all", "error", str(error))


@ranked(Rank.REACH)
def limit_exceeded(evidence: Evidence) -> Iterator[Note]:
    """Yield a note for each limit that the simulated optimum exceeds."""
    if (result := evidence.of(OptimiseResult)) is None:
        return
    for name, limit in result.limits.items():
        named, value = result.naming.named(name), result.simulated[name]
        if value is not None and value > limit:
            shown, lower = named.text(value, ".4g"), outwards(limit * limit / value, up=False)
            text = f"The simulated {named.long} of the optimum is {shown}, above {named.text(limit)}."
            yield Note("limit_exceeded", "error", text, Remedy(f"Lower `goal.at_most` to {named.text(lower)}."))


@ranked(Rank.VALIDATION)
def indistinguishable(evidence: Evidence) -> Iterator[Note]:
    """Yield a note for each response whose gain is unknown, not significant, or negative."""
    if (result := evidence.of(OptimiseResult)) is None:
        return
    kinds: dict[str, list[str]] = {"optimum_failed": [], "not_distinguishable": [], "present_is_better": [], "": []}
    for name, gain in result.gain_percent.items():
        low, high = (0.0, 0.0) if gain is None else (gain[1], gain[2])
        kind = "optimum_failed" if gain is None else "present_is_better" if high is not None and high < 0.0 else ""
        better = gain is not None and gain[0] > 0.0 and (low is None or low > 0.0)
        kinds[kind if kind or better else "not_distinguishable"].append(result.naming.named(name).long)
    what = (
        ("was not simulated for both cutters", "were not simulated for both cutters"),
        ("is not distinguishable from that", "are not distinguishable from those"),
        ("is worse than that", "are worse than those"),
    )
    surface, better_known = evidence.of(RsmResult), bool(kinds.pop(""))
    remedy = None if surface is None else advice.more_runs(surface)
    if better_known and result.front:
        remedy = Remedy("Choose another point of the Pareto front, or limit the response with `goal.at_most`.")
    for (kind, names), words in zip(kinds.items(), what, strict=True):
        if names:
            than = "" if kind == "optimum_failed" else " of the present cutter"
            text = f"The {series(names)} of the optimum {words[len(names) > 1]}{than}."
            yield Note(kind, "warning" if better_known else "error", text, remedy)


@ranked(Rank.IDENTIFICATION)
def at_edge(evidence: Evidence) -> Iterator[Note]:
    """Yield a note for each range at whose end the optimum is."""
    if (result := evidence.of(OptimiseResult)) is None:
        return
    for name, end in result.edges.items():
        factor = evidence.study.factor(name)
        level = with_unit(f"{getattr(factor, end):g}", factor.unit)
        at_end = isclose(result.optimum[name], getattr(factor, end), rel_tol=1e-3, abs_tol=1e-3 * factor.half_range)
        edge = "range" if at_end else "experimental region, towards the end of the range"
        text = f"The optimum is at the edge of the {edge} of {name} ({level})."
        yield Note("at_edge", "warning", text, advice.widened(evidence.study, factor, end == "high", 0.5))


RULES = (limits_exclude_all, limit_exceeded, indistinguishable, at_edge)
