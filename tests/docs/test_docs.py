"""The documentation builds without a warning, and what is made from the code is up to date."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from shown import DOCS, GENERATED, ROOT, pages


def test_reference_pages_are_up_to_date() -> None:
    sys.path.insert(0, str(DOCS))
    try:
        import generated
    finally:
        sys.path.remove(str(DOCS))
    text = generated.commands()
    for name in ("run", "measure shear", "export tables", "export figures"):
        assert f"## stemcal {name}\n" in text
    assert "`--work`" in text
    spec = generated.spec()
    assert "| `edge_radius` | Radius of the edge; 0 mm for a sharp edge. | quantity such as `1 mm` | `0.1` |" in spec
    assert "(spec-blade)=\n## blade\n" in spec and "section [blade](#spec-blade)" in spec
    assert "| PRESS |" in generated.glossary()


def test_every_link_to_a_file_leads_to_one_that_a_checkout_has() -> None:
    dead = [
        f"{page.relative_to(ROOT)}: {target}"
        for page in (ROOT / "CONTRIBUTING.md", *pages())
        for target in re.findall(r"\]\((?!https?://|#)([^)#\s]+)", page.read_text("utf-8"))
        if (path := (page.parent / target).resolve()) in GENERATED or not path.exists()
    ]
    assert not dead


def test_pages_begin_with_their_reader() -> None:
    """The first paragraph names the reader."""
    for page in sorted(set(DOCS.rglob("*.md")) - GENERATED - set((DOCS / "_build").rglob("*.md"))):
        text = page.read_text("utf-8")
        _, _, first = text.partition("\n# ") if not text.startswith("# ") else ("", "", text)
        opening = first.split("\n\n")[1]
        assert re.match(r"(This page .*\bfor |For .*\bthis page )", opening, re.DOTALL), page.name


@pytest.mark.slow
def test_the_pages_build_without_a_warning(tmp_path: Path) -> None:
    """Equations are drawn as MathML and no page asks for anything from elsewhere."""
    for needed in ("sphinx", "furo", "myst_nb"):
        pytest.importorskip(needed, reason='the pages need pip install "stemcal[docs]"')
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", str(DOCS), str(tmp_path)]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=300, env={**os.environ, "PYTHONPATH": str(ROOT)}
    )
    assert done.returncode == 0, done.stderr
    pages = {path.relative_to(tmp_path).as_posix(): path.read_text("utf-8") for path in tmp_path.rglob("*.html")}
    assert "stemcal measure shear" in pages["reference/commands.html"]
    assert "effects[].lenth_t" in pages["reference/stages.html"]
    assert "the target is out of reach" in pages["reference/files.html"]
    for name in ("explanation/solver.html", "explanation/screening.html", "explanation/calibration.html"):
        assert pages[name].count('<div class="equation"><math') >= 2
    notebook = pages["notebook.html"]
    assert notebook.count('src="data:image/png;base64') + notebook.count("_images/") >= 3
    assert re.search(r"point\.solution=\{(&#x27;|')yield_stress\1: \d", notebook) and "Traceback" not in notebook
    asking = [name for name, text in pages.items() if 'src="http' in text or "cdn." in text]
    assert not asking
