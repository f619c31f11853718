"""The style of figures (colours for colour-blind readers, fonts for Chinese), and their conversion to files."""

import io
import logging
import textwrap
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from stemcal.formats import unit_written
from stemcal.storage.atomic import write_atomic

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes
    from matplotlib.figure import Figure as Figure
else:  # only functions that draw import matplotlib, which is slow to load
    Axes = Figure = Any

INK = "#23272e"
FAINT = "#8a929e"
BLUE = "#0072b2"
ORANGE = "#d55e00"
GREEN = "#009e73"
_OF_THE_PAGE = {FAINT: "var(--faint)", BLUE: "var(--blue)", ORANGE: "var(--orange)", GREEN: "var(--green)"}
COLOURS = {INK: "currentColor", **_OF_THE_PAGE}

_INCH = 25.4
_ATTEMPTS = 6  # largest number of attempts to fit a three-dimensional view into its figure
# A higher compression level of PNG would take twice as long and save only 10 %.
_PIXEL_OPTIONS: dict[str, dict[str, Any]] = {"png": {"compress_level": 3}, "tiff": {"compression": "tiff_lzw"}}

_FONTS = (
    *("DejaVu Sans", "Microsoft YaHei", "SimHei", "SimSun", "PingFang SC", "Hiragino Sans GB", "Noto Sans CJK SC"),
    *("Noto Sans SC", "Source Han Sans SC", "WenQuanYi Micro Hei", "WenQuanYi Zen Hei", "Droid Sans Fallback"),
    "Arial Unicode MS",
)


@cache
def installed_fonts() -> list[str]:
    """Return the installed fonts of `_FONTS`, in order; matplotlib uses for each character the first that has it."""
    from matplotlib import font_manager

    installed = {font.name for font in font_manager.fontManager.ttflist}
    return [name for name in _FONTS if name in installed] or ["sans-serif"]


@contextmanager
def styled() -> Iterator[None]:
    """Apply stemcal's style to figures drawn or saved within this block; suppress warnings about missing glyphs."""
    import matplotlib

    settings: Any = {  # the type in matplotlib's stubs would require all keys
        "font.family": installed_fonts(),
        "font.size": 9,
        "axes.titlesize": 9,
        "axes.unicode_minus": True,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.edgecolor": FAINT,
        "axes.labelcolor": INK,
        "axes.facecolor": "none",
        "figure.facecolor": "none",
        "text.color": INK,
        "xtick.color": INK,
        "ytick.color": INK,
        "lines.linewidth": 1.4,
        "grid.color": FAINT,
        "grid.linewidth": 0.4,
        "legend.frameon": False,
        "legend.fontsize": 8,
        "svg.fonttype": "none",
        "svg.hashsalt": "stemcal",
        "pdf.fonttype": 42,  # TrueType, which journals require
        "ps.fonttype": 42,
    }
    with matplotlib.rc_context(settings), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing")
        yield


def literal(text: str) -> str:
    """Escape each `$` in a text, because matplotlib would read a formula from there."""
    return text.replace("$", r"\$")


def axis_of(label: str, unit: str | None) -> str:
    """Return the axis label of a factor: its label and its unit, for matplotlib."""
    return literal(f"{label}, {written}" if (written := unit_written(unit or "1")) else label)


def in_lines(text: str, most: int) -> str:
    """Break a text into lines of at most `most` letters; a Chinese character is as wide as two letters.

    >>> in_lines("yield stress along the fibre, MPa", 20), in_lines("茎秆屈服应力", 8)
    ('yield stress along\\nthe fibre, MPa', '茎秆屈服\\n应力')
    """
    from rich.cells import chop_cells

    lines = textwrap.wrap(text, most, break_long_words=False)
    return "\n".join(piece for line in lines for piece in chop_cells(line, most))


def frame_in_space(axes: Any, share: float = 1.0) -> None:
    """Zoom out of a three-dimensional view until no axis label is cut off; `share` scales the view and label gaps."""
    page, zoom = axes.figure.bbox, 0.98 * share
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.labelpad = 4.0 + 8.0 * axis.get_label_text().count("\n") * share
    for _ in range(_ATTEMPTS):
        axes.set_box_aspect((1.0, 1.0, 0.85), zoom=zoom)
        axes.figure.draw_without_rendering()
        box = axes.get_tightbbox()
        over = max(page.x0 - box.x0, box.x1 - page.x1, page.y0 - box.y0, box.y1 - page.y1)
        if over <= 0.0:
            return
        zoom *= max(0.5, 1.0 - 2.0 * over / min(page.width, page.height) - 0.01)


