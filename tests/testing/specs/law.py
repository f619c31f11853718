"""A known law as a class, and as a program that reads a file and writes one."""

from pathlib import Path


class Law:
    def solve(self, levels: dict[str, float], condition: float) -> dict[str, float]:
        a, b = (levels["yield_stress"] - 15.0) / 5.0, (levels["failure_strain"] - 0.03) / 0.02
        c = (levels["density"] - 1100.0) / 100.0
        force = (100.0 + 20.0 * a + 8.0 * b + 3.0 * b * b + 0.5 * a * b + 0.1 * c) * (condition / 8.0) ** 2
        return {"force": force}


if __name__ == "__main__":
    lines = Path("input.txt").read_text(encoding="utf-8").splitlines()
    values = {name: float(value) for name, value in map(str.split, lines)}
    force = Law().solve(values, values["diameter"])["force"]
    Path("out.txt").write_text(f"force {force}", encoding="utf-8")
