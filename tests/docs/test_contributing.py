"""`git commit` works after the steps of CONTRIBUTING.md, without an activated environment."""

import os
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]
(REPOSITORY,) = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text("utf-8"))["repos"]


@pytest.mark.skipif(os.name == "nt", reason="the tool of this test is a shell script")
@pytest.mark.parametrize("hook", REPOSITORY["hooks"], ids=lambda hook: hook["id"])
def test_each_hook_runs_the_tool_of_the_environment_without_activation(hook: dict[str, str], tmp_path: Path) -> None:
    (tmp_path / ".ci").mkdir()
    shutil.copy(ROOT / ".ci/tool", tmp_path / ".ci")
    (programs := tmp_path / ".venv/bin").mkdir(parents=True)
    name = shlex.split(hook["entry"])[2]  # after `sh .ci/tool`
    (programs / name).write_text('#!/bin/sh\necho "$0" "$@"\n', encoding="utf-8")
    (programs / name).chmod(0o755)
    command = [*shlex.split(hook["entry"]), "a file.py"]
    done = subprocess.run(command, cwd=tmp_path, env={"PATH": os.defpath}, capture_output=True, text=True, check=True)
    assert done.stdout.startswith(str(programs / name))
    assert done.stdout.endswith("a file.py\n")
