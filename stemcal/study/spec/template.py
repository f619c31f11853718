"""The commented spec that `stemcal init` writes: a whole study to start from."""

from __future__ import annotations

import json
import textwrap

from pydantic import TypeAdapter, ValidationError

from stemcal.errors import UsageError
from stemcal.study.spec.crops import CROPS, Crop, Range
from stemcal.study.spec.fields import StudyName
from stemcal.words import did_you_mean

__all__ = ["study_name", "template"]


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
    }
    text = _TEXT
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


_TEXT = """\
# stemcal study: one file says everything. `stemcal check` tells what is wrong with it, line by line,
# `stemcal plan` what would be computed, `stemcal run` does it all.
#
# Quantities are written with their unit: 8 mm, 100 mm/min, 0.5 s, 37.5 deg, 159.2 N.
# Pure numbers (ratios, friction, counts) have none.
#
# @OF@

schema_version: 1
name: @NAME@  # also the name of the folder of results
title: Cutting force of a plant stem

# What is calibrated. Each factor is searched from low to high, both in `unit` (without one: a pure number).
# Symbols X1, X2, ... are given in the order of the list. `expected_sign` is what mechanics says about the
# effect on the cutting force; the report marks an effect of the other sign.
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
  - name: tangent_modulus          # the slope of the stress-strain curve beyond yield
    label: Tangent modulus
    unit: MPa
    low: 0.4
    high: 0.6
    expected_sign: "+"
  - name: hardening_parameter      # 0 = kinematic, 1 = isotropic hardening
    label: Hardening parameter
    low: 0
    high: 0.1
  - name: strain_rate_c            # a larger C means less strengthening by speed
    label: Strain rate parameter C
    unit: 1/s
    low: 80
    high: 100
    expected_sign: "-"
  - name: strain_rate_p
    label: Strain rate parameter P
    low: 4
    high: 12
  - name: failure_strain           # plastic strain at which an element is removed
    label: Failure strain
    low: 0.01
    high: 0.05
    expected_sign: "+"
# Two more can be factors of the embedded solver; each then takes the place of fixed values below.
#  - {name: stem_friction, low: 0.1, high: 0.4}               # in place of the friction under contact
#  - {name: wall_thickness, unit: mm, low: 1.5, high: 3}      # at calibrate_at, in place of diameter_ratio

# The piece of stem: a hollow cylinder. diameter_ratio = inner / outer diameter.
specimen:
  outer_diameter: 8 mm
  diameter_ratio: 0.41
  length: 50 mm

# The rigid blade. edge_angle lies between the two edge faces.
# bevel: both | one (ground on one side only). edge_spread: how far from its profile the blade bears on
# the surface beside the edge, a part of the diameter (d/9.5) or a length (1 mm). It belongs to the calibrated
# failure strain.
blade:
  length: 90 mm
  width: 28 mm
  thickness: 2.3 mm
  edge_angle: 37.5 deg
  bevel: both
  edge_radius: 0.1 mm
  edge_spread: d/9.5

# Parameters that are not to be calibrated leave `factors` and get a fixed value here:
# internal_length is the length over which the strain that decides failure is averaged. It, edge_spread and
# element_size belong to the calibrated failure strain; elements should be at most 0.6 times as long as either.
material:
  # density: 1100 kg/m3
  # poisson_ratio: 0.3
  internal_length: d/4.5

# Two rigid supports; clearance is the gap between them, with the blade in its middle.
supports:
  clearance: 20 mm
  fillet_radius: 1 mm

# The blade moves at constant speed for `duration`; it begins `gap` above the stem.
loading:
  speed: 100 mm/min
  duration: 0.5 s
  gap: 0.001 mm

# Friction and the penalty that keeps blade and stem apart.
# friction = dynamic + (static - dynamic) * exp(-decay * sliding speed)
contact:
  static_friction: 0.15
  dynamic_friction: 0.10
  decay: 0 s/mm
  penalty: 0.25
  damping: 0.5

# What answers "these levels, which force?". rate_law: how speed raises the yield stress,
#   paper           1 + (rate / C)^P        as in the wild chrysanthemum study
#   cowper_symonds  1 + (rate / C)^(1/P)    the usual law
#   none            not at all: strain_rate_c and strain_rate_p then leave the factors
# symmetry: none | half | quarter (the model's mirror planes; quarter needs bevel: both).
# mass_scaling allows larger time steps; `stemcal simulate` shows whether kinetic energy stays small.
# Further: elements_through_wall: n (else as many as make them no longer than element_size), element: one_point | full
# (the slow reference), phases: n (mean over n places of the mesh), perturb: seed (a random place), threads: n (for one
# large model), stop_after_peak: false (compute the whole stroke, also after the stem has broken), precision: mixed |
# double (mixed: strains and stresses of the elements in single precision, half the time).
solver:
  kind: embedded
  rate_law: paper
  symmetry: quarter
  element_size: d/16               # of the stem's diameter d, or a length such as 0.5 mm
  edge_over: nodes                 # the edge comes down on a row of nodes | over the middle of a row of elements
  coarsening: 6                    # length of the elements at the ends of the stem over those under the edge
  coarsening_around: 2             # width of the elements at the bottom of the section over those under the edge
  hourglass:
    form: stiffness                # stiffness | viscous
    coefficient: 0.01               # as LS-DYNA's QH
  mass_scaling: 1e4
  time_step: 40 us                 # elements too small for it are given mass; leave it out to have none given
  time_step_safety: 0.9
  outputs: 500                     # points of the force history
  filter_window: 10 ms             # low-pass filter of the force; 0 s = none
  break_drop: 0.5                  # broken, and the maximum passed, once the force has dropped by this share of it

# Measured maximum shear forces with n specimens each. Parameters are fitted at calibrate_at,
# the other diameters check them. sd (standard deviation) may be given beside n, and so may what else was measured:
# travel: 1.2 mm, travel_sd (of the blade, from first touch to the maximum), work: 90 mJ, work_sd (done by then).
targets:
  calibrate_at: 8 mm
  forces:
    - {diameter: 7 mm, force: 120 N, n: 6}
    - {diameter: 8 mm, force: 159.2 N, n: 6}
    - {diameter: 9 mm, force: 213.8 N, n: 6}
    - {diameter: 10 mm, force: 300 N, n: 6}
    - {diameter: 11 mm, force: 378.2 N, n: 6}

# Stage 1, which factors matter? design: plackett-burman | plackett-burman-pydoe | fractional-factorial |
# full-factorial | definitive-screening. runs: another size than the usual one, such as 20; of a definitive screening
# more runs give columns without a factor, which its error is taken from.
# centre_points: runs in the middle of all ranges, which tell whether the force is curved there.
# fold_over: true repeats every run with all signs turned, which frees main effects of interactions.
# error: what effects are tested against: residual (columns without a factor) | pooled | replicates | lenth.
# alpha: a factor with p below it goes on to stage 2.
screen:
  design: plackett-burman
  # runs: 20
  centre_points: 0
  fold_over: false
  error: residual
  alpha: 0.05

# Stage 2, the response surface over the factors that matter (or strongest 3, or a list of names). design:
# central-composite | box-behnken (3 to 7 factors) | full-factorial (three levels) | latin-hypercube | sobol (with
# runs and seed).
# alpha: how far the axial points lie out: rotatable | face | spherical | orthogonal | practical | a number, in
# half steps. core: full | fractional (fewer corners, from five factors on).
# extra_runs: further runs where they teach most (a list: batch after batch). axial: 1 adds axial points at that
# distance. blocks: orthogonal splits a composite into corners and axial points, each block with a level of its own.
# weights: phases lets runs of small scatter over solver.phases count more. inestimable: drop leaves out terms that
# failed runs have made so, in place of refusing the fit. reduce: none | backward | forward | aicc leaves terms out.
# coding: what coded 0 and +1 mean, in the factor's unit; used for factors that enter, others get theirs
# from low and high.
rsm:
  factors: significant
  design: central-composite
  centre_points: 6
  alpha: rotatable
  core: full
  extra_runs: 0
  reduce: none
  # coding:
  #   yield_stress: {center: 15, half_step: 3}

# Stage 3: many parameter sets give the target force. rule says which of them is called the solution:
# least_coded_distance (nearest to the centre) | least_prediction_variance | others_at_centre
# diameters: all (or a list of them) fits the parameters to several diameters at once; the design of stage 2 is
# then run at each. responses: all (or a list of force, travel, work) fits these together, each with a surface of
# its own, weighted by the measured scatter. posterior: true adds samples of what the measured forces leave possible.
invert:
  rule: least_coded_distance

# Stage 4, the closed loop: simulate at the solution, learn from it, step, until the simulated force is within
# tolerance_percent of the measured one or budget runs are spent. Without this section it is left out.
refine:
  tolerance_percent: 1
  budget: 10

# The solution on other meshes: phases places of the mesh along the stem and elements of other sizes. Their scatter
# then enters every interval, and a budget tells laboratory, surface and mesh. Without this section it is left out.
# mesh:
#   phases: 5
#   sizes: [d/24]

# Between stages 1 and 2 the active factors can be stepped together towards the target first; the design is then
# centred on the best step and reaches over the share `shrink` of each range.
# climb:
#   steps: 5
#   step_sizes: {yield_stress: 2}   # steps of your own, in the unit of the factor
#   shrink: 0.5

# Runs may fail. tries: how often a run is begun if its process dies or the solver breaks off.
# time_limit: how long one may take, counted from its start (without it: as long as it needs).
# quorum: the share of a stage's runs that must succeed. keep_going: false stops at the first failure.
# censored: a force still rising when the stroke ends is only a lower bound: warn | fail.
runs:
  tries: 2
  # time_limit: 2 h
  quorum: 0.5
  keep_going: true
  censored: warn
"""
