"""A made-up program with chance in it: reads its parameters, writes an angle of repose and a bulk density.

The second argument, if there is one, is the seed of its chance; without it the chance follows from the parameters.
"""

import json
import random
import sys
from pathlib import Path


def main() -> None:
    """Read, work out, write."""
    given = Path("given.json").read_text(encoding="utf-8")
    values, chance = json.loads(given), random.Random(given + "".join(sys.argv[1:]))
    static, rolling, restitution = values["static"], values["rolling"], values["restitution"]
    shear, density, noise = values["shear_modulus"], values["grain_density"], values["noise"]
    angle = 12.0 + 28.0 * static + 90.0 * rolling - 60.0 * static * rolling - 1.5 * restitution + 0.01 * shear
    bulk = 0.62 * density * (1.0 - 0.12 * static - 0.2 * rolling)
    out = {"angle": angle + chance.gauss(0.0, noise), "bulk": bulk + chance.gauss(0.0, 5.0 * noise)}
    Path("out.json").write_text(json.dumps(out), encoding="utf-8")


if __name__ == "__main__":
    main()
