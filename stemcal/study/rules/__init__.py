"""What must hold between the values of a spec, one rule per function; each yields what it finds wrong.

What is possible but looks like a slip is in `plausible`.
"""

from collections.abc import Callable, Iterator

from stemcal.registry import stages
from stemcal.study.rules import factors, target_rules
from stemcal.study.rules.draft import Draft
from stemcal.study.types.strict_yaml import Finding

RULES: tuple[Callable[[Draft], Iterator[Finding]], ...] = (
    factors.names_differ,
    target_rules.names_are_free,
    target_rules.forces_are_newtons,
    factors.ranges_rise,
    factors.priors_fit,
    factors.factors_are_known,
    factors.factors_are_physical,
    factors.material_is_physical,
    factors.material_is_given_once,
    factors.sections_are_given_once,
    factors.wall_fits_stem,
    factors.rate_parameters_are_used,
    factors.material_is_complete,
    factors.growth_has_one_value,
    factors.exponents_are_factors,
    factors.grades_reach,
    factors.growth_is_physical,
    factors.tangent_stays_below_elastic,
    target_rules.conditions_differ,
    target_rules.stem_reaches_over_supports,
    target_rules.edge_fits_blade,
    target_rules.friction_falls,
    target_rules.tests_are_simulated,
    target_rules.curves_are_simulated,
    target_rules.tests_differ,
    target_rules.tests_have_what_they_need,
    target_rules.further_cuts_are_possible,
    target_rules.tests_fit_the_stem,
    target_rules.test_targets_stand_beside_forces,
    target_rules.own_names_belong_to_programs,
)


def broken_rules(draft: Draft) -> list[Finding]:
    """Return everything the rules find wrong with `draft`: those above, of its solver and of the stages."""
    solver = getattr(draft.study, "solver", None)
    own = () if solver is None else draft.kind.rules
    found = [*(rule(draft) for rule in RULES), *(rule(draft, solver) for rule in own)]
    found += [rule(draft) for stage in stages().with_(draft.study.further) for rule in stage.rules()]
    return [finding for findings in found for finding in _as_far_as_read(findings)]


def _as_far_as_read(findings: Iterator[Finding]) -> Iterator[Finding]:
    """Yield findings until a rule asks for what could not be read (see `reading.sections.partly`)."""
    try:
        yield from findings
    except AttributeError as error:
        if error.name not in getattr(type(error.obj), "model_fields", ()):
            raise
