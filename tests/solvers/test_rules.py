"""The rules of the `solver` section: place, words and remedy of each wrong spec; the right one next to it has none."""

import json
from pathlib import Path

import pytest

from stemcal.errors import SpecError
from stemcal.solvers import rules
from stemcal.study.reading import load_study

MATERIAL = """\
material: {density: 1100 kg/m3, elastic_modulus: 1000 MPa, poisson_ratio: 0.3, tangent_modulus: 0.5 MPa,
  hardening_parameter: 0.05, strain_rate_c: 90 1/s, strain_rate_p: 8, failure_strain: 0.03}
factors: [{name: yield_stress, unit: MPa, low: 10, high: 20}]
"""
OWN = "factors: [{name: k, low: 1, high: 3}]\n"


def problems(folder: Path, solver: str, head: str = OWN, more: str = "") -> list[str]:
    """Return the problems of a spec as place, message and remedy."""
    spec = folder / "study.yaml"
    targets = "" if "targets:" in more else "targets: [{diameter: 8 mm, force: 100 N}]\n"
    spec.write_text(f"name: demo\n{head}solver: {solver}\n{targets}{more}\n", encoding="utf-8")
    try:
        load_study(spec)
    except SpecError as error:
        return [str(problem).split(": ", 1)[1] for problem in error.problems]
    return []


def command(more: str = "", result: str = "{file: o.csv, column: F}", argument: str = "{{k}}") -> str:
    words = json.dumps(["ccx", argument])
    return f"{{kind: command, command: {words}{f', result: {result}' if result else ''}{more}}}"


DECK = 'kind: deck, program: lsdyna, command: [ls-dyna, "i={{deck}}"]'
RESPONSES = """\
responses: [{name: y, unit: N}, {name: z, unit: mJ}]
conditions: [{name: size, unit: mm}]
targets: [{size: 8, y: 3, z: 4, sd: {y: 1, z: 1}}]
"""


@pytest.mark.parametrize(
    ("size", "stems", "found"),
    [
        ("4 mm", "8 mm", None),
        ("4.01 mm", "8 mm", "an element size of 4.01 mm is too large for a stem diameter of 8 mm; use about 1 mm"),
        ("d/2", "8 mm", None),
        ("0.008 mm", "8 mm", None),
        (
            "0.0079 mm",
            "8 mm",
            "an element size of 0.0079 mm is too small for a stem diameter of 8 mm (1.01e+03 elements); "
            "write d/16, or check the unit",
        ),
        (
            "0.007996 mm",
            "8 mm",
            "an element size of 0.007996 mm is too small for a stem diameter of 8 mm (1e+03 elements); "
            "write d/16, or check the unit",
        ),
        ("3 mm", "5 mm", "an element size of 3 mm is too large for a stem diameter of 5 mm; use about 0.62 mm"),
        (
            "0.0079 mm",
            "16 mm",
            "an element size of 0.0079 mm is too small for a stem diameter of 16 mm (2.03e+03 elements); "
            "write d/16, or check the unit",
        ),
    ],
)
def test_elements_fit_the_thinnest_and_the_thickest_stem(
    tmp_path: Path, size: str, stems: str, found: str | None
) -> None:
    targets = f"targets: [{{diameter: 8 mm, force: 100 N}}, {{diameter: {stems}, force: 90 N}}]\n"
    targets = targets if stems != "8 mm" else ""
    solver = f"{{kind: embedded, element_size: {size}}}"
    wrong = [line for line in problems(tmp_path, solver, MATERIAL, targets) if "element_size" in line]
    assert wrong == ([] if found is None else [f"solver.element_size: {found}"])


