"""One run of the program that a spec names: `stemcal simulate` where the solver is not the embedded one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from stemcal.cli.console import note, say, say_json, waiting, warn
from stemcal.errors import RunsFailed, UsageError
from stemcal.files.showing import csv_text
from stemcal.files.typed import from_json
from stemcal.naming import capital
from stemcal.outputs import write_output
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import RESPONSES, Answer, Request

if TYPE_CHECKING:
    from stemcal.study.model import LaboratorySection, Study


def one_run(
    study: Study, levels: Mapping[str, float], at: float, as_json: bool, quiet: bool, csv_file: Path | None
) -> None:
    """Make one run and show its answer; one that failed ends with exit code 3, its folder is named."""
    from stemcal.note import Note
    from stemcal.study.model import ProgramOptions

    if not isinstance(study.solver, ProgramOptions):
        raise UsageError(
            f"simulate needs `solver: {{kind: embedded}}` or a program; this spec has kind {study.solver.kind}"
        )
    solver = make_solver(study)
    solver.prepare()
    with waiting(f"one run of {study.solver.kind}", quiet):
        answer = solver.solve(Request("simulate", 0, dict(levels), at))
    if as_json:
        say_json(vars(answer))
    if answer.response is None:
        raise RunsFailed(f"the run failed ({answer.reason}): {answer.message}")
    if not as_json:
        say("\n".join(_lines(study, answer)))
    for warning in answer.details.get("warnings", []):
        warn(str(from_json(Note, warning)))
    if csv_file:
        _write_curve(answer, csv_file)
        if not quiet:
            note(f"wrote {csv_file}")


def one_test_run(
    study: Study, section: LaboratorySection, levels: Mapping[str, float], at: float, as_json: bool, quiet: bool
) -> None:
    """Let the program of a test do it once and show its responses, beside each what was measured."""
    from stemcal.report.tables.terminal import response_text
    from stemcal.solvers.laboratory_programs import program_of
    from stemcal.study.model.laboratory_tests import RESPONSES as KNOWN

    program = program_of(study, section)
    program.prepare()
    with waiting(f"test {section.name}", quiet):
        answer = program.solve(Request("simulate", 0, dict(levels), at))
    if not answer.ok:
        raise RunsFailed(f"the run failed ({answer.reason}): {answer.message}")
    found, measured = answer.details[RESPONSES], section.means_at(at)
    if as_json:
        say_json({"test": section.name, "responses": found})
        return
    for name, value in found.items():
        _, unit, words = KNOWN[name]
        say(f"{capital(words)}: {response_text(value, unit, measured.get(name))}")


def _lines(study: Study, answer: Answer) -> list[str]:
    """Return the answer in lines: each response, and what the run tells of its peak and of elements gone."""
    naming, details = study.naming, answer.details
    values = {naming.response.name: answer.response, **details.get(RESPONSES, {})}
    lines = [f"{naming.named(name).label}: {naming.named(name).text(value, '.4g')}" for name, value in values.items()]
    if "peak_travel" in details:
        lines.append(f"at {details['peak_travel']:.3f} mm of travel")
    if "deleted_in_all" in details:
        lines.append(f"elements taken away: {details['deleted_elements']} by then, {details['deleted_in_all']} in all")
    return lines


def _write_curve(answer: Answer, path: Path) -> None:
    """Write force over travel as far as the run tells of it."""
    if (curve := answer.details.get("curve")) is None:
        raise UsageError("--csv: the answer of this program is a number without a curve")
    rows = zip(curve["travel"], curve["force"], strict=True)
    write_output(path, csv_text([["travel", "force"], *rows], newline="\r\n"))
