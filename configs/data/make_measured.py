"""Make the SYNTHETIC laboratory examples beside this file: `python make_measured.py [FOLDER]`.

Nobody measured these numbers. Only the means of the maximum forces (120.0, 159.2, 213.8, 300.0, 378.2 N for stems of 7
to 11 mm, six specimens each) and the number of stems (50, three readings each) are those of the published study of
wild chrysanthemum; every scatter is invented. Each grade is written as another testing machine might.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

MEANS = {7: 120.0, 8: 159.2, 9: 213.8, 10: 300.0, 11: 378.2}
SPECIMENS = 6
SCATTER = 0.07  # standard deviation of the maximum force over its mean
MARK = "SYNTHETIC example made by make_measured.py; not a measurement"

Rows = Sequence[tuple[float, float, float]]  # time s, travel mm, force N


def diameters(random: np.random.Generator) -> str:
    """Return 50 stems with three readings each, mean 8.9 mm."""
    true = random.normal(8.9, 1.15, 50)
    true += 8.9 - true.mean()
    lines = [f"# {MARK}", "stem,reading 1 (mm),reading 2 (mm),reading 3 (mm)"]
    for number, diameter in enumerate(true, start=1):
        readings = ",".join(f"{diameter + error:.2f}" for error in random.normal(0, 0.06, 3))
        lines.append(f"{number},{readings}")
    return "\n".join(lines) + "\n"


def peaks(mean: float, random: np.random.Generator) -> list[float]:
    """Return maximum forces whose mean is exactly the given one, to a tenth of a newton."""
    raw = mean * (1.0 + SCATTER * random.normal(size=SPECIMENS))
    tenths = np.round(10.0 * (raw - raw.mean() + mean))
    tenths[-1] += round(10.0 * mean * SPECIMENS) - tenths.sum()
    return [float(value) / 10.0 for value in tenths]


def curve(peak: float, diameter: float, random: np.random.Generator) -> Rows:
    """Return a curve: the blade settles under some newtons, presses in, cuts, and the force falls."""
    travel = np.linspace(0.0, 0.9 * diameter, 120)
    u = travel / (0.5 * diameter)
    shape = np.where(u < 1.0, u**1.6 * (1.6 - 0.6 * u), np.exp(-2.2 * (u - 1.0)))
    force = peak * shape + random.normal(0.0, 0.4, len(travel))
    force[u < 0.04] = np.abs(random.normal(1.5, 0.6, int((u < 0.04).sum())))
    force[int(np.argmax(shape))] = peak
    force = np.minimum(force, peak)
    return list(zip((travel / (100.0 / 60.0)).tolist(), travel.tolist(), force.tolist(), strict=True))


def plain(rows: Rows, name: str, diameter: float) -> bytes:
    """Comma-separated, UTF-8, a line of names."""
    head = [f"# {MARK}", f"# Specimen {name}; diameter: {diameter:.2f} mm", "Time (s),Displacement (mm),Force (N)"]
    return "\n".join([*head, *(f"{t:.3f},{x:.4f},{f:.1f}" for t, x, f in rows), ""]).encode()


def chinese(rows: Rows, name: str, diameter: float) -> bytes:
    """Tabs, GBK, Chinese names."""
    head = [f"{MARK}", f"试样编号\t{name}", f"直径：{diameter:.2f} mm", "", "时间/s\t位移/mm\t力/N"]
    return "\r\n".join([*head, *(f"{t:.3f}\t{x:.4f}\t{f:.1f}" for t, x, f in rows), ""]).encode("gbk")


def wide(rows: Rows, name: str, diameter: float) -> bytes:
    """Tabs, UTF-16, a line of units below the names."""
    head = [MARK, f"Specimen {name}", f"Diameter {diameter:.2f} mm", "Crosshead\tLoad", "[mm]\t[N]"]
    return "\r\n".join([*head, *(f"{x:.4f}\t{f:.1f}" for _, x, f in rows), ""]).encode("utf-16")


def german(rows: Rows, name: str, diameter: float) -> bytes:
    """Semicolons, decimal commas, Windows-1252."""
    head = [MARK, f"Prüfung {name}; Durchmesser {diameter:.2f} mm".replace(".", ","), "Zeit [s];Weg [mm];Kraft [N]"]
    body = [f"{t:.3f};{x:.4f};{f:.1f}".replace(".", ",") for t, x, f in rows]
    return "\r\n".join([*head, *body, ""]).encode("cp1252")


def aligned(rows: Rows, name: str, diameter: float) -> bytes:
    """Columns aligned by blanks, kilonewtons, pressing counted negative."""
    head = [f"# {MARK}", f"# {name}, diameter {diameter:.2f} mm", f"{'Extension(mm)':>14} {'Force(kN)':>12}"]
    return "\n".join([*head, *(f"{x:14.4f} {-f / 1000.0:12.4f}" for _, x, f in rows), ""]).encode()


MACHINES: dict[int, tuple[str, Callable[[Rows, str, float], bytes]]] = {
    7: ("csv", plain),
    8: ("txt", chinese),
    9: ("tsv", wide),
    10: ("csv", german),
    11: ("dat", aligned),
}


def main(folder: Path) -> None:
    """Write all examples; the same bytes each time."""
    random = np.random.default_rng(2021)
    (folder / "measured-shear").mkdir(parents=True, exist_ok=True)
    (folder / "measured-diameters.csv").write_bytes(diameters(random).encode())
    for grade, mean in MEANS.items():
        suffix, write = MACHINES[grade]
        for number, peak in enumerate(peaks(mean, random), start=1):
            diameter = grade + random.uniform(-0.3, 0.3)
            name = f"{grade}mm-{number}"
            rows = curve(peak, diameter, random)
            (folder / "measured-shear" / f"{name}.{suffix}").write_bytes(write(rows, name, diameter))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
