"""The files of the stages in the folder of a study: sealed JSON, whole or not at all, and tables as CSV."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stemcal.errors import UsageError
from stemcal.files.durable import Broken, opened, sealed, write_atomic
from stemcal.files.rows import Table

SCHEMA_VERSION = 2


class StageFiles:
    """The files of the stages in a folder.

    Attributes
    ----------
    path : Path
        The folder.
    """

    path: Path

    def write_stage(self, stage: str, content: Mapping[str, Any]) -> None:
        """Write a stage's JSON and its seal, whole or not at all; the same content gives the same bytes."""
        write_atomic(self.path / f"{stage}.json", sealed(content))

    def read_stage(self, stage: str) -> dict[str, Any]:
        """Return a stage's JSON without its seal, to be believed.

        Raises
        ------
        UsageError
            If the stage has not run yet, or its file is of another version, has changed since it was written or cannot
            be read.
        """
        content = self.examine_stage(stage)
        if (version := content.get("schema_version")) != SCHEMA_VERSION:
            raise UsageError(
                f"{self.path / stage}.json has schema version {version!r:.20}; this version of stemcal requires "
                f"{SCHEMA_VERSION}; run `stemcal {stage} SPEC` again (recorded runs are reused)"
            )
        return content

    def examine_stage(self, stage: str) -> dict[str, Any]:
        """Return a stage's JSON of any version without its seal; raises as `read_stage` does."""
        path = self.path / f"{stage}.json"
        try:
            content = opened(path)
        except FileNotFoundError:
            raise UsageError(f"{path} does not exist yet; run `stemcal {stage} SPEC` first") from None
        except Broken as broken:
            raise UsageError(f"{path} is damaged: the file {broken}; run `stemcal {stage} SPEC` again") from None
        if content.get("stage") != stage:
            raise UsageError(f"{path} is not a result of {stage}; run `stemcal {stage} SPEC` again")
        return content

    def has_stage(self, stage: str) -> bool:
        """Whether a stage has left its file."""
        return (self.path / f"{stage}.json").exists()

    def write_csv(self, name: str, table: Table) -> None:
        """Write a table as ``name.csv``."""
        write_atomic(self.path / f"{name}.csv", table.csv())
