"""Runs done by hand, from Python: the runs that a study awaits, and their results."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stemcal.by_hand.awaited import advance_study, awaited_runs
from stemcal.by_hand.entering import record_results, require_sheet
from stemcal.by_hand.run_sheet import fields_of, rows_from_mappings
from stemcal.runs.study_folder import StudyFolder, place_of
from stemcal.study.model.study import Study


@dataclass(frozen=True)
class AskAndTell:
    """Lists the pending runs in a study folder and records their results."""

    def ask(self, study: Study, out: str | Path | None) -> list[dict[str, Any]]:
        """Return the runs without results."""
        require_sheet(study)
        with StudyFolder(place_of(study.name, out)) as folder:
            waiting = advance_study(study, folder)
            runs = [] if waiting is None else awaited_runs(study, folder, waiting)
        fields = fields_of(study.by_hand)
        empty = ("response", "origin")
        return [{one.name: None if one.kind in empty else one.asked(run) for one in fields} for run in runs]

    def tell(
        self, study: Study, rows: Sequence[Mapping[str, Any]], out: str | Path | None, *, replace: str = ""
    ) -> int:
        """Record results; return how many were accepted."""
        require_sheet(study)
        with StudyFolder(place_of(study.name, out)) as folder:
            sheet = rows_from_mappings(rows, study.by_hand)
            found = record_results(study, folder, sheet, replace_because=replace)
        found.require_all()
        return len(found.taken) + len(found.replaced)
