"""`stemcal explain`: the terms of tables, report and spec with their sources; the schema of a spec."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Annotated

import typer

from stemcal.cli.console import envelope, say, say_json
from stemcal.cli.options import AsJson
from stemcal.errors import UsageError
from stemcal.words import near, series


@dataclass(frozen=True)
class Entry:
    """A term, other names of it, its meaning in a sentence or two, and its source."""

    term: str
    meaning: str
    source: str
    aliases: tuple[str, ...] = ()


_BOX = "G. E. P. Box, J. S. Hunter, W. G. Hunter, Statistics for Experimenters, Wiley"
_MM = "R. H. Myers, D. C. Montgomery, C. M. Anderson-Cook, Response Surface Methodology, Wiley"
_MONT = "D. C. Montgomery, Design and Analysis of Experiments, Wiley"
_BELY = "T. Belytschko, W. K. Liu, B. Moran, Nonlinear Finite Elements for Continua and Structures, Wiley"
_FB = "D. P. Flanagan, T. Belytschko, Int. J. Num. Meth. Eng. 17 (1981) 679"
_KRIEG = "R. D. Krieg, S. W. Key, in Constitutive Equations in Viscoplasticity, ASME AMD 20 (1976) 125"

GLOSSARY: tuple[Entry, ...] = (
    # ---- what studies can hold
    Entry("growth", "How a material parameter follows the stem's diameter: value·(d/at)^exponent, or a table by grade "
          "(`material: {yield_stress: {at: 8 mm, exponent: growth}}`). The exponent may be a factor.",
          "docs/howto/own-stem.md"),
    # ---- designs and screening
    Entry("factor", "A parameter that is varied between a low and a high level.", _MONT),
    Entry("response", "What a run gives and the laboratory measures: the maximum force on the blade in N, unless a "
          "study declares its own (`responses`).", _MONT),
    Entry("coded value", "A factor's level on a scale on which the centre is 0 and one half-step is 1: "
          "(level − centre)/half-step.", _MM, ("coded", "coding")),
    Entry("coded radius", "Distance of a point from the centre of the design in coded units; beyond the axial points "
          "the surface extrapolates.", _MM),
    Entry("Plackett–Burman design", "A two-level design of N runs (N a multiple of 4) for up to N − 1 factors; in 12 "
          "runs every main effect is partly mixed with all two-factor interactions of other factors.",
          "R. L. Plackett, J. P. Burman, Biometrika 33 (1946) 305", ("pb", "plackett-burman", "screening design")),
    Entry("effect", "Mean response at a factor's high level minus that at its low level, in the response's unit.",
          _BOX),
    Entry("contribution", "A term's sum of squares in percent of the total, residual included.", _MONT,
          ("share", "contribution percent")),
    Entry("aliasing", "Two effects that a design cannot tell apart: what looks like one may be the other.", _BOX,
          ("alias", "confounding")),
    Entry("Lenth's method", "Judges effects without a residual: the pseudo standard error PSE = 1.5·median of the "
          "effects below 2.5·s0, s0 = 1.5·median of all. Its margins ME (one effect) and SME (as one of m effects) are "
          "PSE times quantiles of t with m/3 degrees of freedom.",
          "R. V. Lenth, Technometrics 31 (1989) 469",
          ("lenth", "pse", "me", "sme", "margin of error")),
    Entry("half-normal plot", "Sizes of effects over the quantiles a normal sample would have; chance lies on a line "
          "through the origin, real effects above it.", "C. Daniel, Technometrics 1 (1959) 311"),
    Entry("curvature", "By how much the middle of the ranges differs from the mean of the corners: a plane has none.",
          _MONT, ("centre points",)),
    Entry("replicate", "One of several simulations of the same levels by a program with chance in it, with a seed of "
          "its own.", _MONT, ("replicates", "seed")),
    Entry("Pareto chart", "Effects as bars, the largest first.", _MONT),
    # ---- response surface
    Entry("response surface", "A polynomial of second order in the coded factors, fitted to the runs of a design.", _MM,
          ("surface", "rsm", "regression")),
    Entry("central composite design", "A two-level factorial with axial points at ±alpha and repeated centre points; "
          "estimates a full second-order surface.", "G. E. P. Box, K. B. Wilson, J. R. Statist. Soc. B 13 (1951) 1",
          ("ccd",)),
    Entry("alpha", "In a central composite design the distance of the axial points from the centre in half-steps; "
          "rotatable: fourth root of the number of corners. In a test: the level below which p is called significant.",
          _MM, ("axial distance", "rotatable")),
    Entry("ANOVA", "Splits the total sum of squares into what each term explains and the residual.", _MONT,
          ("analysis of variance",)),
    Entry("sum of squares", "Partial (type III): what leaving out this term alone would add to the residual.", _MONT),
    Entry("F-value", "A term's mean square over the residual's.", _MONT, ("f",)),
    Entry("p-value", "Chance of an F as large or larger if the term had no effect.", _MONT, ("p", "stars")),
    Entry("lack of fit", "Residual beyond the scatter of repeated runs. Where repeats agree to the last digit, as a "
          "deterministic solver's do, it cannot be tested.", _MM),
    Entry("pure error", "Scatter of runs repeated at the same point.", _MM),
    Entry("R²", "Share of the variation that the surface explains.", _MM, ("r2", "r squared")),
    Entry("adjusted R²", "R² with a penalty for each term.", _MM, ("adjusted_r2",)),
    Entry("predicted R²", "1 − PRESS/total: R² for runs that the fit has not seen.", _MM, ("predicted_r2",)),
    Entry("PRESS", "Sum of squares of what each run misses the surface fitted without it by.",
          "D. M. Allen, Technometrics 16 (1974) 125"),
    Entry("adequate precision", "Range of the predictions over their mean standard error; above 4 is wanted.", _MM),
    Entry("coefficient of variation", "Standard deviation in percent of the mean.", _MONT, ("cv", "cv_percent")),
    Entry("Cook's distance", "How far all predictions move if one run is left out; above 1 that run strongly "
          "influences the surface.", "R. D. Cook, Technometrics 19 (1977) 15", ("cook",)),
    Entry("leverage", "Share of a run in its own prediction; at 1 the surface goes through it whatever it says.", _MM),
    Entry("VIF", "Variance inflation factor: by how much correlation with other terms widens a coefficient's variance.",
          _MONT, ("variance inflation factor",)),
    Entry("stationary point", "Where the surface is level: a maximum, a minimum or a saddle.", _MM,
          ("canonical", "saddle")),
    Entry("fold-over", "The same design with all signs turned, added to it: it frees main effects of two-factor "
          "interactions.", _BOX, ("fold_over",)),
    Entry("climb", "Steps from the centre along the screening's slope until the response has passed the target; the "
          "next design is centred on the best.", "G. E. P. Box, K. B. Wilson, J. R. Statist. Soc. B 13 (1951) 1",
          ("steepest ascent",)),
    # ---- inversion, validation
    Entry("calibration", "The parameter set at which the surface meets the measured response.", _MM, ("inversion",)),
    Entry("solution set", "All points of the design region at which the surface takes the target: with several "
          "factors a curve or a surface, not one point.", _MM, ("ranges", "range")),
    Entry("least_coded_distance", "Rule: of all solutions take the one nearest to the centre in coded units.", _MM),
    Entry("mean interval", "95 % confidence interval of the expected response at a point.", _MM,
          ("confidence interval",)),
    Entry("prediction interval", "Where one further run at a point falls with 95 % probability.", _MM),
    Entry("error", "100·(measured − simulated)/measured: positive where the simulation gives too little.",
          "the wild chrysanthemum study, Table 13"),
    Entry("profile likelihood", "The misfit with one factor held and all others free: where it stays low are the "
          "values that the measurements allow.", "D. J. Venzon, S. H. Moolgavkar, Applied Statistics 37 (1988) 87",
          ("profile", "profiles")),
    Entry("free", "Of a factor: its interval fills half of its range or more, so the measurements do not fix "
          "it.",
          "A. Raue et al., Bioinformatics 25 (2009) 1923", ("identifiability", "of range", "identifiable")),
    Entry("joint fit", "One set of parameters for several diameters, or several responses, at once, weighted by how "
          "well each is known.",
          _MM, ("joint",)),
    Entry("refinement", "Simulate at the solution, correct the surface by what it was off there, solve again, until "
          "the simulated response meets the target.", "C. G. Broyden, Math. Comp. 19 (1965) 577", ("refine",)),
    Entry("verdict", "The outcome of a study by stated rules: calibrated, with reservations or not calibrated, with "
          "the reasons and the step that mends each. Where it is not calibrated no interval is shown.", _MM,
          ("calibrated", "with_reservations", "not_calibrated")),
    # ---- laboratory
    Entry("grade", "A class of stems by diameter: from half a step below to half a step above.",
          "the wild chrysanthemum study, section 2.3"),
    Entry("Shapiro–Wilk test", "Compares ordered values with those a normal sample would have; a small p "
          "speaks against a normal distribution.", "S. S. Shapiro, M. B. Wilk, Biometrika 52 (1965) 591", ("shapiro",)),
    Entry("Anderson–Darling test", "Distance of the sample's distribution from the fitted normal one, the tails "
          "weighing most.", "M. A. Stephens in D'Agostino, Stephens, Goodness-of-Fit Techniques, Dekker 1986",
          ("anderson",)),
    Entry("Grubbs' test", "Is the value farthest from the mean farther than chance allows? It names one suspect; "
          "nothing is dropped by itself.", "F. E. Grubbs, Technometrics 11 (1969) 1", ("grubbs", "outlier")),
    Entry("power law", "F = a·d^b, a straight line of the logarithms; shearing a full section gives b = 2.",
          "S. Persson, Mechanics of Cutting Plant Material, ASAE 1987", ("exponent",)),
    Entry("preload", "Small force that the machine reads before the blade cuts; the curve begins where it is passed.",
          "the wild chrysanthemum study, section 2.3"),
    Entry("travel", "Way of the blade from first touch; of a measured curve, from where the preload was passed.",
          "the wild chrysanthemum study, section 2.3"),
    Entry("work", "Area under force over travel up to the maximum, mJ.",
          "S. Persson, Mechanics of Cutting Plant Material, ASAE 1987"),
    # ---- material
    Entry("density", "Mass over volume; matters only through inertia.", _BELY),
    Entry("elastic_modulus", "Stress over strain before yield, MPa.", _BELY, ("elastic modulus", "young's modulus")),
    Entry("poisson_ratio", "Contraction across over stretch along.", _BELY, ("poisson's ratio",)),
    Entry("yield_stress", "Stress at which flow begins at rest, MPa.", _KRIEG, ("yield stress",)),
    Entry("tangent_modulus", "Slope of the stress–strain curve beyond yield, MPa.", _KRIEG, ("tangent modulus",)),
    Entry("hardening_parameter", "0: the yield surface moves (kinematic), 1: it grows (isotropic hardening).", _KRIEG,
          ("beta", "hardening parameter")),
    Entry("strain_rate_c", "Strain rate at which the rate law doubles the yield stress, 1/s.",
          "G. R. Cowper, P. S. Symonds, Brown University TR 28 (1957)", ("c", "strain rate parameter c")),
    Entry("strain_rate_p", "Exponent of the rate law: 1 + (rate/C)^(1/P) in the usual law, 1 + (rate/C)^P as "
          "printed in the wild chrysanthemum study.", "G. R. Cowper, P. S. Symonds, Brown University TR 28 (1957)",
          ("p of rate", "rate law", "rate_law", "cowper-symonds", "strain rate parameter p")),
    Entry("stem_friction", "Coefficient of friction between stem, blade and supports as a factor, the same at any "
          "speed.", _BELY, ("friction",)),
    Entry("wall_thickness", "Thickness of the stem's wall at the calibration diameter as a factor; stems of other "
          "diameters have the same ratio of bore to outer diameter.", "the wild chrysanthemum study, section 2.4",
          ("wall thickness", "diameter_ratio")),
    Entry("failure_strain", "Effective plastic strain at which an element is taken out.", _BELY,
          ("failure strain", "erosion")),
    Entry("plastic strain", "Effective plastic strain: √(2/3) times the length of the path of plastic straining.",
          _BELY),
    # ---- solver
    Entry("hourglass energy", "Energy in deformations that an element with one integration point cannot see; above a "
          "tenth of the internal energy results are doubtful.", _FB, ("hourglass", "hourglass_ratio_percent")),
    Entry("mass scaling", "Raises the density so that time steps grow; harmless while kinetic energy stays small.",
          _BELY, ("mass_scaling",)),
    Entry("kinetic ratio", "Kinetic in percent of internal energy; small means that inertia does not matter.", _BELY,
          ("kinetic_ratio_percent",)),
    Entry("energy drift", "Largest error of the energy balance in percent of the work done.", _BELY,
          ("energy_drift_percent", "energy balance")),
    Entry("contact energy", "What friction and damping take of the blade's work, in percent; less than none is energy "
          "that the numbers have created, and the run fails.", _BELY, ("contact_energy_percent",)),
    Entry("time step", "Smallest element over the speed of sound, times a safety factor.",
          "R. Courant, K. Friedrichs, H. Lewy, Math. Ann. 100 (1928) 32", ("time_step_safety",)),
    Entry("censored", "A force not clearly past its maximum when the stroke ended: the true one is at least that.",
          "W. Nelson, Applied Life Data Analysis, Wiley 1982", ("stroke",)),
    Entry("penalty contact", "Pushes a node back in proportion to how deep it lies in a tool.", _BELY,
          ("penalty", "contact")),
    Entry("symmetry", "A quarter of the stem is computed, half where the blade has one bevel; forces are those of the "
          "whole stem.", _BELY),
)  # fmt: skip


def look_up(term: str) -> list[Entry]:
    """Return the entries of a term or of a key of a spec, by name or other name; else those whose name holds it.

    >>> [entry.term for entry in look_up("rate_law")]
    ['solver.rate_law, kind: embedded', 'solver.rate_law, kind: deck']

    Raises
    ------
    UsageError
        With the nearest terms, if there is none.
    """
    wanted = _plain(term)
    keys = tuple(_keys_of_a_spec())
    exact = [entry for entry in (*GLOSSARY, *keys) if wanted in map(_plain, (entry.term, *entry.aliases))]
    found = exact or [entry for entry in GLOSSARY if wanted and wanted in _plain(entry.term)]
    if found:
        return found
    meant = _nearest_terms(wanted, GLOSSARY) or _nearest_terms(wanted, keys)
    if meant:
        raise UsageError(f"{term!r} is not in the glossary; did you mean {', '.join(dict.fromkeys(meant))}?")
    raise UsageError(f"{term!r} is not in the glossary; `stemcal explain` lists the terms")


def _nearest_terms(wanted: str, entries: Sequence[Entry]) -> list[str]:
    names = {_plain(name): entry.term for entry in entries for name in (entry.term, *entry.aliases)}
    return [names[name] for name in near(wanted, names, most=3)]


def _keys_of_a_spec() -> Iterator[Entry]:
    """Yield an entry for each key of a spec, with the keys below it: known by its place, and by its name alone."""
    from stemcal.study.reading.json_schema import meanings

    paths = [place.partition(",")[0].replace("[]", "").rpartition(".") for place in meanings()]
    for (place, meaning), (above, _, name) in zip(meanings().items(), paths, strict=True):
        path = f"{above}.{name}".removeprefix(".")
        keys = dict.fromkeys(key for section, _, key in paths if section == path)
        listed = f"{meaning} Keys: {series(keys)}." if keys else meaning
        yield Entry(place, listed, "a key of the spec", (path, name))


def _plain(text: str) -> str:
    """Return a term without what people type differently: case, dashes, underscores, superscripts, possessives."""
    table = str.maketrans({"–": "-", "_": " ", "²": "2", "’": "'"})
    return text.strip().lower().translate(table).replace("'s", "").replace("'", "").replace("-", " ")


# ---- the command


def _beginning(typed: str) -> list[str]:
    """Return the terms that begin as what was typed, for the shell to complete."""
    names = {name for entry in GLOSSARY for name in (entry.term, *entry.aliases)}
    return sorted(name for name in names if name.lower().startswith(typed.lower()))


Term = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="TERM", help="A word of the tables or the report, or a key of a spec.", autocompletion=_beginning
    ),
]
Schema = Annotated[bool, typer.Option("--schema", help="Print the JSON schema of a spec, for editors.")]


def explain(term: Term = None, schema: Schema = False, as_json: AsJson = False) -> None:
    """Explain a term and name its source; without a term list all terms.

    With the schema in a file, [bold]# yaml-language-server: $schema=stemcal.schema.json[/bold] at the top of a spec
    lets an editor complete and check it.

    Example: [bold]stemcal explain lack of fit[/bold]

    Example: [bold]stemcal explain --schema > stemcal.schema.json[/bold]
    """
    if schema:
        _say_schema()
        return
    entries = look_up(" ".join(term)) if term else list(GLOSSARY)
    if as_json:
        say_json({"terms": [asdict(entry) for entry in entries]})
    elif not term:
        say(", ".join(entry.term for entry in entries))
    else:
        from rich.padding import Padding

        for entry in entries:
            say(entry.term, Padding(f"{entry.meaning}\nSource: {entry.source}", (0, 0, 0, 2), expand=False))


def _say_schema() -> None:
    """Print the schema as it goes into a file; with --json it is the result of the envelope."""
    import json
    import sys

    from stemcal.study.reading.json_schema import json_schema

    if envelope.command:
        say_json(json_schema())
    else:
        sys.stdout.write(json.dumps(json_schema(), indent=2, ensure_ascii=True) + "\n")
