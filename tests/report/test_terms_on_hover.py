"""Every term of the glossary in headings, labels and notes of the page has its meaning on hover, in a real Chromium."""

import os
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from stemcal.report.glossary import glossary
from stemcal.report.page.page import page_content, render

CHROMIUM = os.environ.get("STEMCAL_CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")
BLOCKS = ("h2", "h3", "th", "dt", "p", "li", "figcaption")
SKIPPED = ("a", "button", "code", "script", "style", "svg", "nav", "header")


class Blocks(HTMLParser):
    """Collects the text and the hovers of each block within `main`."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[tuple[list[str], set[str]]] = []
        self.path: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag in ("meta", "link", "img", "br", "input", "hr"):
            return
        self.path.append(tag)
        if tag in BLOCKS:
            self.found.append(([], set()))
        if self.found and (title := dict(attrs).get("title")):
            self.found[-1][1].add(title)

    def handle_endtag(self, tag: str) -> None:
        while self.path and self.path.pop() != tag:
            pass

    def handle_data(self, data: str) -> None:
        if "main" in self.path and not {*SKIPPED} & {*self.path} and {*BLOCKS} & {*self.path}:
            self.found[-1][0].append(data)


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on the PATH or in STEMCAL_CHROMIUM")
def test_terms_of_the_page_are_explained(replayed: tuple[Any, Any], tmp_path: Path) -> None:
    (tmp_path / "report.html").write_text(render(page_content(*replayed)), "utf-8")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=9000", "--dump-dom"]
    place = (tmp_path / "report.html").as_uri()
    done = subprocess.run([str(CHROMIUM), *options, place], capture_output=True, text=True, timeout=120, check=True)
    parser = Blocks()
    parser.feed(done.stdout)
    meanings = {
        name.lower().replace("_", " "): one.meaning.replace("`", "") for one in glossary() for name in one.names[::-1]
    }
    names = sorted((re.escape(name) for name in meanings if len(name) > 3), key=len, reverse=True)
    terms = re.compile(rf"(?<!\w)(?:{'|'.join(names)})(?=s?(?!\w))", re.IGNORECASE)
    used = [(terms.findall("".join(text)), titles) for text, titles in parser.found]
    missing = [
        ("".join(text), name)
        for (text, titles), (found, _) in zip(parser.found, used, strict=True)
        for name in found
        if meanings[name.lower()] not in titles
    ]
    assert missing == []
    assert sum(len(found) for found, _ in used) > 150
    assert {meanings["f"], meanings["df"]} <= {title for _, titles in used for title in titles}
