"""Figures in the formats and widths that journals ask for."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from stemcal.drawing.plot import Plot
from stemcal.report.gallery import write_as
from stemcal.stages.invert.showing import profile_points
from stemcal.stages.rsm.figures import levels_of
from stemcal.stages.validate.showing import draw_validation


def plot(stages: dict[str, Any]) -> Plot:
    return Plot("validation", "validate", "", lambda: draw_validation(stages["validate"]))


def test_one_column_is_90_mm_wide_in_pdf_and_eps(stages: dict[str, Any], tmp_path: Path) -> None:
    pdf, eps = write_as([plot(stages)], tmp_path, ["pdf", "eps"], 300, 90.0)
    box = re.search(rb"/MediaBox \[ 0 0 ([\d.]+) [\d.]+ \]", pdf.read_bytes())
    assert box and float(box[1]) / 72 * 25.4 == pytest.approx(90.0, abs=0.1)
    assert b"/Type3" not in pdf.read_bytes()
    box = re.search(rb"%%HiResBoundingBox: ([\d.]+) [\d.]+ ([\d.]+)", eps.read_bytes())
    assert box and (float(box[2]) - float(box[1])) / 72 * 25.4 == pytest.approx(90.0, abs=1.0)


@pytest.mark.parametrize("kind", ["tiff", "png"])
def test_dots_per_inch_of_pixels(kind: str, stages: dict[str, Any], tmp_path: Path) -> None:
    from PIL import Image

    (path,) = write_as([plot(stages)], tmp_path, [kind], 150, 100.0)
    with Image.open(path) as image:
        assert image.size[0] == pytest.approx(100 / 25.4 * 150, abs=1)
        assert image.info["dpi"][0] == pytest.approx(150, rel=1e-3)  # PNG counts whole dots a metre
        assert kind == "png" or image.info["compression"] == "tiff_lzw"
        assert image.mode == "RGB"  # publishers refuse what is transparent
        assert image.getpixel((0, 0)) == (255, 255, 255)


def test_levels_are_round_and_span_the_forces(stages: dict[str, Any]) -> None:
    import numpy as np

    levels = levels_of(np.array([47.3, 196.2]))
    assert levels.tolist() == [40, 60, 80, 100, 120, 140, 160, 180, 200]


def test_profiles_pass_through_the_interval_that_the_table_gives(stages: dict[str, Any]) -> None:
    known = stages["invert"].certainty
    for name, (low, high) in known.intervals.items():
        for bounded in ((True, True), (True, False), (False, True)):
            points = dict(profile_points(replace(known, bounded={name: bounded}), name))
            assert [points.get(end) == 1.0 for end in (low, high)] == list(bounded)
            assert sorted(points) == list(points)
