"""The files that a Python file imports, found without running them."""

from pathlib import Path

import pytest

from stemcal.solvers.imported import imported_files

FILES = {
    "alone.py": "",
    "plain.py": "import alone",
    "two.py": "import alone, plain as p",
    "deep/__init__.py": "",
    "deep/inner/__init__.py": "from . import leaf",
    "deep/inner/leaf.py": "",
    "deep/inner/up.py": "from ..sister import value",
    "deep/sister.py": "value = 1",
    "ring.py": "import ring_2",
    "ring_2.py": "import ring",
    "broken.py": "import alone\ndef (",
    "compiled.cpython-312-x86_64-linux-gnu.so": "",
    "windows.pyd": "",
    "data.txt": "import alone",
}
LINES = {
    "import plain": ["alone.py", "plain.py"],
    "import two": ["alone.py", "plain.py", "two.py"],
    "def solve():\n    from plain import x": ["alone.py", "plain.py"],
    "import deep": ["deep/__init__.py"],
    "import deep.sister": ["deep/__init__.py", "deep/sister.py"],
    "from deep import sister": ["deep/__init__.py", "deep/sister.py"],
    "from .deep import sister": ["deep/__init__.py", "deep/sister.py"],
    "from . import alone": ["alone.py"],
    "from deep import inner": ["deep/__init__.py", "deep/inner/__init__.py", "deep/inner/leaf.py"],
    "import deep.inner.up": [
        *("deep/__init__.py", "deep/inner/__init__.py", "deep/inner/leaf.py", "deep/inner/up.py", "deep/sister.py"),
    ],
    "import ring": ["ring.py", "ring_2.py"],
    "import broken": ["broken.py"],
    "import compiled": ["compiled.cpython-312-x86_64-linux-gnu.so"],
    "import windows": ["windows.pyd"],
    "import importlib\nimportlib.import_module('plain')": ["alone.py", "plain.py"],
    "from importlib import import_module\nimport_module('.deep', 'x')": ["deep/__init__.py"],
    "__import__('alone')": ["alone.py"],
    "__import__(name)": [],
    "__import__(5)": [],
    "__import__()": [],
    "print('alone')": [],
    "import data, nowhere, json": [],
    "x = (": [],
    "x = '\0'": [],
}


@pytest.mark.parametrize("code", LINES, ids=[code.replace("\0", "0") for code in LINES])
def test_files_that_a_line_imports(tmp_path: Path, code: str) -> None:
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "main.py").write_text(code, encoding="utf-8")
    found = imported_files(tmp_path / "main.py", [tmp_path])
    assert [path.relative_to(tmp_path).as_posix() for path in found] == LINES[code]


def test_only_python_files_import_and_every_root_is_searched(tmp_path: Path) -> None:
    """The same name below two roots: both files count, since either may be the one that Python loads."""
    for name, text in {"a/law.py": "", "b/law.py": "", "b/main.txt": "import law", "a/main.py": "import law"}.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    roots = [tmp_path / "a", tmp_path / "b"]
    assert imported_files(tmp_path / "b" / "main.txt", roots) == []
    assert imported_files(tmp_path / "a" / "main.py", roots) == [tmp_path / "a" / "law.py", tmp_path / "b" / "law.py"]
    (tmp_path / "a" / "main.py").write_text("from .law import x", encoding="utf-8")
    assert imported_files(tmp_path / "a" / "main.py", roots) == [tmp_path / "a" / "law.py"]
    assert imported_files(tmp_path / "nowhere.py", roots) == []