COMMANDS = [
    (command(), []),
    (command(result=""), ["solver: 'result' is missing; add a line `result: …`"]),
    (
        '{kind: command, command: ["{{k}}"], result: {file: o.csv, column: F}}',
        ["solver.command[1]: the program name cannot be a placeholder; write the name of the program"],
    ),
    (
        command(argument="{{kk}} {{k}}"),
        ["solver.command[2]: {{kk}} is not a factor; did you mean k?"],
    ),
    (
        command(argument="none"),
        [
            "factors.k.name: neither a template nor the command contains {{k}}; "
            "write this placeholder in a template or in the command"
        ],
    ),
    (
        command(argument="{{k}} {{seed}}"),
        ["solver.command[2]: {{seed}} is allowed only for a stochastic program; write `replicates: 1` under `solver`"],
    ),
    (command(", replicates: 1", argument="{{k}} {{seed}} {{replicate}}"), []),
    (command(argument="{{k}} {{diameter}}"), []),
    (
        command(", files: [o.csv]"),
        [
            "solver.files[1]: the result file has the same name; o.csv would be read if the program wrote no result; "
            "remove this file, or rename the result file"
        ],
    ),
    (
        command(", files: [O.CSV]"),
        [
            "solver.files[1]: the result file has the same name; O.CSV would be read if the program wrote no result; "
            "remove this file, or rename the result file"
        ],
    ),
    (
        command(", templates: [in.txt], files: [sub/IN.txt]"),
        ["solver.files[1]: another file in the run folder has the name IN.txt; rename one of the files"],
    ),
    (
        command(", files: [program-output.txt]"),
        ["solver.files[1]: another file in the run folder has the name program-output.txt; rename one of the files"],
    ),
    (command(", templates: [in.txt], files: [sub/other.txt]"), []),
    (
        command(result="{forces: {file: o.csv, column: F}}"),
        [
            "solver.result: no reader returns force; add force: {file: …}",
            "solver.result.forces: 'forces' is not a response of this study; did you mean force?",
        ],
    ),
]


@pytest.mark.parametrize(("solver", "found"), COMMANDS, ids=[str(number) for number in range(len(COMMANDS))])
def test_rules_of_a_command(tmp_path: Path, solver: str, found: list[str]) -> None:
    (tmp_path / "sub").mkdir()
    for name in ("o.csv", "O.CSV", "in.txt", "sub/IN.txt", "sub/other.txt", "program-output.txt"):
        (tmp_path / name).write_text("", encoding="utf-8")
    assert problems(tmp_path, solver) == found


def test_every_response_has_a_reader(tmp_path: Path) -> None:
    template = command(argument="{{k}} {{size}}")
    assert problems(tmp_path, template, more=RESPONSES) == [
        "solver.result: one reader cannot return 2 responses; write one reader for each response, such as "
        "`y: {file: …}` and `z: {file: …}`"
    ]
    one = command(argument="{{k}} {{size}}", result="{y: {file: o.csv, column: F}}")
    assert problems(tmp_path, one, more=RESPONSES) == ["solver.result: no reader returns z; add z: {file: …}"]
    both = "{y: {file: o.csv, column: F}, z: {file: o.csv, column: G}}"
    assert problems(tmp_path, command(argument="{{k}} {{size}}", result=both), more=RESPONSES) == []


def test_at_most_twenty_unknown_placeholders_are_listed(tmp_path: Path) -> None:
    lines = [f"{{{{unknown{number}}}}}" for number in range(30)]
    (tmp_path / "in.txt").write_text("{{k}}\n" + "\n".join(lines), encoding="utf-8")
    wrong = problems(tmp_path, command(", templates: [in.txt]"))
    assert len(wrong) == 20
    assert wrong[0].startswith("solver.templates[1]: in.txt:2: {{unknown0}} is not a factor")
    assert wrong[-1].startswith("solver.templates[1]: in.txt:21: {{unknown19}} is not a factor")
    (tmp_path / "in.txt").write_text(f"{{{{{'u' * 80}}}}}", encoding="utf-8")
    assert f"in.txt:1: {{{{{'u' * 60}}}}} is not a factor" in problems(tmp_path, command(", templates: [in.txt]"))[0]


DECKS = [
    (f"{{{DECK}}}", "", []),
    ('{kind: deck, program: lsdyna, command: [ls-dyna, "i={{deck}} {{dekc}}"]}', "",
     ["solver.command: unknown placeholder {{dekc}}; write i={{deck}}"]),
    ("{kind: deck, program: lsdyna, command: [ls-dyna, i=run.k]}", "",
     ['solver.command: the command does not contain the placeholder {{deck}}; add an argument "i={{deck}}"']),
    ('{kind: deck, program: lsdyna, command: ["{{deck}}"]}', "",
     ['solver.command: the command does not contain the placeholder {{deck}}; add an argument "i={{deck}}"']),
    ("{kind: deck, program: lsdyna}", "",
     ['solver: no command is specified for LS-DYNA; add `command: [ls-dyna, "i={{deck}}"]`']),
    ("{kind: deck, program: openradioss}", "", []),
    ("{kind: deck, program: openradioss, command: [x]}", "",
     ["solver.command: this key applies only to `program: lsdyna`; remove this key"]),
    (f"{{{DECK}, home: /opt}}", "", ["solver.home: this key applies only to `program: openradioss`; remove this key"]),
    (f"{{{DECK}}}", "loading: {until: severed}",
     ["loading.until: `until: severed` is not available in a deck; "
      "write `until: first_fracture`, or use `solver: {kind: embedded}`"]),
    (f"{{{DECK}}}", "blade: {sliding_angle: 10 deg}", []),
    (f"{{{DECK}}}", "supports: {kind: counter_edge, height: 2 cm, clearance: 1 mm}", []),
]  # fmt: skip


