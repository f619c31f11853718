"""What a screening says, on the paper's own runs."""

from __future__ import annotations

from typing import Any

import pytest

from stemcal.doe.designs.aliases import FullyAliased
from stemcal.doe.screening.analysis import analyse_screening
from stemcal.doe.screening.notes import NotAfterHolm
from stemcal.files.rows import Rows
from stemcal.notes import Weight
from stemcal.stages.result import DesignRuns, Head
from stemcal.stages.screen import FurtherScreening, ScreenResult
from stemcal.text import screening
from stemcal.text.names import Names
from stemcal.text.notes import sentence
from stemcal.text.results import read_first, remarks_of, said_by_all, warned

NAMES = Names(labels={"yield_stress": "Yield stress"})


def test_the_outcome_names_the_factors_that_move_the_force(results: Any) -> None:
    assert " ".join(screening.outcome(results.screen, NAMES)) == (
        "9 factors were screened in 12 runs. Factors that move the maximum force (share of the sum of squares): "
        "Yield stress (60.2 %), failure_strain (34.0 %) and strain_rate_c (2.7 %)."
    )


@pytest.mark.parametrize(
    ("rows", "response", "why"),
    [
        ([[-1, -1], [1, -1], [-1, 1], [1, 1]], [0.0, 146.0, 0.0, 146.0], "there is no error to test them with."),
        ([[-1, -1], [1, -1], [-1, 1]], [0.0, 146.0, 0.0], "no residual degrees of freedom are left."),
    ],
)
def test_effects_without_an_error_term_are_not_called_insignificant(
    rows: list[list[int]], response: list[float], why: str
) -> None:
    found = analyse_screening(rows, response, ["yield_stress", "density"])
    runs: Any = Rows([None] * len(rows))
    stage = ScreenResult(
        head=Head(2, "screen", "known"), design=DesignRuns("full", runs), **FurtherScreening.of(found).as_record()
    )
    assert screening.outcome(stage, NAMES) == [
        f"2 factors were screened in {len(rows)} runs.",
        f"Their effects on the maximum force cannot be tested: {why} The largest is that of Yield stress (+146 N, "
        f"{stage.effects[0].contribution_percent:.1f} % of the sum of squares).",
    ]
    assert screening.standing(stage.effects[0]) == "not tested"
    assert screening.judgement(stage.effects[0], stage, NAMES)[0] == "Whether Yield stress matters cannot be tested."


def test_certainty_is_lenths_and_holms(results: Any) -> None:
    assert screening.certainty(results.screen, NAMES) == [
        "Lenth's method, which needs no residual, confirms Yield stress, strain_rate_c and failure_strain.",
        "Tested among all 9 factors at once (Holm, Lenth), strain_rate_c may be chance.",
    ]


def test_a_judgement_per_factor(results: Any) -> None:
    found = {e.factor: " ".join(screening.judgement(e, results.screen, NAMES)) for e in results.screen.effects}
    assert found["yield_stress"] == (
        "Yield stress matters. From low to high it raises the response by 79.42 N (60.2 % of the variation). "
        "By itself it has p = 0.0022. It is beyond Lenth's margin of error. Its sign is as expected."
    )
    assert "Among all factors at once it does not stand out (Holm p = 0.3233)." in found["strain_rate_c"]
    assert found["tangent_modulus"].startswith(
        "tangent_modulus shows no effect beyond what aliased interactions can imitate."
    )


def test_standings_are_short(results: Any) -> None:
    short = {effect.factor: screening.standing(effect) for effect in results.screen.effects}
    assert short["yield_stress"] == "matters" and short["density"] == "no effect seen"


def test_one_factor_and_many_have_their_own_templates() -> None:
    one, many = (NotAfterHolm(names, 0.05, 9, 36.98) for names in (("a",), ("a", "b")))
    assert sentence(one, NAMES).startswith("a has p below 0.05 alone") and "up to 37 %" in sentence(one, NAMES)
    assert sentence(many, NAMES).startswith("a and b have p below 0.05 alone")


def test_long_lists_of_aliases_are_cut() -> None:
    hidden = {f"f{i}": ("a:b", "a:c", "a:d", "b:c") for i in range(8)}
    said = sentence(FullyAliased(8, hidden), NAMES)
    assert said.startswith(
        "In these 8 runs main effects cannot be told apart from two-factor interactions: f0 with a:b, a:c"
    )
    assert "a:d and 1 more" in said and said.endswith("; 2 more likewise.")


def test_remarks_are_read_by_weight_each_kind_once(results: Any) -> None:
    said = read_first([*said_by_all(results, True), *warned(["the energy balance drifts by 3.0 %"])])
    weights = [remark.weight for _, remark in said]
    assert weights == sorted(weights) and said[0][0] == "runs"
    kinds = [remark.kind for _, remark in said]
    assert len(kinds) == len(set(kinds))
    assert {remark.kind: remark.weight for remark in remarks_of(results.screen)} == {
        "unexpected_sign": Weight.USE,
        "weak_error": Weight.TRUST,
        "not_after_holm": Weight.USE,
        "uniformly_aliased": Weight.TRUST,
        "interaction_of_strongest": Weight.TRUST,
        "unused_contrasts": Weight.TRUST,
        "fold_over_pays": Weight.TRUST,
    }
