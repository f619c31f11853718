"""The profiler of the fitted surfaces: its script and style, on the page and by itself for a notebook."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Mapping
from hashlib import sha256
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment


def environment() -> Environment:
    """Return the templates of the page."""
    from jinja2 import Environment, PackageLoader

    return Environment(
        loader=PackageLoader("stemcal.report.page", "."), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )


def part(name: str) -> str:
    """Return the style or the script of the page, without indentation and comments of whole lines."""
    return re.sub(r"(?m)^(\s+|//.*\n)", "", Path(__file__).with_name(name).read_text("utf-8"))


def policy(css: str, script: str) -> str:
    """Return what the page may use: this style, this script and pictures within it."""
    style, script = (f"'sha256-{b64encode(sha256(text.encode()).digest()).decode()}'" for text in (css, script))
    return (
        f"default-src 'none'; style-src {style}; script-src {script}; img-src data:; base-uri 'none'; "
        "form-action 'none'"
    )


def alone(data: Mapping[str, Any]) -> str:
    """Return a page with nothing but the profiler."""
    css, script = part("page.css"), part("page.js")
    page = environment().get_template("notebook.html")
    return page.render(css=css, script=script, policy=policy(css, script), profiler=data)


def for_notebook(data: Mapping[str, Any]) -> str:
    """Return the profiler for a notebook: a page in a frame, which shares no names, styles or scripts with it."""
    high = 500 + 270 * len(data["factors"])
    return (
        f'<iframe srcdoc="{escape(alone(data))}" title="Profiler" width="100%" height="{high}" '
        'sandbox="allow-scripts" allow="clipboard-write" style="border:0"></iframe>'
    )
