"""What a response surface says: its outcome, how well it explains its runs, what to beware of."""

from collections.abc import Iterator

from stemcal.doe.regression import surface_notes
from stemcal.doe.regression.canonical import Shape
from stemcal.doe.regression.reduction import ReductionStep
from stemcal.notes import Weight
from stemcal.stages.design import FewSignificant, ManySignificant, StrongestAsked, TableVaries
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.surface.runs import EqualRepeats, EqualSeeds, ScatterOfSeeds, UnequalRepeats
from stemcal.text.language import say
from stemcal.text.names import Names
from stemcal.text.notes import Remark, remark, sentence, states


def outcome(stage: SurfaceResult, names: Names) -> list[str]:
    """Say what was fitted to which runs; copies of a deterministic run are none."""
    responses = [run.response for run in stage.design.runs if run.response is not None]
    count = len(stage.runs_diagnostics)
    template = (
        "A quadratic surface over {factors:factors} was fitted to {runs} runs between {low:response} and "
        "{high:response}."
    )
    said = names.say(template, factors=stage.names, runs=count, low=min(responses), high=max(responses))
    copies = len(responses) - count
    if stage.deterministic and copies > 0:
        said += f" {copies} of its {len(responses)} runs repeat others, which adds nothing where a run has no scatter."
    return [said]


def certainty(stage: SurfaceResult, names: Names) -> list[str]:
    """Say how well the surface explains its runs."""
    if stage.r2 is None:
        return [say("All runs gave the same response: there is nothing that the surface could explain.")]
    lack = stage.anova_row("Lack of fit")
    p = lack.p if lack is not None and stage.lack_of_fit_testable else None
    explained = names.say(
        "The surface explains {share:fixed 1} % of the variation between its runs (R² {r2:fixed 3}, predicted R² "
        "{predicted:fixed 3}).",
        share=100.0 * stage.r2,
        r2=stage.r2,
        predicted=stage.predicted_r2,
    )
    untested = "Its lack of fit cannot be tested."
    misses = "It misses something: lack of fit is significant (p {p:p})."
    fits = "It shows no lack of fit (p {p:p})."
    return [explained, names.say(untested if p is None else misses if p < 0.05 else fits, p=p)]


def remarks(stage: SurfaceResult, names: Names) -> list[Remark]:
    """Return what a surface says beside its tables."""
    said = [remark(note, names) for note in stage.notes]
    facts = [*_facts(stage, names)]
    return [*said, *facts]


def _facts(stage: SurfaceResult, names: Names) -> Iterator[Remark]:
    if stage.reduction is not None:
        yield Remark(_reduction(stage.reduction, names), Weight.TRUST, "reduction")
    if stage.canonical is not None:
        yield Remark(_shape(stage.canonical, names), Weight.ASIDE, "shape")
    by_chance = isinstance(stage.pure_error, ScatterOfSeeds | EqualSeeds)
    if stage.pure_error is not None and (by_chance or stage.lack_of_fit_testable):
        yield remark(stage.pure_error, names)


def _reduction(steps: tuple[ReductionStep, ...], names: Names) -> str:
    removed = (
        "Backward elimination removed {terms:factors}. The same runs chose the terms, so p-values and intervals are "
        "somewhat too favourable."
    )
    template = removed if steps else "Backward elimination removed no term."
    return names.say(template, terms=[step.term for step in steps])


def shape_name(shape: Shape) -> str:
    """Name the kind of a surface."""
    plain = {
        "plane": say("plane"),
        "maximum": say("maximum"),
        "minimum": say("minimum"),
        "saddle": say("saddle"),
    }
    ridged = {
        "maximum": say("maximum with a ridge"),
        "minimum": say("minimum with a ridge"),
        "saddle": say("saddle with a ridge"),
    }
    return (plain | ridged if shape.ridge else plain)[shape.kind]


def _shape(shape: Shape, names: Names) -> str:
    none = "The surface has no single stationary point: it is a plane, or level along some direction."
    inside = (
        "The stationary point ({kind}) has {predicted:response} at coded radius {radius:.2f}, inside the region of "
        "the runs."
    )
    outside = (
        "The stationary point ({kind}) has {predicted:response} at coded radius {radius:.2f}, outside the region of "
        "the runs."
    )
    if shape.coded is None:
        return say(none)
    template = inside if shape.inside else outside
    return names.say(template, kind=shape_name(shape), predicted=shape.predicted, radius=shape.coded_radius)


states(
    surface_notes.SurfaceRunsFailed,
    "{failed} of {runs} runs failed; the surface is fitted to the others, with {df} residual df; the design is no "
    "longer as planned (largest variance inflation factor {inflation:.2f}).",
)
states(
    surface_notes.TermsEntangled,
    "The largest variance inflation is {inflation:.1f}: the runs hardly tell some terms apart, and their coefficients "
    "are uncertain one by one.",
)
states(
    surface_notes.SaturatedSurface,
    "As many coefficients as runs: the surface passes through every run and knows no error.",
)
states(surface_notes.ExactSurface, "The quadratic passes through every run exactly: no F can be formed.")
states(surface_notes.MostlyNoise, "Adequate precision {precision:.2f} is below 4: the surface is mostly noise.")
states(
    surface_notes.CopiesOnly,
    "{repeated} runs repeat others exactly: the solver is deterministic. Each point counts once, which leaves {df} "
    "residual df.",
)
states(surface_notes.NothingRepeated, "Lack of fit cannot be tested: no repeated runs differ.")
states(
    surface_notes.NoPointToSpare,
    "Lack of fit cannot be tested: the design has as many distinct points as the surface has terms.",
)
states(
    surface_notes.InfluentialRun,
    "Run {run} ({value:response g}) strongly influences the surface: Cook's distance {cooks_distance:.2f}.",
)
states(
    surface_notes.VerdictOnOneRun,
    "Without run {run} ({value:response g}) lack of fit has p {without:p}, with it p {p:p}: whether the surface "
    "fits rests on one run.",
)
states(EqualRepeats, "Repeated runs agree exactly: the solver is deterministic, and there is no pure error.")
states(
    ScatterOfSeeds,
    "Every run was done anew; runs at the same levels scatter with a standard deviation of {sd:response .3g} "
    "({df} df).",
)
states(
    EqualSeeds,
    "Runs with different seeds agree exactly: the program has no chance in it (leave replicates out), or does not take "
    "{{{{seed}}}}.",
)
states(
    UnequalRepeats,
    "{runs} runs at the same levels gave {low:response g} to {high:response g}. A deterministic solver gives one "
    "response for one set of levels, so these runs differed in something not recorded.",
)
states(
    TableVaries,
    "The table varies {columns:factors}; the screening would have chosen {chosen:factors}.",
)


@sentence.register
def _(note: StrongestAsked, names: Names) -> str:
    said = [names.say("As asked, the surface takes the strongest factors: {chosen:factors}.", chosen=note.chosen)]
    if note.weak:
        said.append(names.say("Not significant among them: {weak:factors}.", weak=note.weak))
    if note.left_out:
        said.append(names.say("Significant, but left out: {left:factors}.", left=note.left_out))
    return " ".join(said)


states(
    FewSignificant,
    "The screening found only {significant:factors} significant; the surface takes the factors of largest "
    "contribution, {chosen:factors}.",
    otherwise="The screening found no factor significant; the surface takes those of largest contribution, "
    "{chosen:factors}.",
    by="significant",
)
states(
    ManySignificant,
    "The screening found {significant:factors} significant; {design} takes the {taken} strongest of them.",
)
