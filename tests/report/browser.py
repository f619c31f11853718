"""Looks at a page as a reader does: in a real Chromium, wide and narrow, light and dark, and printed.

    python tests/report/browser.py report.html [--shots FOLDER]

prints what it finds wrong and leaves with 1 if that is anything. Needs `pip install playwright` and a Chromium, found
on the PATH or named in STEMCAL_CHROMIUM; the accessibility check needs the file axe.min.js of the npm package
axe-core, named in STEMCAL_AXE, and is left out without it.
"""

import argparse
import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

WIDTHS = (390, 1440)
SCHEMES = ("light", "dark")
NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome", "msedge")
# Elements that stick out of the window, unless an ancestor scrolls them in a box of its own.
STICKING_OUT = """() => [...document.querySelectorAll('body *')].filter(e => {
  if (e.closest('.scroll') && !e.matches('.scroll')) return false;
  if (e.closest('svg') && e.tagName !== 'svg') return false;
  return e.getBoundingClientRect().right > innerWidth + 1;
}).map(e => e.tagName + '.' + e.className).slice(0, 5)"""


def chromium() -> str | None:
    """Return the program of a Chromium, None if there is none."""
    named = os.environ.get("STEMCAL_CHROMIUM")
    return named or next((found for name in NAMES if (found := shutil.which(name))), None)


def axe() -> str | None:
    """Return the script of axe-core, None if it is not named."""
    path = os.environ.get("STEMCAL_AXE")
    return Path(path).read_text("utf-8") if path else None


def faults(page: Path, shots: Path | None = None) -> list[str]:
    """Return everything that is wrong with a page, a sentence each."""
    from playwright.sync_api import sync_playwright

    found: list[str] = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium(), args=["--no-sandbox"])
        for width in WIDTHS:
            for scheme in SCHEMES:
                with _opened(browser, page, width, scheme, found) as view:
                    found += [f"{width} px {scheme}: {fault}" for fault in _looked_at(view)]
                    if shots:
                        view.screenshot(path=shots / f"{page.stem}-{width}-{scheme}.png", full_page=True)
        with _opened(browser, page, 1440, "light", found) as view:
            found += _printed(view, shots / f"{page.stem}.pdf" if shots else None)
        browser.close()
    return found


@contextmanager
def _opened(browser: Any, page: Path, width: int, scheme: str, found: list[str]) -> Iterator[Any]:
    """Open the page and note every message, error and request on the way."""
    context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
    view, address = context.new_page(), page.resolve().as_uri()
    view.on("console", lambda message: found.append(f"console {message.type}: {message.text}"))
    view.on("pageerror", lambda error: found.append(f"error: {error}"))
    view.on("request", lambda request: request.url == address or found.append(f"request: {request.url[:100]}"))
    view.goto(address)
    yield view
    context.close()


def _looked_at(view: Any) -> list[str]:
    wider = view.evaluate("document.documentElement.scrollWidth - innerWidth")
    found = [f"the page is {wider} px too wide"] if wider > 0 else []
    found += [f"{element} sticks out" for element in view.evaluate(STICKING_OUT)]
    return found + _unreadable(view)


def _unreadable(view: Any) -> list[str]:
    """Return what axe-core calls serious or critical."""
    script = axe()
    if script is None:
        return []
    view.evaluate(script)
    result = view.evaluate("axe.run(document, {resultTypes: ['violations']})")
    return [
        f"axe {finding['impact']} {finding['id']}: {finding['help']} ({finding['nodes'][0]['html'][:90]})"
        for finding in result["violations"]
        if finding["impact"] in ("serious", "critical")
    ]


def _printed(view: Any, path: Path | None) -> list[str]:
    """Return what a printed A4 page cuts off: at 180 mm between the margins, nothing may stick out."""
    view.emulate_media(media="print")
    view.set_viewport_size({"width": 680, "height": 962})
    view.pdf(format="A4", path=path, margin=dict.fromkeys(("top", "bottom", "left", "right"), "15mm"))
    cut = view.evaluate(
        "[...document.querySelectorAll('table, svg')].filter(e => e.getBoundingClientRect().right > innerWidth + 1)"
        ".map(e => e.tagName + ' ' + (e.closest('.sheet, figure')?.innerText ?? '').slice(0, 40))"
    )
    return [f"print: {element} is cut off" for element in cut]


def main() -> int:
    """Look at the page named on the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("page", type=Path)
    parser.add_argument("--shots", type=Path, help="folder for screenshots")
    chosen = parser.parse_args()
    if chosen.shots:
        chosen.shots.mkdir(parents=True, exist_ok=True)
    found = faults(chosen.page, chosen.shots)
    sys.stdout.write("\n".join([*found, f"{len(found)} faults" + ("" if axe() else "; STEMCAL_AXE not set")]) + "\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
