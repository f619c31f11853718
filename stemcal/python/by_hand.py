"""Ask and tell: runs done by hand, from a script or a notebook."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stemcal.by_hand.awaited import awaited_runs, gone_on
from stemcal.by_hand.entering import Correction, enter, require_sheet, user_name
from stemcal.folder.study_folder import StudyFolder, default_place
from stemcal.solvers.sheet.columns import fields_of
from stemcal.solvers.sheet.reading import told
from stemcal.study.model import Study
from stemcal.study.reading.checked import checked_path


@dataclass(frozen=True)
class ByHand:
    """Asks for results and records them, in the folder of a study."""

    def ask(self, study: Study, out: str | Path | None) -> list[dict[str, Any]]:
        """Return the runs that are awaited."""
        require_sheet(study)
        with _folder(study, out) as folder:
            waiting = gone_on(study, folder)
            runs = [] if waiting is None else awaited_runs(study, folder, waiting)
        fields = fields_of(study.by_hand)
        empty = ("response", "said")
        return [{one.name: None if one.kind in empty else one.asked(run) for one in fields} for run in runs]

    def tell(
        self,
        study: Study,
        rows: Sequence[Mapping[str, Any]],
        out: str | Path | None,
        *,
        replace: str = "",
        who: str = "",
        sure: bool = False,
    ) -> int:
        """Record results; return how many were taken."""
        require_sheet(study)
        with _folder(study, out) as folder:
            found = enter(study, folder, told(rows, study.by_hand), Correction(replace, who or user_name(), sure))
        found.require_all()
        return len(found.taken) + len(found.replaced)


def _folder(study: Study, out: str | Path | None) -> StudyFolder:
    return StudyFolder(default_place(study.name) if out is None else checked_path(out, "out"))
