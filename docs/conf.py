"""How the documentation is built: `python -m sphinx -W docs docs/_build`."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

import generated  # noqa: E402

from stemcal import __version__  # noqa: E402

project = "stemcal"
author = "The stemcal developers"
project_copyright = author
release = version = __version__
extensions = ["myst_nb", "mathml"]
nb_execution_timeout = 300
nb_execution_raise_on_error = True
nb_execution_show_tb = True
nb_ipywidgets_js: dict[str, dict[str, str]] = {}  # no page asks for anything from elsewhere
html_math_renderer = "mathml"
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3
html_theme = "furo"
html_title = "stemcal"
exclude_patterns = ["_build"]
suppress_warnings = ["myst.header"]
html_static_path = ["static"]
html_css_files = ["pages.css"]
html_show_sourcelink = False

generated.write(HERE / "reference")