@pytest.mark.parametrize(("solver", "more", "found"), DECKS, ids=[str(number) for number in range(len(DECKS))])
def test_rules_of_a_deck(tmp_path: Path, solver: str, more: str, found: list[str]) -> None:
    assert problems(tmp_path, solver, MATERIAL, more) == found


@pytest.mark.parametrize(("program", "wrong"), [("openradioss", True), ("lsdyna", False)])
def test_hardening_is_no_factor_of_an_openradioss_deck(tmp_path: Path, program: str, wrong: bool) -> None:
    factor = "  - {name: hardening_parameter, low: 0, high: 0.1}\n"
    head = "\n".join(MATERIAL.replace("hardening_parameter: 0.05, ", "").splitlines()[:2])
    head += "\nfactors:\n  - {name: yield_stress, unit: MPa, low: 10, high: 20}\n" + factor
    solver = f"{{{DECK}}}" if program == "lsdyna" else "{kind: deck, program: openradioss}"
    found = problems(tmp_path, solver, head)
    assert len(found) == wrong and all(line.startswith("factors.hardening_parameter.name: the") for line in found)


CUT = "loading: {until: severed, stroke: %s}\n"
WHOLE = [
    ("{kind: embedded}", CUT % "3 mm", []),
    ("{kind: embedded}", CUT % "2.66 mm",
     ["loading.stroke: 2.66 mm of travel across the stem (2.66 mm) cannot cut through 8 mm; "
      "remove `stroke`; the stroke then is 1.5 times the diameter"]),
    ("{kind: embedded}", CUT % "2.67 mm", []),
    ("{kind: embedded, edge_over: elements}", CUT % "3 mm",
     ["solver.edge_over: `until: severed` requires a row of nodes under the edge, where the stem parts; "
      "write `edge_over: nodes`"]),
    ("{kind: embedded, edge_over: elements}", "", []),
    ("{kind: embedded, edge_over: elements}", "supports: {kind: clamped, height: 20 mm}\n",
     ["solver.edge_over: `supports.kind: clamped` requires a row of nodes under the edge; "
      "write `edge_over: nodes`"]),
    ("{kind: embedded}", CUT % "3 mm" + "blade: {bevel: one}\n",
     ["blade.bevel: the force of a whole cut with one bevel varies by up to 12 % with the position of the mesh; "
      "write `replicates: 4` under `solver`, or `bevel: both`"]),
    ("{kind: embedded, replicates: 4}", CUT % "3 mm" + "blade: {bevel: one}\n", []),
    ("{kind: embedded}", CUT % "3 mm" + "blade: {edge_spread: 0 mm}\n",
     ["blade.edge_spread: `until: severed` requires `edge_spread`; remove `edge_spread: 0 mm`"]),
    ("{kind: embedded}", CUT % "3 mm" + "blade: {sliding_angle: 40 deg}\n",
     ["loading.stroke: 2.3 mm of travel across the stem (3 mm at a sliding angle of 40 deg) cannot cut through 8 mm; "
      "remove `stroke`; the stroke then is 1.5 times the diameter"]),
]  # fmt: skip


@pytest.mark.parametrize(("solver", "more", "found"), WHOLE, ids=[str(number) for number in range(len(WHOLE))])
def test_rules_of_a_whole_cut(tmp_path: Path, solver: str, more: str, found: list[str]) -> None:
    assert problems(tmp_path, solver, MATERIAL, more) == found


def test_a_template_that_cannot_be_read_is_named_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def unreadable(_path: Path) -> bytes:
        raise OSError(13, "Permission denied")

    (tmp_path / "in.txt").write_text("{{k}}", encoding="utf-8")
    assert problems(tmp_path, command(", templates: [in.txt]", argument="none")) == []
    monkeypatch.setattr(rules, "template_bytes", unreadable)
    assert problems(tmp_path, command(", templates: [in.txt]", argument="none")) == [
        "solver.templates[1]: the template cannot be read: Permission denied; check the file"
    ]
