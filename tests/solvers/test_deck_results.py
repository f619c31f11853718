"""The answers of LS-DYNA and OpenRadioss, computed from forces that are written down here; and their failures."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stemcal.errors import SimulationFailed, UsageError
from stemcal.notes import Note
from stemcal.processes.program import ProgramRun
from stemcal.solvers.deck import lsdyna, openradioss
from stemcal.solvers.deck.lsdyna import failed_elements, force_in_rcforc, tail
from stemcal.solvers.deck.openradioss import (
    deleted_elements,
    engine_ran,
    force_in_histories,
    installation,
    starter_errors,
    table_made,
    values_not_read,
    write_engine_input,
)
from stemcal.solvers.deck.peak import ContactForce, peak_answer
from stemcal.solvers.options import DeckSolver
from stemcal.solvers.protocol import Answer
from stemcal.study.model.shear_test import LoadingSection

LOADING = LoadingSection(speed=2.0)  # mm/s
UNFILTERED = DeckSolver(program="lsdyna", filter_window=0.0)


def failing(run: Callable[[], object]) -> tuple[str, str]:
    """Return reason and message with which a run fails."""
    with pytest.raises(SimulationFailed) as caught:
        run()
    return caught.value.reason, str(caught.value)


# ---- the peak


def test_the_answer_has_every_number_of_the_peak() -> None:
    """A triangle over 4 s, elements deleted at 1.5 and 2.5 s; half the force is lost at 3 s; the gap is 0.001 mm."""
    time = np.linspace(0.0, 4.0, 9)
    force = np.array([0.0, 30.0, 60.0, 80.0, 100.0, 70.0, 50.0, 20.0, 300.0])
    answer = peak_answer(ContactForce(time, force), UNFILTERED, LOADING, [2.5, 1.5], [Note("own", "info", "own")])
    curve = answer.details.pop("curve")
    assert (answer.status, answer.response) == ("ok", 100.0)
    assert answer.details == {
        "peak_force": 100.0,
        "peak_force_raw": 100.0,
        "peak_time": 2.0,
        "peak_travel": pytest.approx(3.999),
        "break_travel": pytest.approx(5.999),
        "deleted_elements": 1,
        "deleted_in_all": 2,
        "stroke_was_enough": True,
        "warnings": [{"kind": "own", "severity": "info", "text": "own", "remedy": None}],
    }
    assert curve["travel"] == pytest.approx((2.0 * time - 0.001).tolist()) and curve["force"] == force.tolist()


def test_a_deletion_at_an_output_counts_there() -> None:
    time, force = np.arange(5.0), np.array([0.0, 50.0, 100.0, 40.0, 20.0])
    at_peak = peak_answer(ContactForce(time, force), UNFILTERED, LOADING, [2.0])
    assert at_peak.details["deleted_elements"] == 1
    later = peak_answer(ContactForce(time, force), UNFILTERED, LOADING, [3.0])
    assert (later.details["deleted_elements"], later.details["break_travel"]) == (0, pytest.approx(5.999))


@pytest.mark.parametrize(
    ("window", "peak"),
    [(0.0, 90.0), (0.1, 90.0), (0.14, 90.0), (0.16, 50.0), (0.3, 50.0), (0.36, 36.0)],
)
def test_the_window_is_rounded_to_outputs(window: float, peak: float) -> None:
    """Outputs each 0.1 s, a spike of 90 N on 30 N: means of 1, 3 and 5 outputs are 90, 50 and 42 N."""
    time = np.linspace(0.0, 1.0, 11)
    force = np.full(11, 30.0)
    force[5] = 90.0
    answer = peak_answer(ContactForce(time, force), DeckSolver(program="lsdyna", filter_window=window), LOADING)
    assert answer.response == pytest.approx(42.0 if peak == 36.0 else peak)
    assert answer.details["peak_force_raw"] == 90.0


@pytest.mark.parametrize(("last", "enough"), [(89.9, True), (90.0, False)])
def test_a_stroke_is_long_enough_if_the_force_has_fallen_by_a_tenth(last: float, enough: bool) -> None:
    force = np.array([0.0, 100.0, last])
    answer = peak_answer(ContactForce(np.arange(3.0), force), UNFILTERED, LOADING)
    assert answer.details["stroke_was_enough"] is enough
    assert [note["kind"] for note in answer.details["warnings"]] == ([] if enough else ["stroke_too_short"])
    assert not {"break_travel", "deleted_elements", "responses"} & set(answer.details)


def test_no_force_names_what_to_check() -> None:
    reason, message = failing(lambda: peak_answer(ContactForce(np.arange(2.0), np.zeros(2)), UNFILTERED, LOADING))
    assert (reason, message.startswith("the blade exerted no force on the stem")) == ("no_contact", True)
    assert peak_answer(ContactForce(np.arange(2.0), np.array([0.0, 1e-9])), UNFILTERED, LOADING).ok


def test_a_force_has_the_sign_that_makes_its_peak_positive() -> None:
    time = np.arange(3.0)
    assert ContactForce.of(time, np.array([0.0, -5.0, 4.9]), "f").force.tolist() == [0.0, 5.0, -4.9]
    assert ContactForce.of(time, np.array([0.0, -5.0, 5.0]), "f").force.tolist() == [0.0, -5.0, 5.0]


@pytest.mark.parametrize(
    ("time", "force", "found"),
    [
        ([0.0], [1.0], "the time values of the blade force in f are not in increasing order"),
        ([0.0, 0.0], [1.0, 2.0], "the time values of the blade force in f are not in increasing order"),
        ([0.0, 1.0, 0.5], [1.0, 2.0, 3.0], "the time values of the blade force in f are not in increasing order"),
        ([0.0, 1.0, np.nan], [1.0, 2.0, 3.0], "the blade force in f is not a number after 1 s"),
        ([0.0, 1.0, 2.0], [1.0, np.inf, 3.0], "the blade force in f is not a number after 2 s"),
        ([5.0, 6.0], [np.nan, np.nan], "the blade force in f is not a number after 0 s"),
    ],
)
def test_forces_that_are_no_history(time: list[float], force: list[float], found: str) -> None:
    reason, message = failing(lambda: ContactForce.of(np.array(time), np.array(force), "f"))
    assert (reason, message) == ("nan" if "number" in found else "bad_result", found)
    assert len(ContactForce.of(np.array([0.0, 1.0]), np.array([1.0, 2.0]), "f").time) == 2


# ---- LS-DYNA

NORMAL = " N o r m a l    t e r m i n a t i o n\n"


def row(side: str, contact: int, time: str, z: str) -> str:
    return f" {side} {contact} time {time}  x 9.0 y 8.0 z {z} mass 1.0\n"


def test_the_force_of_a_contact_is_that_of_its_first_side() -> None:
    text = "title\n" + row("master", 2, "0.0", "70.0")
    for number, force in enumerate((0.0, 5.0, 2.0)):
        text += row("SLAVE", 1, f"{number}.0", f"{-force}") + row("master", 1, f"{number}.0", f"{3 * force}")
        text += row("slave", 2, f"{number}.0", "99.0")
    contact = force_in_rcforc(text)
    assert (contact.time.tolist(), contact.force.tolist()) == ([0.0, 1.0, 2.0], [0.0, 5.0, 2.0])
    without = row("slave", 3, "0.0", "1.0") + row("master", 2, "0.0", "1.0") + row("slave", 3, "1.0", "1.0")
    found = failing(lambda: force_in_rcforc(without))
    assert found == ("no_result", "rcforc contains no force for contact 1 (contacts found: [2, 3])")
    assert failing(lambda: force_in_rcforc(""))[1].endswith("(contacts found: [])")


def read(folder: Path, printed: str, code: int = 0) -> Any:
    return lsdyna._read(folder, lambda contact, failed: (contact, failed), ProgramRun(code, False, printed, 1.0))


def test_a_run_of_ls_dyna_ends_normally_or_fails_with_its_reason(tmp_path: Path) -> None:
    (tmp_path / "rcforc").write_text(row("slave", 1, "0.0", "0.0") + row("slave", 1, "1.0", "7.0"), encoding="utf-8")
    contact, failed = read(tmp_path, NORMAL)
    assert (contact.force.tolist(), failed) == ([0.0, 7.0], [])
    assert failing(lambda: read(tmp_path, NORMAL, 3))[0] == "exit_code"
    silent = failing(lambda: read(tmp_path, "bye"))
    assert silent == ("no_termination", "LS-DYNA did not report normal termination")
    for name in ("messag", "mes0000", "d3hsp"):
        (tmp_path / name).write_text(NORMAL + " element 5 failed at time 0.25\n", encoding="utf-8")
        assert read(tmp_path, "bye")[1] == [0.25]
        (tmp_path / name).unlink()
    wrong = " *** Error 40509 (SOL+509)\n *** Error 2\n E r r o r   t e r m i n a t i o n\n" + NORMAL
    found = failing(lambda: read(tmp_path, wrong))
    assert found == ("error_termination", "LS-DYNA stopped with an error: *** Error 40509 (SOL+509)")
    assert failing(lambda: read(tmp_path, "error termination"))[1] == "LS-DYNA stopped with an error"
    assert failing(lambda: read(tmp_path, f"*** error {'x' * 300}\nerror termination"))[1] == (
        f"LS-DYNA stopped with an error: *** error {'x' * 190}"
    )


def test_an_element_counts_once_and_the_last_report_has_its_time(tmp_path: Path) -> None:
    (tmp_path / "messag").write_text(" solid ELEMENT 7 failed at time 2.0E-01\n", encoding="utf-8")
    (tmp_path / "d3hsp").write_text(
        " element 9 failed at time 3.0D-01\n element 7 failed at time 0.25", encoding="utf-8"
    )
    printed = "element 7 failed at time 0.1\nelement 8 failed at time 0.4\nelement x failed at time 1"
    assert failed_elements(tmp_path, printed) == [0.25, 0.4, 0.3]
    assert failed_elements(tmp_path / "nowhere", "") == []


def test_the_end_of_a_file_is_read(tmp_path: Path) -> None:
    (tmp_path / "long").write_bytes(b"a" * 30_000 + b"end")
    assert tail(tmp_path / "long") == "a" * 19_997 + "end"
    assert tail(tmp_path / "long", 4) == "aend" and tail(tmp_path / "missing") == ""


# ---- OpenRadioss


def ran(code: int, printed: str = "") -> ProgramRun:
    return ProgramRun(code, False, printed, 1.0)


@pytest.mark.parametrize(
    ("code", "printed", "found"),
    [
        (
            0,
            "ERROR: FILE run_0000_0001.rst NOT FOUND",
            ("no_restart", "the engine did not find run_0000_0001.rst, the"),
        ),
        (
            2,
            "** ERROR : no time step\n** ERROR 2\nERROR TERMINATION",
            ("engine_error", "the engine stopped with an error: ** ERROR : no time step"),
        ),
        (0, "ERROR TERMINATION", ("engine_error", "the engine stopped with an error")),
        (1, "NORMAL TERMINATION", ("exit_code", "the program finished with exit code 1: NORMAL TERMINATION")),
        (0, "stopped", ("no_termination", "the engine did not report normal termination")),
        (
            1,
            f"  ** ERROR {'e' * 300}\nERROR TERMINATION",
            ("engine_error", f"the engine stopped with an error: ** ERROR {'e' * 191}"),
        ),
    ],
)
def test_the_engine_ends_normally_or_fails_with_its_reason(
    tmp_path: Path, code: int, printed: str, found: tuple[str, str]
) -> None:
    reason, message = failing(lambda: engine_ran(tmp_path, ran(code, printed)))
    assert reason == found[0] and message.startswith(found[1])
    assert message == found[1] or reason == "no_restart"
    (tmp_path / "run_0001.out").write_text(printed, encoding="utf-8")
    assert failing(lambda: engine_ran(tmp_path, ran(code)))[0] == reason
    (tmp_path / "run_0001.out").write_text("NORMAL TERMINATION", encoding="utf-8")
    assert engine_ran(tmp_path, ran(0)) == Answer("ok")


TABLE = '"time","TH-INTER 1 FNZ","TH-INTER 1 FTZ"\n0.0,0,0\n1.0,-2.0,-0.5\n2.0,-1.0,-0.5\n'
FAILURE = "     FIRST  FAILURE PARAMETER (D1). . . . . =  3.4840000000000E-02\n"


def test_the_table_of_histories_becomes_the_answer(tmp_path: Path) -> None:
    def peak(contact: ContactForce, failed: list[float], warnings: list[Note]) -> Any:
        return contact.force.tolist(), failed, [note.kind for note in warnings]

    missing = "th_to_csv exited with code 0 and wrote no table: the engine wrote no runT01"
    assert failing(lambda: table_made(tmp_path, peak, ran(0))) == ("no_history", missing)
    (tmp_path / "runT01").write_text("binary", encoding="utf-8")
    message = "th_to_csv exited with code 136 and wrote no table"
    assert failing(lambda: table_made(tmp_path, peak, ran(136))) == ("no_history", message)
    (tmp_path / "runT01.csv").write_text(TABLE, encoding="utf-8")
    assert failing(lambda: table_made(tmp_path, peak, ran(1)))[1].startswith("th_to_csv exited with code 1")
    (tmp_path / "run_0001.out").write_text(
        "   7  0.28  0.3E-04 NODE 2  1\n DELETE SOLID ELEMENT NUMBER  5\n", encoding="utf-8"
    )
    assert table_made(tmp_path, peak, ran(0)) == ([0.0, 2.5, 1.5], [0.28], ["nothing_deleted"])
    (tmp_path / "run_0000.out").write_text(FAILURE, encoding="utf-8")
    assert table_made(tmp_path, peak, ran(0))[2] == []


@pytest.mark.parametrize(
    ("text", "reason", "message"),
    [
        ("", "bad_result", "the table of time histories is not valid CSV"),
        ("time,x\n0,1\n", "impulse", "the time histories have no titles"),
        ('"time","TH-INTER 2 FNZ"\n0,1\n', "no_result", "no force for contact 1 (contacts found: [2])"),
        ('"time","TH-INTER 1 FNZ"\n0,1\n', "no_result", "no force for contact 1 (contacts found: [1])"),
        (TABLE + "3.0,1.0\n", "bad_result", "the table of time histories has an incomplete row"),
        (TABLE + "3.0,x,1.0\n", "bad_result", "'x' is not a number"),
        (TABLE + "2.0,1.0,1.0\n", "bad_result", "not in increasing order"),
    ],
)
def test_a_table_that_is_no_history_of_the_blade(text: str, reason: str, message: str) -> None:
    found = failing(lambda: force_in_histories(text))
    assert found[0] == reason and message in found[1]
    assert force_in_histories(TABLE + "\n3.0,-0.5,-0.5\n").force.tolist() == [0.0, 2.5, 1.5, 1.0]


def test_a_deletion_has_its_printed_time_or_that_of_the_cycle_before() -> None:
    listing = " DELETE SOLID ELEMENT NUMBER 1\n   100  0.1  0.3E-04 NODE 2  1\n DELETE SOLID ELEMENT NUMBER 2\n"
    listing += "   200  0.2  0.3E-04 NODE 2  1\n DELETE SOLID ELEMENT NUMBER 3\n DELETE SOLID ELEMENT NUMBER 2\n"
    assert deleted_elements(listing, "") == [0.0, 0.2, 0.2]
    printed = " DELETE SOLID ELEMENT NUMBER 1 AT TIME : 0.05\n DELETE SOLID ELEMENT NUMBER 3\n"
    assert deleted_elements(listing, printed) == [0.05, 0.2, 0.2]


WRITTEN = {"ro": 1e-9, "e": 1000.0, "pr": 0.3, "sigy": 18.07, "etan": 0.5, "fail": 0.035, "c": 90.0, "p": 8.0}
ECHOED = {
    "ro": 1e-9,
    "e": 1000.0,
    "pr": 0.3,
    "sigy": 18.07,
    "plastic": 500.0 / 999.5,
    "c": 90.0,
    "p": 0.125,
    "f": 0.035,
}


def listing(**changed: float) -> str:
    return "".join(f"  A VALUE . . . = {value!r}  \n" for value in {**ECHOED, **changed}.values())


def test_every_value_of_the_card_is_compared_with_the_listing() -> None:
    assert values_not_read(listing(), WRITTEN) == []
    names = {"ro": "density", "e": "elastic modulus", "pr": "Poisson's ratio", "sigy": "yield stress"}
    names |= {"plastic": "plastic modulus", "c": "C", "p": "1/P", "f": "failure strain"}
    for key, name in names.items():
        wrong = values_not_read(listing(**{key: 3.0}), WRITTEN)
        assert wrong == [f"{name} = {ECHOED[key]:.6g}"]
        assert values_not_read(listing(**{key: ECHOED[key] * 1.00019}), WRITTEN) == []
        assert values_not_read(listing(**{key: ECHOED[key] * 1.00021}), WRITTEN) == wrong
    assert values_not_read(listing(), WRITTEN, 0.7) == ["nonlocal length = 0.7"]
    unrated = {**WRITTEN, "c": 0.0, "p": 0.0, "etan": 0.0}
    assert values_not_read(listing(c=5.0, p=5.0, plastic=5.0), unrated) == []


def test_errors_of_the_starter_have_their_description() -> None:
    text = "ERROR ID : 1\r\n** ERROR IN PART\r\n\r\n   second\r\nERROR ID : 2\n" + "".join(
        f"line {i}\n" for i in range(9)
    )
    first, second = starter_errors(text)
    assert first == "ERROR ID : 1 ** ERROR IN PART"
    assert second == "ERROR ID : 2 " + " ".join(f"line {i}" for i in range(6))
    assert starter_errors(f"ERROR ID : 3 {'x' * 400}") == [f"ERROR ID : 3 {'x' * 287}"]
    assert starter_errors("no error") == []


def test_the_engine_input_is_that_of_the_starter_with_titles_and_the_name_of_the_run(tmp_path: Path) -> None:
    path = tmp_path / "run_0001.rad"
    found = failing(lambda: write_engine_input(tmp_path, None))
    message = "the starter wrote no run_0001.rad: the program did not write the file run_0001.rad"
    assert found == ("no_engine_input", message)
    path.write_text("/RUN/runk/1/\n0.5\n/TH/TITLE\n", encoding="utf-8")
    write_engine_input(tmp_path, None)
    assert path.read_text("utf-8") == "/RUN/run/1/\n0.5\n/TH/TITLE\n"
    path.unlink()
    (tmp_path / "elsewhere").write_text("kept", encoding="utf-8")
    path.symlink_to(tmp_path / "elsewhere")
    found = failing(lambda: write_engine_input(tmp_path, "/RUN/a/1/\n"))
    message = "run_0001.rad is a symbolic link, and stemcal writes only to regular files"
    assert found == ("no_engine_input", message) and (tmp_path / "elsewhere").read_text("utf-8") == "kept"


def radioss(folder: Path, names: tuple[str, ...]) -> Path:
    """An installation with these files in its folder of programs."""
    (folder / "exec").mkdir(parents=True)
    (folder / "hm_cfg_files").mkdir()
    for name in names:
        (folder / "exec" / name).write_text("", encoding="utf-8")
        (folder / "exec" / name).chmod(0o755)
    return folder


PROGRAMS = (
    "starter_linux64_gf",
    "starter_linux64_gf_sp",
    "engine_linux64_gf",
    "engine_aaaa",
    "th_to_csv_b",
    "th_to_csv_a",
)


def test_programs_and_variables_of_an_installation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The shortest name of each program, of two the first in the alphabet; only what can be executed."""
    home = radioss(tmp_path / "radioss", PROGRAMS)
    (home / "exec" / "engine_a").write_text("", encoding="utf-8")
    monkeypatch.setenv("LD_LIBRARY_PATH", "/own/lib")
    options = DeckSolver(program="openradioss", home="radioss", environment={"OMP_NUM_THREADS": "4"})
    found = installation(options, tmp_path)
    names = [Path(program).name for program in (found.starter, found.engine, found.th_to_csv)]
    assert names == ["starter_linux64_gf", "engine_aaaa", "th_to_csv_a"]
    assert Path(found.starter).parent == home / "exec"
    libraries = [str(home / name) for name in ("exec", "extlib/hm_reader/linux64", "extlib/h3d/lib/linux64")]
    assert found.environment == {
        "OPENRADIOSS_PATH": str(home),
        "RAD_CFG_PATH": str(home / "hm_cfg_files"),
        "RAD_H3D_PATH": libraries[2],
        "OMP_STACKSIZE": "400m",
        "OMP_NUM_THREADS": "4",
        "LD_LIBRARY_PATH": ":".join([*libraries, "/own/lib"]),
    }
    monkeypatch.delenv("LD_LIBRARY_PATH")
    variable = DeckSolver(program="openradioss", environment={"OPENRADIOSS_PATH": str(home)})
    assert installation(variable, tmp_path).environment["LD_LIBRARY_PATH"] == ":".join(libraries)
    assert installation(variable, tmp_path).environment["OMP_NUM_THREADS"] == "1"
    (home / "exec" / "th_to_csv_a").unlink()
    (home / "exec" / "th_to_csv_b").chmod(0o644)
    with pytest.raises(UsageError) as caught:
        installation(options, tmp_path)
    assert str(caught.value) == f"solver.home: {home / 'exec'} does not contain th_to_csv; install the complete package"


def test_a_version_is_printed_by_the_starter(tmp_path: Path) -> None:
    starter = tmp_path / "starter"
    lines = ["OpenRadioss", "  CommitID : abc", "Date of build:  Aug  1 2026", "CommitID : abc", "Date of build :", "x"]
    starter.write_text("#!/bin/sh\n" + "".join(f"echo '{line}'\n" for line in lines), encoding="utf-8")
    starter.chmod(0o755)
    programs = openradioss._Installation(str(starter), "", "", {})
    assert openradioss._program_version(programs) == "CommitID : abc, Date of build: Aug 1 2026"
    missing = openradioss._Installation(str(tmp_path / "none"), "", "", {})
    assert openradioss._program_version(missing) == ""
