"""Ask and tell: runs done by hand, from a script or a notebook."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stemcal.by_hand.awaited import gone_on, sheet_rows
from stemcal.by_hand.entering import Correction
from stemcal.by_hand.face import asked_runs, enter_filled, require_manual, user_name
from stemcal.by_hand.reading import told
from stemcal.errors import UsageError
from stemcal.folder.study_folder import StudyFolder, default_place
from stemcal.study.model import Study
from stemcal.study.reading.checked import checked_path
from stemcal.text.by_hand import refused
from stemcal.text.names import Names


@dataclass(frozen=True)
class ByHand:
    """Asks for results and records them, in the folder of a study."""

    def ask(self, study: Study, out: str | Path | None) -> list[dict[str, Any]]:
        """Return the runs that are awaited."""
        require_manual(study)
        with StudyFolder(default_place(study.name) if out is None else checked_path(out, "out")) as folder:
            waiting = gone_on(study, folder)
            return [] if waiting is None else asked_runs(study.by_hand, sheet_rows(study, folder, waiting))

    def tell(self, study: Study, runs: Sequence[Mapping[str, Any]], out: str | Path | None, **how: Any) -> int:
        """Record results; return how many were taken."""
        require_manual(study)
        reason, who, sure = how.pop("replace", ""), how.pop("who", ""), how.pop("sure", False)
        if how:
            raise UsageError(f"tell: no parameter {', '.join(how)}; there are replace, who and sure")
        correction = Correction(bool(reason), str(reason), who or user_name(), bool(sure))
        with StudyFolder(default_place(study.name) if out is None else checked_path(out, "out")) as folder:
            found = enter_filled(study, folder, told(list(runs), "tell", study.by_hand), correction)
        if found.refused:
            raise UsageError("\n".join(refused(found, Names(study.naming))))
        return len(found.taken) + len(found.replaced)
