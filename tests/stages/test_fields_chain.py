"""What the field's chain asks of designs: the strongest factors, short names, own steps, twelve runs."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from stemcal.doe.designs import plackett_burman
from stemcal.doe.effects import alias_matrix, aliases_note
from stemcal.errors import SpecError
from stemcal.notes import Note
from stemcal.overview.foresight import beforehand
from stemcal.solvers import make_solver
from stemcal.solvers.embedded import shear_test
from stemcal.stages.rsm.options import RsmOptions, surface_factors
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

SPEC = """\
name: chain
factors: [%s]
solver:
  kind: command
  command: [python, p.py, %s]
  result: {file: out.json, path: y}
targets: [{diameter: 8 mm, force: 32 N}]
%s
"""


def study_of(folder: Path, more: str, names: str = "abcde", says: str = "replicates: 1") -> Study:
    factors = ", ".join(f"{{name: {name}, low: 0, high: 1}}" for name in names)
    spec = folder / "chain.yaml"
    text = SPEC % (factors, ", ".join(f'"{{{{{name}}}}}"' for name in names), more)
    spec.write_text(text.replace("kind: command\n", f"kind: command\n  {says}\n"), encoding="utf-8")
    return load_study(spec)


@dataclass(frozen=True)
class Screened:
    """A screening of the factors a, b, c, d and e, the strongest first."""

    active_factors: tuple[str, ...]

    @property
    def shares(self) -> dict[str, float]:
        """Contributions that fall by the alphabet."""
        return dict(zip("abcde", (40.0, 30.0, 20.0, 7.0, 3.0), strict=True))


def chosen(study: Study, *significant: str) -> tuple[list[str], list[Note]]:
    return surface_factors(study, make_solver(study), Screened(significant))


def test_strongest_three_are_taken_whatever_is_significant(tmp_path):
    study = study_of(tmp_path, "rsm: {design: box-behnken, factors: strongest 3}")
    names, said = chosen(study, "a")
    assert names == ["a", "b", "c"]
    assert [note.kind for note in said] == ["strongest_factors"]
    assert said[0].text.endswith("a, b and c. b and c are not significant.")
    assert chosen(study, "a", "b", "c", "d")[1][0].text.endswith(
        "a, b and c. The response surface omits the significant factor d."
    )


@pytest.mark.parametrize(
    ("design", "significant", "taken"),
    [
        *(("box-behnken", "a", "abc"), ("box-behnken", "abcd", "abcd")),
        *(("central-composite", "a", "ab"), ("central-composite", "", "ab")),
    ],
)
def test_a_design_gets_as_many_factors_as_it_wants(tmp_path, design, significant, taken):
    study = study_of(tmp_path, f"rsm: {{design: {design}}}")
    names, said = chosen(study, *significant)
    assert names == list(taken)
    assert bool(said) == (len(significant) < len(taken))


@pytest.mark.parametrize("asked", ["strongest 2", "strongest 6", "strongest 0", "the strongest", "strongest three"])
def test_a_number_that_the_design_cannot_take_is_refused(tmp_path, asked):
    with pytest.raises(SpecError, match=r"rsm\.factors"):
        study_of(tmp_path, f"rsm: {{design: box-behnken, factors: {asked}}}")


def test_short_names_mean_the_designs(tmp_path):
    study = study_of(tmp_path, "screen: {design: plackett-burman}\nrsm: {design: central-composite}")
    assert (study.screen.design, study.rsm.design) == ("plackett-burman", "central-composite")
    assert study_of(tmp_path, "rsm: {design: box-behnken}").rsm.design == "box-behnken"


@pytest.mark.parametrize(("k", "runs"), [(3, 4), (4, 8), (5, 12), (7, 12), (11, 12), (12, 20)])
def test_five_to_eleven_factors_get_twelve_runs(k, runs):
    assert len(plackett_burman(k)) == runs


def test_what_eight_runs_lose_is_said_before_any():
    """Weight 1 of an interaction in a main effect, against 1/3 in twelve runs."""
    assert np.abs(alias_matrix(plackett_burman(5, runs=8))).max() == pytest.approx(1.0)
    assert np.abs(alias_matrix(plackett_burman(5))).max() == pytest.approx(1 / 3)
    assert aliases_note(plackett_burman(5, runs=8), list("abcde")).kind == "fully_aliased"


def test_a_failure_strain_to_be_found_belongs_to_the_lengths() -> None:
    configs = Path(__file__).resolve().parents[2] / "configs"
    stroke, said = beforehand(load_study(configs / "wild-chrysanthemum-as-published.yaml"))
    assert stroke.kind == "short_stroke"
    assert said.kind == "lengths_belong" and "d/4.5" in said.text and "d/9.5" in said.text


def test_a_stroke_of_less_than_0_35_diameters_is_warned_of_and_the_advice_is_enough() -> None:
    """22 mm at 200 mm/min: 0.35 d are 7.7 mm, which take 2.3103 s with the gap."""
    spec = Path(__file__).resolve().parents[2] / "configs" / "wild-chrysanthemum-as-published.yaml"
    changes = {"targets": [{"diameter": "22 mm", "force": "1500 N"}], "invert": {"diameters": ["22 mm"]}}
    study = load_study(spec, loading={"speed": "200 mm/min"}, **changes)
    stroke = next(note for note in beforehand(study) if note.kind == "short_stroke")
    assert stroke.severity == "warning" and stroke.remedy is not None
    assert stroke.remedy.edit == "loading: {duration: 2.4 s}"
    longer = load_study(spec, loading={"speed": "200 mm/min", "duration": "2.4 s"}, **changes)
    assert "short_stroke" not in {note.kind for note in beforehand(longer)}


@pytest.mark.parametrize(("stroke", "short"), [("14 mm", False), ("13.99 mm", True)])
def test_a_stroke_of_0_35_diameters_is_enough(stroke: str, short: bool) -> None:
    spec = Path(__file__).resolve().parents[2] / "configs" / "wild-chrysanthemum-as-published.yaml"
    changes = {"targets": [{"diameter": "40 mm", "force": "1500 N"}], "invert": {"diameters": ["40 mm"]}}
    study = load_study(spec, loading={"stroke": stroke}, **changes)
    assert ("short_stroke" in {note.kind for note in beforehand(study)}) == short


def test_a_stroke_that_is_a_share_of_the_diameter() -> None:
    """d/4 at 11 mm: 2.75 mm after the gap at 100 mm/min. It is 0.25 d, and 0.35 d are at least d/2.8."""
    spec = Path(__file__).resolve().parents[2] / "configs" / "wild-chrysanthemum-as-published.yaml"
    short = load_study(spec, loading={"stroke": "d/4"})
    for diameter in (7.0, 11.0):
        moved = shear_test(short, {factor.name: factor.centre for factor in short.factors}, diameter).loading
        assert moved.speed * moved.duration - moved.gap == pytest.approx(diameter / 4.0)
    remedy = next(note.remedy for note in beforehand(short) if note.kind == "short_stroke")
    assert remedy is not None and remedy.edit == "loading: {stroke: d/2.8}"
    assert short.loading.longer(2.0).stroke_at(8.0) == pytest.approx(4.0)


def test_box_behnken_requires_three_factors(tmp_path):
    with pytest.raises(SpecError, match="the `box-behnken` design requires 3 to 7 factors, not 2"):
        study_of(tmp_path, "rsm: {design: box-behnken}", "ab")


def test_a_factor_that_no_run_varies_is_named(tmp_path):
    (said,) = RsmOptions.doubts(study_of(tmp_path, "screen: {design: none}\nrsm: {factors: [a, b]}", "abcd"))
    assert said.path == ("rsm", "factors") and said.message.endswith("not varied in any run: c, d")
    assert list(RsmOptions.doubts(study_of(tmp_path, "rsm: {factors: [a, b]}", "abc"))) == []


GROWING = """\
name: growing
factors:
  - {name: yield_stress, unit: MPa, low: 12, high: 24}
  - {name: growth, low: -0.25, high: 1.25}
material:
  density: 1100 kg/m3
  elastic_modulus: 1000 MPa
  poisson_ratio: 0.3
  yield_stress: {at: 9 mm, exponent: growth}
  tangent_modulus: 0.5 MPa
  hardening_parameter: 0.05
  failure_strain: 0.03
solver: {kind: embedded, rate_law: none}
targets: [{diameter: 7 mm, force: 120 N}, {diameter: 9 mm, force: 213.8 N}]
screen: {design: none}
rsm: {factors: [yield_stress, growth]}
invert: {diameters: all}
"""


def test_an_exponent_is_not_screened_where_its_growth_is_one(tmp_path):
    spec = tmp_path / "growing.yaml"
    spec.write_text(GROWING, encoding="utf-8")
    study, without = load_study(spec), load_study(spec, rsm={"factors": ["yield_stress"]})
    assert list(RsmOptions.doubts(study)) == []
    (unvaried,) = RsmOptions.doubts(without)
    assert unvaried.message.endswith("not varied in any run: growth")
