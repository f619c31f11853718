"""The laboratory tests that programs of the user's do, beside cutting and the tests that are simulated here."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from stemcal.errors import SimulationFailed, UsageError
from stemcal.solvers.command import Command
from stemcal.solvers.laboratory_runs import Performed
from stemcal.solvers.protocol import RESPONSES, Answer, Request
from stemcal.solvers.time_limited_program import Ended
from stemcal.study.model import LaboratorySection, Study


@dataclass(frozen=True)
class TestProgram(Command):
    """A program that answers with the responses of one test, by the names that tests have for them."""

    test: str = ""

    def prepare(self) -> None:
        """Refuse to begin if the program is not there."""
        try:
            super().prepare()
        except UsageError as error:
            raise UsageError(f"tests.{self.test}.{error}") from None

    def _read(self, folder: Path, request: Request, ended: Ended) -> Answer:
        return Answer("ok", details={RESPONSES: self._numbers(folder)})


def program_of(study: Study, section: LaboratorySection, place: Path | None = None) -> TestProgram:
    """Return the program of a test; its run folders are made below `place`."""
    return TestProgram(study.model_copy(update={"solver": section.solver, "tests": ()}), place, section.name)


def run_all(programs: Sequence[tuple[LaboratorySection, TestProgram]], request: Request) -> Performed:
    """Run the programs of tests one after the other.

    Raises
    ------
    SimulationFailed
        If one fails.
    """
    done = Performed({}, (), {})
    for section, program in programs:
        answer = program.solve(request)
        if not answer.ok:
            raise SimulationFailed(answer.reason, f"{section.name}: {answer.message}")
        read = answer.details[RESPONSES]
        named = {section.called(name): read[name] for name in section.measured}
        done = done.beside(Performed(named, (), {section.name: {**answer.details, "warnings": []}}))
    return done
