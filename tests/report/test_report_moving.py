"""The cut over time: frames as they were, animations that can be read."""

import json
import shutil
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stemcal.cli.export import films, write_film
from stemcal.cutting.end_state import Shape
from stemcal.cutting.parts import Discretisation, ShearTest, Stem
from stemcal.cutting.simulate import shear
from stemcal.errors import UsageError
from stemcal.fem.material import Material
from stemcal.fem.model import Integration
from stemcal.report.fracture import write_animation
from stemcal.report.page.page import page_content, render
from stemcal.report.records import read_records
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.embedded import Embedded
from stemcal.solvers.film import FRAMES, Film, Frame, frames_of
from stemcal.solvers.protocol import Request
from stemcal.stages.results import fresh_results
from stemcal.study.reading import load_study

OUTPUTS = 96


@pytest.fixture(scope="module")
def filmed() -> tuple[Any, Film]:
    """A quick coarse cut, and its film."""
    material = Material(1.1e-9, 1000.0, 0.3, 12.0, 0.5, 0.05, failure_strain=0.02)
    how = Discretisation(element_size=1.5, integration=Integration(mass_scaling=1e6, outputs=OUTPUTS))
    whole = replace(how, stop_after_peak=False)
    film = Film()
    test = ShearTest(material, Stem(8.0, 0.41, 30.0), discretisation=whole)
    return shear(test, inspect=film), film


@pytest.fixture(scope="module")
def frames(filmed: tuple[Any, Film]) -> list[Frame]:
    """The frames as a record gives them back."""
    result, film = filmed
    shape = Shape.unpacked(json.loads(json.dumps(result.shape.packed())))
    return frames_of(shape, json.loads(json.dumps(film.packed(result))))


def test_frames_are_even_in_time_and_end_as_the_test_did(filmed: tuple[Any, Film], frames: list[Frame]) -> None:
    result, _ = filmed
    assert len(frames) == FRAMES + 1  # every fourth of 96 outputs, and the start
    assert [frame.travel for frame in frames] == pytest.approx(result.history.travel[::4], abs=1e-4)
    assert [frame.force for frame in frames] == pytest.approx(result.history.force_filtered[::4], abs=1e-3)
    last = frames[-1].shape
    assert np.array_equal(last.standing, result.shape.standing)
    assert last.tools[0] == pytest.approx(result.shape.tools[0], abs=1e-3)
    # the blade begins above the stem (4 mm) and moves down with the travel; the supports are fixed
    moved = [frame.shape.tools[0][:, 1] - last.tools[0][:, 1] for frame in frames]
    for frame, by in zip(frames, moved, strict=True):
        assert by == pytest.approx(frames[-1].travel - frame.travel, abs=1e-3)
        assert frame.shape.tools[0][:, 0] == pytest.approx(last.tools[0][:, 0])
        assert len(frame.shape.tools) == len(result.shape.tools)
        for held_tool, known in zip(frame.shape.tools[1:], result.shape.tools[1:], strict=True):
            assert held_tool == pytest.approx(known, abs=1e-3)
    assert 3.9 < frames[0].shape.tools[0][:, 1].min() < 4.5
    held = np.unique(last.hexes[last.standing])
    assert np.abs(last.nodes - result.shape.nodes)[held].max() < 1e-3


def test_frames_hold_what_the_solver_had(filmed: tuple[Any, Film], frames: list[Frame]) -> None:
    _, film = filmed
    reference = frames[0].shape.reference
    strained = max(moment.plastic_strain.max() for moment in film.moments)
    for frame, moment in zip(frames, film.moments, strict=True):
        held = np.unique(frame.shape.hexes[moment.standing])
        largest = max(np.abs(other.nodes - reference)[held].max() for other in film.moments)
        assert np.abs(frame.shape.nodes - moment.nodes)[held].max() <= largest / 2000
        assert frame.shape.plastic_strain == pytest.approx(moment.plastic_strain, abs=1e-3 * strained)
        assert np.array_equal(frame.shape.standing, moment.standing)


