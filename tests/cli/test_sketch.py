from __future__ import annotations

from stemcal.cli.sketch import sketch, sparkline


def test_a_ramp_fills_half_of_the_picture() -> None:
    x = [i / 400 for i in range(401)]
    drawn = sketch(x, [100 * value for value in x], width=40, height=5)
    assert drawn.count("█") + drawn.count("▄") / 2 == 5 * 40 / 2 or abs(drawn.count("█") - 100) <= 20
    assert drawn.splitlines()[0].startswith("100.0 N ")
    assert drawn.splitlines()[-1].endswith("1.00 mm")


def test_plain_is_ascii_and_no_wider() -> None:
    x = [i / 100 for i in range(101)]
    drawn = sketch(x, [value * (1 - value) for value in x], plain=True)
    assert drawn.isascii()
    assert max(map(len, drawn.splitlines())) <= 80


def test_sparkline_rises_to_a_full_block() -> None:
    drawn = sparkline([float(i) for i in range(400)])
    assert len(drawn) == 40
    assert (drawn[0], drawn[-1]) == (" ", "█")
    assert list(drawn) == sorted(drawn, key=" ▁▂▃▄▅▆▇█".index)
    assert sparkline([0.0, 0.0]) == "  "


def test_nothing_to_draw() -> None:
    assert sketch([], []) == "no force to draw"
    assert sketch([0.0, 1.0], [0.0, 0.0]) == "no force to draw"
