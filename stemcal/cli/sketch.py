"""A curve drawn with characters."""

from collections.abc import Sequence

BLOCKS = " ▁▂▃▄▅▆▇█"
ASCII = " .-+#"


def sketch(x: Sequence[float], y: Sequence[float], width: int = 60, height: int = 6, plain: bool = False) -> str:
    """Draw y ≥ 0 over x as columns, the axes' ends labelled; `plain` keeps to ASCII.

    >>> print(sketch([0.0, 0.5, 1.0], [0.0, 50.0, 100.0], width=4, height=2, plain=True))
    100.0 N |   #
            |  ##
            +----
             0.00  1.00 mm
    """
    top = max(max(y, default=0.0), 0.0)
    if len(x) < 2 or top <= 0.0:
        return "no force to draw"
    heights = [max(0.0, value) / top * height for value in _resampled(x, y, width)]
    marks = ASCII if plain else BLOCKS
    label = f"{top:.1f} N "
    bar, corner, floor = ("|", "+", "-") if plain else ("│", "└", "─")
    rows = [
        f"{label if row == height - 1 else '':>{len(label)}}{bar}" + "".join(_mark(h - row, marks) for h in heights)
        for row in reversed(range(height))
    ]
    pad = " " * len(label)
    begin = f"{round(x[0], 2) + 0.0:.2f}"
    ends = f"{pad} {begin}{f'{x[-1]:.2f} mm'.rjust(max(width - len(begin), 9))}"
    return "\n".join([*(row.rstrip() for row in rows), f"{pad}{corner}{floor * width}", ends])


def sparkline(values: Sequence[float], width: int = 40) -> str:
    """Return values ≥ 0 as a line of blocks, the highest filling its cell.

    >>> sparkline([0.0, 25.0, 50.0, 100.0], width=4)
    ' ▂▄█'
    """
    top = max(max(values, default=0.0), 1e-12)
    steps = [float(index) for index in range(len(values))]
    columns = _resampled(steps, values, min(width, len(values))) if len(values) > 1 else list(values)
    return "".join(_mark(max(0.0, value) / top, BLOCKS) for value in columns)


def _mark(fill: float, marks: str) -> str:
    """Return the character that fills `fill` of a cell."""
    steps = len(marks) - 1
    return marks[round(min(1.0, max(0.0, fill)) * steps)]


def _resampled(x: Sequence[float], y: Sequence[float], count: int) -> list[float]:
    """Return the largest y in each of `count` equal intervals of x; an empty one repeats its neighbour."""
    span = (x[-1] - x[0]) or 1.0
    columns: list[list[float]] = [[] for _ in range(count)]
    for position, value in zip(x, y, strict=True):
        columns[min(count - 1, max(0, int((position - x[0]) / span * count)))].append(value)
    result: list[float] = []
    for column in columns:
        result.append(max(column) if column else (result[-1] if result else 0.0))
    return result
