"""Run CalculiX and write the force on the tip, N: minus the reaction in z at the last time, summed over the set TIP."""

import json
import subprocess
from pathlib import Path

subprocess.run(["ccx", "cantilever"], check=True)
printed = Path("cantilever.dat").read_text(encoding="utf-8").split(" for set TIP and time ")[-1]
rows = [line.split() for line in printed.splitlines()[1:] if line.strip()]  # node, fx, fy, fz
Path("result.json").write_text(json.dumps({"force": -sum(float(row[3]) for row in rows)}), encoding="utf-8")
