"""Every key of every stage file and of a record left out or of another type, with the seal broken, renewed or gone."""

from __future__ import annotations

import copy
import json
import random
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from of_disks import finished
from tally import Fault, Tally

from stemcal.errors import StemcalError
from stemcal.files.durable import SEAL, sealed
from stemcal.folder.study_folder import StudyFolder
from stemcal.overview.status import status
from stemcal.overview.verify import inspect
from stemcal.report.export.paper import paper_tables
from stemcal.stages.results import fresh_results
from stemcal.study.model import Study
from stemcal.study.reading import load_study

CONFIGS = Path(__file__).parents[2] / "configs"
STAGES = ("screen", "rsm", "invert", "validate")
Way = tuple[str | int, ...]


def ways(content: Any, above: Way = ()) -> Iterator[Way]:
    """Yield the path to every key, of lists to those of their first entry."""
    if above:
        yield above
    if isinstance(content, dict):
        for key, value in content.items():
            yield from ways(value, (*above, key))
    elif isinstance(content, list) and content:
        yield from ways(content[0], (*above, 0))


def variants(content: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the content with one key missing, or of another type, or null."""
    for way in ways(content):
        yield from _at(way, content)


def _at(way: Way, content: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    changed = copy.deepcopy(content)
    _place(changed, way[:-1]).pop(way[-1])
    yield f"{way} missing", changed
    for other in ("text", 5, None, [], {}):
        changed = copy.deepcopy(content)
        _place(changed, way[:-1])[way[-1]] = other
        if changed != content:
            yield f"{way} is {other!r}", changed


def _place(content: dict[str, Any], way: Way) -> Any:
    place: Any = content
    for key in way:
        place = place[key]
    return place


def changed_stage_files(place: Path, times: int, rng: random.Random) -> Tally:
    """A key changed behind the seal's back: `verify` sees it, and nothing that reads the stage believes it."""
    study, folder = _replayed(place)
    everything = [(name, *variant) for name in STAGES for variant in variants(_content(folder, name))]
    tally = Tally(remark=f"{len(everything)} variants of 4 stage files in all")
    for name, what, content in _some(everything, times, rng):
        with _Replaced(folder.path / f"{name}.json") as file:
            file.write_text(json.dumps({SEAL: _seal(file), **content}, indent=2), encoding="utf-8")
            tally.tried += 1
            found = inspect(study, folder)
            results = fresh_results(study, folder)
            if name not in {Path(entry.file).stem for entry in found.damaged}:
                tally.broken.append(f"{name} {what}: not seen by verify")
            elif name in {result.name for result in results.done}:
                tally.broken.append(f"{name} {what}: believed")
            elif next(s.file for s in status(study, folder).stages if s.stage == name) != "damaged":
                tally.broken.append(f"{name} {what}: not seen by status")
    return tally


def unsealed_stage_files(place: Path, times: int, rng: random.Random) -> Tally:
    """A key changed in a file without a seal, or sealed anew: read, or a clear message; never an internal error."""
    study, folder = _replayed(place)
    everything = [(name, *variant) for name in STAGES for variant in variants(_content(folder, name))]
    tally, refused = Tally(), 0
    for number, (name, what, content) in enumerate(_some(everything, times, rng)):
        with _Replaced(folder.path / f"{name}.json") as file:
            file.write_text(sealed(content) if number % 2 else json.dumps(content), encoding="utf-8")
            tally.tried += 1
            try:
                inspect(study, folder)
                status(study, folder)
                paper_tables(study, fresh_results(study, folder))
            except StemcalError as error:
                refused += 1
                if "SPEC" not in str(error):
                    tally.broken.append(f"{name} {what}: no remedy: {error}")
            except Exception as error:
                tally.broken.append(f"{name} {what}: {type(error).__name__}: {error}")
    return tally


def other_records(place: Path, times: int, rng: random.Random) -> Tally:
    """A record sealed anew with a key missing or of another type: seen, set aside, its run alone done again."""
    place.mkdir(parents=True, exist_ok=True)
    folder = finished(place)
    key = folder.keys()[0]
    whole = folder.peek(key)
    assert whole is not None
    everything = list(_of_another_shape(whole))
    tally = Tally(remark=f"{len(everything)} variants in all")
    for what, content in _some(everything, times, rng):
        with _Replaced(folder.record_path(key)) as file:
            file.write_bytes(sealed(content).encode("utf-8"))
            tally.tried += 1
            try:
                found, problem = folder.examine(key)
            except Exception as error:
                found, problem = {}, type(error).__name__
            if found is not None or not problem:
                tally.broken.append(f"{what}: {problem or 'believed'}")
    return tally


def _of_another_shape(whole: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield what no record can hold: inside details and circumstances there may be anything, elsewhere other values."""
    for way in ways(whole):
        if len(way) > 1 and way[0] in ("details", "provenance"):
            continue
        for what, content in _at(way, whole):
            if not (_place(whole, way[:-1]).get(way[-1], ...) == {} or _fits(way, whole, content)):
                yield what, content


def _fits(way: Way, whole: dict[str, Any], content: dict[str, Any]) -> bool:
    """Tell whether a record may be like this: a number for a number, a text for a text, a level less."""
    old, place = _place(whole, way), _place(content, way[:-1])
    if way[-1] not in place:
        return (way[:2] == ("request", "levels") and len(way) == 3) or way == ("request", "pictured")
    new = place[way[-1]]
    if way[0] == "identity" or way[-1] in ("record_version", "key", "status"):
        return False
    numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in (old, new))
    return numbers or type(new) is type(old)


def _replayed(place: Path) -> tuple[Study, StudyFolder]:
    from stemcal import workflow
    from stemcal.executors.inline import InlineExecutor

    place.mkdir(parents=True, exist_ok=True)
    study, folder = load_study(CONFIGS / "paper-replay.yaml"), StudyFolder(place / "out")
    workflow.calibrate(study, folder, InlineExecutor())
    return study, folder


def _content(folder: StudyFolder, name: str) -> dict[str, Any]:
    return folder.examine_stage(name)[0]


def _seal(file: Path) -> str:
    return str(json.loads(file.read_text("utf-8"))[SEAL])


def _some(everything: list[Any], times: int, rng: random.Random) -> list[Any]:
    return everything if times >= len(everything) else rng.sample(everything, times)


class _Replaced:
    """A file that is what it was when the block ends."""

    def __init__(self, file: Path) -> None:
        self.file, self.whole = file, file.read_bytes()

    def __enter__(self) -> Path:
        return self.file

    def __exit__(self, *_error: object) -> None:
        if self.file.is_dir():
            shutil.rmtree(self.file)
        self.file.write_bytes(self.whole)


FAULTS = (
    Fault(
        "changed stage files",
        "a key of a stage file left out or of another type, six ways each, behind the back of its seal",
        "seen by verify and status; no table, page or following stage believes it",
        changed_stage_files,
        6,
        485,
    ),
    Fault(
        "stage files without a seal",
        "the same in files that were sealed anew or never had a seal",
        "read, or refused with the path to the key and the command that mends it",
        unsealed_stage_files,
        20,
        485,
    ),
    Fault(
        "sealed records of another shape",
        "a key of a record left out or of another type, six ways each, sealed anew",
        "seen and not believed: the run counts as missing",
        other_records,
        100,
        193,
    ),
)
