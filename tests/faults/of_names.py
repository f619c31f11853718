"""What attackers write: names that leave their folder, commands in templates, markup in names."""

from __future__ import annotations

import json
import random
import re
import sys
from pathlib import Path

import test_command
from of_specs import CONFIGS, SPECS
from tally import Fault, each

from stemcal import workflow
from stemcal.errors import SpecError
from stemcal.executors.inline import InlineExecutor
from stemcal.folder.study_folder import StudyFolder
from stemcal.study.reading import load_study, read_study

# ---- names and paths

LEAVING = (
    *(
        "../x",
        "..",
        "a/../../x",
        "/tmp/x",
        "\\\\server\\x",
        "C:\\x",
        "C:x",
        "x\0y",
        "x" * 300,
        "con",
        "NUL.txt",
        "a\nb",
    ),
    *("..\\x", "./../x", "~/../x", "x/", "\u2028", "aux.", " x", "x ", "a:b", "a*b", "<x>", "|x"),
)


def leaving_name(folder: Path, number: int, _rng: random.Random) -> None:
    """A study, a table, a template or a result with such a name is refused; nothing is written anywhere."""
    name = LEAVING[number // 4 % len(LEAVING)]
    where, shown = ("name", "table", "template", "result")[number % 4], json.dumps(name)
    inside = folder / "spec"
    try:
        if where == "name":
            study = read_study(
                SPECS["smoke.yaml"].replace(b"name: smoke", b"name: " + shown.encode()), inside / "a.yaml"
            )
            assert re.fullmatch(r"[^/\\:*?\"<>|\0\n]{1,64}", study.name) and study.name not in ("..", "."), study.name
        elif where == "table":
            text = SPECS["paper-replay.yaml"].replace(b"data/paper-forces.csv", shown.encode())
            read_study(text, inside / "a.yaml")
            raise AssertionError(f"the table {name!r} was taken")
        elif where == "template":
            test_command.study_of(inside, command=json.dumps([sys.executable]), template="{{stiffness}} {{width}}")
            text = (inside / "study.yaml").read_text(encoding="utf-8").replace("[input.txt]", f"[{shown}]")
            read_study(text.encode(), inside / "study.yaml")
            raise AssertionError(f"the template {name!r} was taken")
        else:
            result = f"{{file: {shown}, path: out}}"
            study = test_command.study_of(inside, result=result)
            file = study.solver.result.file  # type: ignore[union-attr]
            assert (folder / "run" / file).resolve().is_relative_to((folder / "run").resolve()), file
    except SpecError as refused:
        assert refused.problems
    written = {path.name for path in folder.rglob("*") if path.is_file()}
    assert written <= {"study.yaml", "input.txt", "program.py"}, f"{where} {name!r} wrote {written}"


def injected(folder: Path, number: int, rng: random.Random) -> None:
    """Commands hidden in templates and arguments: written or passed as they are, never carried out."""
    canary = folder / "canary"
    hidden = (
        f"$(touch {canary})",
        f"`touch {canary}`",
        f"; touch {canary};",
        f"| touch {canary}",
        f"&& touch {canary}",
        f"\n touch {canary}\n",
        f"{{% import os %}}{{%- os.system('touch {canary}') %}}",
        f"${{touch {canary}}}",
        f"%(touch {canary})s",
        f"__import__('os').system('touch {canary}')",
        f"!!python/object/apply:os.system ['touch {canary}']",
        f"{{0.__class__}} {{}} %s > {canary}",
    )
    word = "".join(rng.sample(hidden, rng.randint(1, 3)))
    program = (
        "import json, sys\n"
        "json.dump({'out': [len(open('input.txt', newline='').read()), len(sys.argv[1])]}, open('out.json', 'w'))"
    )
    template = f"{{{{stiffness}}}}{{{{width}}}}{word}"
    command = json.dumps([sys.executable, "program.py", word if number % 2 else word.replace("\n", " ")])
    answer = test_command.solved(
        folder,
        program,
        template=template,
        command=command,
        result="{file: out.json, path: out, reduction: first}",
    )
    assert answer.ok, answer.message
    assert answer.response == len("1.510.0") + len(word), "the template is not what was written"
    assert not canary.exists(), f"carried out: {word!r}"


# ---- markup


def markup(folder: Path, number: int, rng: random.Random) -> None:
    """Hostile text in titles, labels, symbols, stage files and notes: escaped in the report."""
    from stemcal.report.page.render import render

    hostile = rng.choice(
        [
            "<script>alert(1)</script>",
            '"><img src=x onerror=alert(1)>',
            "</title><script>alert(1)</script>",
            "'--><svg/onload=alert(1)>",
            "</style><iframe src=javascript:alert(1)>",
            "{{ 7*7 }}<script>",
        ]
    )
    study = load_study(CONFIGS / "paper-replay.yaml")
    found = StudyFolder(folder / "out")
    workflow.calibrate(study, found, InlineExecutor())
    for name in ("screen", "rsm", "validate"):
        stage = found.read_stage(name)
        if name != "validate":
            stage["notes"].append({"kind": hostile, "severity": "warning", "text": hostile, "remedy": None})
        text = json.dumps(stage)
        if number % 2 and name == "screen":
            text = text.replace('"density"', json.dumps(hostile)).replace("X1", json.dumps(hostile)[1:-1])
        (found.path / f"{name}.json").write_text(text, encoding="utf-8")
    page = render(study.model_copy(update={"title": hostile, "warnings": (hostile,)}), found)
    for tag in ("<script", "<img src=x", "<iframe", "<svg/onload", "onerror=alert(1)>"):
        assert tag not in page, f"{tag} stands in the report"


FAULTS = (
    Fault(
        "names that leave their folder",
        "`../`, absolute, NUL, 300 letters, reserved on Windows: as study, table, template, result",
        "refused; nothing written",
        each(leaving_name),
        24,
        96,
    ),
    Fault(
        "commands hidden in templates and arguments",
        "twelve ways of shells and template languages, mixed",
        "passed on letter by letter; the canary file is never made",
        each(injected),
        3,
        60,
    ),
    Fault(
        "markup in names",
        "six kinds in title, warnings, notes, factor names and symbols",
        "escaped in the report",
        each(markup),
        1,
        10,
    ),
)
