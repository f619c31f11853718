"""What is said of a paper's printed numbers and of what an audit finds."""

from __future__ import annotations

import pytest

from stemcal.stages.audit.consistency import SolverMissesTarget, StarsDiffer, SurfaceContradictsScreening
from stemcal.stages.audit.paper import LevelDiffers
from stemcal.stages.audit.suspicions import BladeStopsShort, OneOfMany, SignDefiesLaw
from stemcal.stages.printed_numbers import Disagreement
from stemcal.stages.printed_tables import Audited, Contradiction, Difference
from stemcal.text.audit import sentence
from stemcal.text.names import Names
from stemcal.text.published import remarks


def kinds(base: type) -> list[type]:
    return [kind for found in base.__subclasses__() for kind in (found, *kinds(found))]


@pytest.mark.parametrize("kind", kinds(Contradiction))
def test_every_kind_has_a_sentence(kind: type[Contradiction]) -> None:
    assert sentence.dispatch(kind) is not sentence.dispatch(object)


@pytest.mark.parametrize(
    ("printed", "value", "nature", "said"),
    [
        ("1.50", 1.55, "value", "a: the paper prints 1.50, its data give 1.550."),
        ("0.05", 0.00001, "value", "a: the paper prints 0.05, its data give 1e−05."),
        ("-2.88", 2.88307, "sign", "a: the paper prints −2.88, its data give +2.883: the sign differs."),
        ("16,225.35", 16225.4, "value", "a: the paper prints 16,225.35, its data give 16225.400."),
        ("n/a", 3.0, "unreadable", "a: the paper prints 'n/a', which is not a number."),
        ("3.0", None, "value", "a: the paper prints 3.0, its data give no such number."),
    ],
)
def test_a_cell(printed: str, value: float | None, nature: str, said: str) -> None:
    assert sentence(Difference("anova", Disagreement("a", "", printed, value, nature)), Names()) == said


def test_where_a_cell_stands() -> None:
    def said(table: str, term: str, column: str) -> str:
        return sentence(Difference(table, Disagreement(term, column, "1", 2.0, "value")), Names()).split(":")[0]

    assert said("validation", "11", "error_percent") == "error at 11 mm"
    assert said("claims", "max_abs_error_percent", "") == "max abs error percent"
    assert said("anova", "a^2", "F") == "a^2 F"


def test_five_cells_are_told_in_full() -> None:
    differences = tuple(Difference("anova", Disagreement(f"x{n}", "F", "1", 2.0, "value")) for n in range(7))
    said = [one.sentence for one in remarks(Audited(0, 7, {}, differences), Names())]
    assert len(said) == 6 and said[-1] == "2 more printed numbers differ."
    assert not list(remarks(None, Names()))


@pytest.mark.parametrize(
    ("fact", "said"),
    [
        (
            LevelDiffers("failure_strain", 1.682, "0.05", 0.0468179, 2.0, True, True),
            "Levels: failure_strain at coded 1.682 is printed 0.05, the runs have 0.0468179; as printed it would be "
            "coded 2.000. This rounding moves the level far from where the design has it.",
        ),
        (
            SurfaceContradictsScreening({"a": 20.0, "b": 0.01}, 172.2, 101.4, 105.8),
            "Surface against screening: at a 20, b 0.01 the surface gives 172 N, the screening runs 101.4 to 105.8 N.",
        ),
        (
            SolverMissesTarget(169.0, 159.2, 6.156, (147.10, 171.30), False),
            "Validation: where 159.2 N was solved for the solver gives 169 N (+6.2 %): the parameters do not give "
            "the target. That is inside the surface's 95 % prediction interval, 147.1 to 171.3 N.",
        ),
        (
            SignDefiesLaw("screen", "strain_rate_c", 16.917, "-"),
            "Screening: strain_rate_c acts with +16.92 N, the law asks for the sign −.",
        ),
        (
            StarsDiffer("anova", "a:b", "", "**", 0.0021),
            "anova: a:b is printed with no star, its p of 0.0021 asks for two stars.",
        ),
        (
            BladeStopsShort(100.0 / 60.0, 0.5, 0.8333, 8.0),
            "Loading: 100 mm/min for 0.5 s is 0.83 mm of travel, 10 % of a stem of 8 mm: no cut is completed, and a "
            "maximum that comes later is not seen.",
        ),
    ],
)
def test_findings(fact: Contradiction, said: str) -> None:
    assert sentence(fact, Names()) == said


def test_one_solution_of_many() -> None:
    assert sentence(OneOfMany({"a": 17.96}, {"a": (17.634, 18.956), "b": (0.0197, 0.044)}), Names()) == (
        "The solution a 17.96 is one point of a whole set with the same maximum force; inside the design it reaches "
        "over a 17.63 to 18.96 and b 0.0197 to 0.044."
    )
