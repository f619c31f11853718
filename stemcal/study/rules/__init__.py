"""What must hold between the values of a spec, one rule per function; each yields what it finds wrong.

What is possible but looks like a slip is in `plausible`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from stemcal.study.rules import climbing, factors, geometry, outside, surface, targets
from stemcal.study.spec.draft import Draft, Finding

__all__ = ["broken_rules"]

RULES: tuple[Callable[[Draft], Iterator[Finding]], ...] = (
    factors.names_differ,
    targets.names_are_free,
    factors.ranges_rise,
    factors.factors_are_known,
    factors.factors_are_physical,
    factors.material_is_physical,
    factors.material_is_given_once,
    factors.sections_are_given_once,
    factors.wall_fits_stem,
    factors.rate_parameters_are_used,
    factors.material_is_complete,
    factors.tangent_stays_below_elastic,
    factors.failure_is_complete,
    factors.design_takes_factors,
    targets.diameters_differ,
    targets.calibration_has_target,
    geometry.stem_reaches_over_supports,
    geometry.blade_spans_stem,
    geometry.edge_fits_blade,
    geometry.elements_fit_stem,
    geometry.friction_falls,
    geometry.symmetry_holds,
    geometry.plane_of_the_cut_is_a_mirror,
    geometry.one_mesh_scatter,
    geometry.other_meshes_are_possible,
    surface.surface_factors_exist,
    surface.strongest_are_enough,
    surface.surface_design_takes_factors,
    climbing.steps_stay_inside,
    surface.runs_are_used,
    surface.constraints_fit,
    surface.coarse_runs_are_possible,
    surface.surface_weights_known,
    surface.coding_fits,
    targets.published_factors_exist,
    targets.claims_known,
    targets.joint_diameters_measured,
    targets.responses_measured,
    targets.process_fits_one_force,
    outside.table_answers_something,
    outside.placeholders_are_known,
    outside.placeholders_are_used,
    outside.chance_is_said,
    outside.mirrored_runs_stand_once,
    outside.run_files_differ,
    outside.every_response_is_read,
    outside.own_names_belong_to_programs,
    outside.reduction_has_what_it_needs,
    outside.command_names_deck,
    outside.openradioss_hardens_isotropically,
)


def broken_rules(draft: Draft) -> list[Finding]:
    """Return everything the rules find wrong with `draft`."""
    return [finding for rule in RULES for finding in _as_far_as_read(rule(draft))]


def _as_far_as_read(findings: Iterator[Finding]) -> Iterator[Finding]:
    """Yield findings until a rule asks for what could not be read (see `spec.partly`)."""
    try:
        yield from findings
    except AttributeError as error:
        if error.name not in getattr(type(error.obj), "model_fields", ()):
            raise
