"""Angle of repose from a picture of the heap: ``python3 angle.py heap.png [heap2.png ...]``.

The picture is a side view, level, of a heap before a plain background on a plain floor, as EDEM or Rocky saves it or a
camera takes it (PNG; other formats need Pillow). What differs from the background is the heap. From its peak the
outline is followed to both sides, and a straight line is fitted to the middle of each flank. Prints the angle of each
and their mean, in degrees. Needs numpy and matplotlib, which come with stemcal.
"""

from __future__ import annotations

import sys

import matplotlib.image
import numpy as np

LOW, HIGH = 0.15, 0.85  # share of the height between which a flank is fitted: foot and peak are rounded
DIFFERENT = 0.15  # from the background, of the whole range of grey


def outline(picture: np.ndarray) -> np.ndarray:
    """Return the height of the heap above the lowest row of the picture in every column, in pixels; 0 where none is.

    The background is the grey of the upper corners; grains that fly alone are passed over.
    """
    colours = picture[..., :3] if picture.ndim == 3 else picture[..., None]
    grey = colours.mean(axis=2) / (255.0 if picture.dtype.kind in "ui" else 1.0)
    margin = max(2, min(grey.shape) // 20)
    background = np.median(np.concatenate([grey[:margin, :margin].ravel(), grey[:margin, -margin:].ravel()]))
    heap = np.abs(grey - background) > DIFFERENT
    solid = heap[:-2] & heap[1:-1] & heap[2:]
    top = np.argmax(solid, axis=0)
    return np.where(solid.any(axis=0), grey.shape[0] - top, 0).astype(float)


def flank(distance: np.ndarray, height: np.ndarray) -> float:
    """Return the angle of one flank, deg: the line through its outline between the heights of `HIGH` and `LOW`."""
    first, last = (int(np.argmax(height <= share * height.max())) for share in (HIGH, LOW))
    if last < first + 5:
        sys.exit("no flank is seen; take a picture from the side, before a plain background")
    return float(np.degrees(np.arctan(-np.polyfit(distance[first:last], height[first:last], 1)[0])))


def angles(picture: np.ndarray) -> tuple[float, float]:
    """Return the angle of the left and of the right flank, deg."""
    height = outline(picture)
    height = np.maximum(height - np.median(height[: max(2, len(height) // 50)]), 0.0)  # the floor at the left edge
    peak = int(np.median(np.flatnonzero(height >= 0.98 * height.max())))
    left, right = height[: peak + 1][::-1], height[peak:]
    return flank(np.arange(len(left)), left), flank(np.arange(len(right)), right)


def main() -> None:
    """Measure the pictures that are named."""
    for name in sys.argv[1:]:
        left, right = angles(matplotlib.image.imread(name))
        print(f"{name}: left {left:.1f}, right {right:.1f}, mean {0.5 * (left + right):.2f}")


if __name__ == "__main__":
    main()
