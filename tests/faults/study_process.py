"""A study in a process of its own, for tests that kill it: FOLDER WITNESS SECONDS_PER_RUN.

Beside the witness of begun runs it leaves ``WITNESS.saved``, a line per record acknowledged by the folder.
"""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import workflow
from fakes import FakeSolver, make_study

from stemcal.runs.executors.local import LocalExecutor
from stemcal.runs.study_folder import StudyFolder


class WitnessedFolder(StudyFolder):
    """Tells of every acknowledged record."""

    def save(self, record: Mapping[str, Any]) -> None:
        super().save(record)
        with Path(f"{sys.argv[2]}.saved").open("ab") as file:
            file.write(f"{record['key']}\n".encode())


def main() -> None:
    """Take the known study through all stages with two workers."""
    folder, witness, seconds = Path(sys.argv[1]), Path(sys.argv[2]), float(sys.argv[3])
    study = make_study(folder.parent, "rsm: {centre_points: 3}\n")
    solver = FakeSolver(witness, seconds)
    with WitnessedFolder(folder) as open_folder, LocalExecutor(2) as executor:
        workflow.calibrate(study, open_folder, executor, solver=solver)


if __name__ == "__main__":
    main()