@contextmanager
def new_figure(width: float = 4.7, height: float = 3.3) -> Iterator[Figure]:
    """Yield a new figure (size in inches), which needs no display; the style applies within the ``with`` block."""
    with styled():
        yield _shown_figure()(figsize=(width, height), layout="constrained")


@cache
def _shown_figure() -> Any:
    from matplotlib.figure import Figure

    class ShownFigure(Figure):
        """A figure that a notebook can show without matplotlib's inline backend."""

        def _repr_png_(self) -> bytes:
            image = io.BytesIO()
            with styled():
                self.savefig(image, format="png", dpi=110, facecolor="white", metadata=_anonymous("png"))
            return image.getvalue()

    return ShownFigure


def legend_above(axes: Axes, most: int = 3) -> None:
    """Place the legend above the axes, in up to `most` columns if the width of the axes allows."""
    handles, labels = axes.get_legend_handles_labels()
    if labels:
        wide = 1.15 * axes.bbox.width / axes.figure.dpi
        # width of a column: 0.5 inches for the sample of the line, and 0.065 inches for each letter
        most = max(1, min(most, int(wide / (0.5 + 0.065 * max(map(len, labels))))))
        axes.legend(
            handles, labels, loc="lower left", bbox_to_anchor=(-0.02, 1.0), borderaxespad=0.2,
            ncols=min(most, len(labels)), columnspacing=1.2, handlelength=1.8,
        )  # fmt: skip


def save(figure: Figure, path: Path, dpi: float = 200) -> None:
    """Save a figure on a white background; the suffix of `path` determines the format."""
    kind = path.suffix.lower().removeprefix(".")
    # no warning that EPS has no transparency
    logging.getLogger("matplotlib.backends.backend_ps").setLevel(logging.ERROR)
    file = io.BytesIO()
    with styled():
        if kind in _PIXEL_OPTIONS:
            _save_pixels(kind, figure, file, dpi)
        else:
            figure.savefig(file, format=kind, dpi=dpi, facecolor="white", metadata=_anonymous(kind))
    write_atomic(path, file.getvalue())


def _save_pixels(kind: str, figure: Figure, file: IO[bytes], dpi: float) -> None:
    from PIL import Image

    drawn = io.BytesIO()
    figure.savefig(drawn, format="rgba", dpi=dpi, facecolor="white")
    width, height = (int(inches * dpi) for inches in figure.get_size_inches())
    image = Image.frombuffer("RGBA", (width, height), drawn.getvalue(), "raw", "RGBA", 0, 1)
    image.convert("RGB").save(file, kind, dpi=(dpi, dpi), **_PIXEL_OPTIONS[kind])


def resize(figure: Figure, width: float) -> None:
    """Set the width of a figure (mm); the height changes by the power 0.7 of the ratio, the text size not at all."""
    old_width, old_height = figure.get_size_inches()
    ratio = width / _INCH / old_width
    figure.set_size_inches(width / _INCH, old_height * ratio**0.7)
    panels: list[Any] = figure.axes  # two- and three-dimensional
    for axes in panels:
        if axes.name == "3d":
            frame_in_space(axes, min(1.0, ratio) ** 0.6)
        if axes.get_legend() is not None:
            with styled():
                legend_above(axes, most=6)


def svg(figure: Figure) -> str:
    """Return a figure as an SVG document, with the same bytes each time; this fixes the layout of the figure."""
    text = io.StringIO()
    with styled():
        _lay_out(figure)
        figure.savefig(text, format="svg", metadata=_anonymous("svg"))
    return text.getvalue()


def _lay_out(figure: Figure) -> None:
    """Compute the layout with the text widths of SVG, then remove the layout engine, which would change it again."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    engine, canvas, dpi = figure.get_layout_engine(), figure.canvas, figure.dpi
    if engine is not None and figure.axes:
        FigureCanvasSVG(figure)
        engine.execute(figure)
        figure.set_canvas(canvas)
        figure.set_dpi(dpi)
    figure.set_layout_engine(None)


def png(figure: Figure) -> bytes:
    """Return a figure as PNG on a white background, with the layout of its SVG."""
    image = io.BytesIO()
    with styled():
        _lay_out(figure)
        _save_pixels("png", figure, image, 200)
    return image.getvalue()


def _anonymous(kind: str) -> dict[str, None]:
    """Return metadata without date and program, so that the bytes of a file are the same on every machine."""
    names = {
        "svg": ("Date", "Creator", "Format", "Type"),
        "pdf": ("CreationDate", "Creator", "Producer"),
        "eps": ("Creator",),
        "png": ("Software",),
    }
    return dict.fromkeys(names[kind])
