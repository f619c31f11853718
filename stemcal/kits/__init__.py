"""Studies to start from, as data beside this module: a commented spec each, and the files that its runs need."""

from __future__ import annotations

from pathlib import Path

KITS: dict[str, tuple[str, ...]] = {
    "by-hand": (),
    "angle-of-repose-edem": ("picture/angle.py",),
    "angle-of-repose-liggghts": ("grains/grains.py", "grains/heap.in", "grains/heap.py"),
    "angle-of-repose-yade": ("yade/heap.json", "yade/heap.py"),
    "bulk-density": ("grains/grains.py", "grains/box.in", "grains/box.py"),
    "hopper-discharge": ("grains/grains.py", "grains/hopper.in", "grains/hopper.py"),
    "stalk-bending-lammps": ("stalk/stalk.in", "stalk/stalk.py"),
    "ls-dyna-window": ("dyna/parameters.k", "dyna/peak.py"),
}
"""The files of each kit; they are put beside the spec, in folders of these names."""


def kit_text(name: str) -> str:
    """Return a spec, by the name of its kit, or a file of one."""
    path = Path(__file__).parent / (name if "/" in name else f"{name}.yaml")
    return path.read_text(encoding="utf-8")