def test_filming_changes_no_force_and_ends_where_the_stem_breaks(filmed: tuple[Any, Film]) -> None:
    """A test that ends early, between two frames, has as long a film: evenly spaced frames, and its end."""
    whole, _ = filmed
    material = Material(1.1e-9, 1000.0, 0.3, 12.0, 0.5, 0.05, failure_strain=0.02)
    how = Discretisation(element_size=1.5, integration=Integration(mass_scaling=1e6, outputs=OUTPUTS))
    test = ShearTest(material, Stem(8.0, 0.41, 30.0), discretisation=how)
    alone, film = shear(test), Film()
    result = shear(test, inspect=film)
    assert alone.peak_force == result.peak_force == whole.peak_force
    packed, until = film.packed(result), result.history.time[-1]
    assert until < whole.history.time[-1]
    times = [moment.time for moment in film.moments]
    assert (
        FRAMES // 2 <= len(times) <= FRAMES + 1 <= len(result.history.time) and len(packed["travel"]) - len(times) <= 1
    )
    assert np.diff(times) == pytest.approx(times[1], rel=0.2) and until - times[-1] < 1.2 * times[1]
    shown = frames_of(result.shape, packed)[-1].shape
    assert np.array_equal(shown.standing, result.shape.standing)
    assert shown.tools[0] == pytest.approx(result.shape.tools[0], abs=1e-3)


def test_a_film_is_small(filmed: tuple[Any, Film]) -> None:
    result, film = filmed
    assert len(json.dumps(film.packed(result))) < 100_000
    assert film.packed(replace(result, shape=None)) == {}


def test_animation_has_every_frame_and_can_be_read(frames: list[Frame], tmp_path: Path) -> None:
    from PIL import Image

    path = write_animation(frames[::6], tmp_path / "cut.gif")
    with Image.open(path) as picture:
        assert picture.n_frames == len(frames[::6]) == 5
        assert picture.size == (704, 550)
        pixels = []
        for number in range(picture.n_frames):
            picture.seek(number)
            pixels.append(np.asarray(picture.convert("RGB"), dtype=int))
    assert all(np.abs(one - other).max() > 100 for one, other in pairwise(pixels))
    assert path.stat().st_size < 500_000


@pytest.fixture
def with_film(replayed: tuple[Any, Any], filmed: tuple[Any, Film], tmp_path: Path) -> tuple[Any, StudyFolder]:
    """A study whose run at the calibration diameter kept its shape and its film."""
    from stemcal.solvers.embedded import pictured

    study, folder = replayed
    copy = StudyFolder(tmp_path / "study")
    with copy:
        for name in ("screen", "rsm", "invert", "validate"):
            shutil.copy(folder.path / f"{name}.json", copy.path)
        row = next(row for row in folder.read_stage("validate")["rows"] if row["role"] == "fitted")
        record = folder.peek(row["key"])
        curve = {"travel": [0.0, 0.4, 0.8], "force": [0.0, 159.2, 20.0]}
        record["details"] = {"curve": curve, **pictured(*filmed)}
        copy.save(record)
    return study, copy


@pytest.mark.slow
def test_what_a_record_with_a_film_can_show(with_film: tuple[Any, StudyFolder]) -> None:
    study, folder = with_film
    records = read_records(fresh_results(study, folder), folder)
    assert list(films(records)) == ["animation-8mm"]
    path = write_film(study, records, folder, "animation")
    assert path.name == "animation-8mm.gif" and path.stat().st_size > 50_000
    with pytest.raises(UsageError, match="animation-8mm"):
        write_film(study, records, folder, "animation-7mm")


@pytest.mark.slow
def test_the_page_shows_energies_and_cut(with_film: tuple[Any, StudyFolder]) -> None:
    text = render(page_content(*with_film))
    assert "The 8 mm stem at the end" in text and "Energies versus blade travel" in text
    assert len(text.encode()) < 5_000_000


def test_without_a_film_the_remedy_is_told(replayed: tuple[Any, Any]) -> None:
    with pytest.raises(UsageError, match=r"stages store the frames; run"):
        write_film(replayed[0], {}, replayed[1], "animation")


def test_runs_at_a_solution_keep_their_pictures_whatever_stage_came_first() -> None:
    """Refining and validating share a run at the calibration diameter: whichever computes it keeps the pictures."""
    study = load_study(Path(__file__).parents[2] / "configs" / "smoke.yaml")
    solver, levels = Embedded(study), study.midlevels()
    asked = {
        "rsm": Request("rsm", 0, levels, 8.0),
        "refine": Request("refine", 0, levels, 8.0, pictured=True),
        "validate": Request("validate", 0, levels, 8.0, pictured=True),
    }
    answers = {stage: solver.solve(request) for stage, request in asked.items()}
    assert solver.identity(asked["refine"]) == solver.identity(asked["validate"]) != solver.identity(asked["rsm"])
    pictures = {"energies", "shape", "film"}
    assert {stage: pictures & set(answer.details) for stage, answer in answers.items()} == {
        "rsm": set(),
        "refine": pictures,
        "validate": pictures,
    }
    assert len({answer.response for answer in answers.values()}) == 1
