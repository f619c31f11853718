"""The checks of stages; each is a function of a `StageAtWork` and raises an error if the stage fails."""

import json
import pickle
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from stemcal.drawing.showing import Setting, Showing, names_of
from stemcal.runs.answer import Progress
from stemcal.runs.study_folder import StudyFolder
from stemcal.stages.fresh import changes_since
from stemcal.stages.result import read_result
from stemcal.stages.results import fresh_results
from stemcal.stages.stage import Stage, stage_called
from stemcal.stages.work import HERE
from stemcal.testing.checks import AtWork, apart, require

_STATISTICS = frozenset({"F", "p", "Lenth t", "Coded", "Value", "Sum of squares", "Mean square"})
"""Headings of columns that need no unit: ratios, and squares of a response, for which no unit is printed."""


class StageAtWork(AtWork):
    """A stage to check, which is run after the stages that it needs."""

    thing: Stage[Any]

    def make(self, place: Path, watch: Callable[[Progress], None] = lambda _progress: None) -> StudyFolder:
        """Run the stage in a folder, after the stages that it needs; return the study folder."""
        order, folder = [self.thing], StudyFolder(place)
        while (before := order[0].needs(self.study)) is not None:
            order.insert(0, stage_called(before))
        for stage in order:
            if stage is self.thing or not (place / f"{stage.name}.json").is_file():
                stage.making()(self.study, folder, HERE, watch)
        return folder

    @cached_property
    def finished(self) -> tuple[TemporaryDirectory[str], StudyFolder, Any]:
        """The temporary folder of a run of the stage, the study folder in it, and the result of the stage."""
        temporary = TemporaryDirectory()
        with apart(self.study):
            folder = self.make(Path(temporary.name))
        return temporary, folder, read_result(folder, self.thing.result())

    def files(self, place: Path) -> Mapping[str, bytes]:
        """Return the contents of the files that the stage writes."""
        names = [f"{self.thing.name}.json", *(f"{name}.csv" for name in self.finished[2].tables())]
        return {name: (place / name).read_bytes() for name in names}


def _stage_is_declared(at: StageAtWork) -> None:
    require(bool(at.thing.name and at.thing.title and at.thing.help), "the name, title or help of the stage is missing")
    name = at.thing.result().name
    message = f"the name of the stage is {at.thing.name!r}, but the name of its result is {name!r}"
    require(name == at.thing.name, message)
    require(isinstance(at.thing.showing(), Showing), "`showing` does not return an instance of `Showing`")


def _result_is_its_file(at: StageAtWork) -> None:
    _, folder, result = at.finished
    file = json.dumps(folder.read_stage(at.thing.name))
    require(json.dumps(result.to_json()) == file, "the result changes when it is read and written again")
    require(pickle.loads(pickle.dumps(result)) == result, "the result changes when it is pickled")


def _interrupted_stage_equals_uninterrupted_one(at: StageAtWork) -> None:

    def interrupt(progress: Progress) -> None:
        if progress.stage == at.thing.name and progress.done > progress.cached:
            raise KeyboardInterrupt

    with apart(at.study) as place:
        with suppress(KeyboardInterrupt):
            at.make(place, interrupt)
        at.make(place)
        resumed, uninterrupted = at.files(place), at.files(at.finished[1].path)
        differing = [name for name in uninterrupted if uninterrupted[name] != resumed[name]]
    names = ", ".join(differing)
    require(not differing, f"these files differ between an interrupted and an uninterrupted run: {names}")


def _stage_is_stale_when_an_input_changes(at: StageAtWork) -> None:
    first, *rest = at.study.factors
    wider = first.model_copy(update={"high": first.high + 0.125 * (first.high - first.low)})
    studies = [at.study.model_copy(update={"factors": (wider, *rest)})]
    if (own := at.study.further.get(at.thing.name)) is not None:
        numbers = {key: value for key, value in own if isinstance(value, int | float) and not isinstance(value, bool)}
        for name, value in numbers.items():
            changed = own.model_copy(update={name: value + 1})
            studies.append(at.study.model_copy(update={"further": {**at.study.further, at.thing.name: changed}}))
    now = [changes_since(study, None, at.finished[1], at.thing.name) for study in (at.study, *studies)]
    require(now[0] == [], f"a new result is already out of date: {', '.join(now[0])} changed")
    require(all(now[1:]), "the result is still considered up to date although an input has changed")


def _tables_have_titles_and_units(at: StageAtWork) -> None:
    result = at.finished[2]
    for table in at.thing.showing().tables(result, names_of(result)):
        require(bool(table.title), "a table has no title")
        has_units = any(row[0] in at.study.names for row in table.rows)  # each row is a factor and contains its unit
        for place, column in enumerate(table.columns):
            values = [row[place] for row in table.rows]
            counts = all(isinstance(value, int | str | None) for value in values)
            named = column.unit or column.name in {*at.study.names, *_STATISTICS} or column.words
            require(bool(counts or has_units or named), f"{table.title}: the column {column.name} has no unit")
    for name, table in result.tables().items():
        message = f"the rows of {name}.csv have different lengths"
        require(all(len(row) == len(table.columns) for row in table.rows), message)


def _stage_is_shown(at: StageAtWork) -> None:
    """Check that the outcome of a stage is a list of texts, its tables can be formatted, and its figures drawn."""
    _, folder, result = at.finished
    showing, names = at.thing.showing(), names_of(result)
    assert isinstance(showing, Showing)
    message = "`outcome` must return a list of texts"
    require(all(isinstance(text, str) for text in showing.outcome(result, names)), message)
    for table in showing.tables(result, names):
        written = [
            column.written(value) for row in table.rows for column, value in zip(table.columns, row, strict=True)
        ]
        message = f"{table.title}: the format of a column returns no text"
        require(all(isinstance(text, str) for text in written), message)
    for plot in showing.figures(result, Setting(at.study, fresh_results(at.study, folder))):
        require(plot.section == at.thing.name, f"the section of the {plot.name} figure must be {at.thing.name!r}")
        require(bool(plot.document), f"the {plot.name} figure is empty")


OF_STAGES: tuple[Callable[[StageAtWork], None], ...] = (
    _stage_is_declared, _result_is_its_file, _interrupted_stage_equals_uninterrupted_one,
    _stage_is_stale_when_an_input_changes, _tables_have_titles_and_units, _stage_is_shown,
)  # fmt: skip
