"""Merge the edit of a remedy into a spec, as a user would."""

from pathlib import Path
from typing import Any

import yaml

from stemcal.stages.verdict.result import Verdict
from stemcal.study.reading.read import read_study


def merged(spec: str, edit: str | None) -> str:
    """Return a spec with a YAML fragment merged into it; items of lists are matched by ``name``."""
    assert edit is not None, "the remedy has no edit"
    return yaml.safe_dump(_merge(yaml.safe_load(spec), yaml.safe_load(edit)), sort_keys=False, allow_unicode=True)


def accepted(spec: str, verdict: Verdict, path: Path) -> None:
    """Merge each edit of a verdict into the spec at `path`: the reader must accept what it advises."""
    for reason in verdict.reasons:
        if reason.remedy is not None and reason.remedy.edit is not None:
            read_study(merged(spec, reason.remedy.edit).encode(), path)


def _merge(old: Any, new: Any) -> Any:
    if isinstance(old, dict) and isinstance(new, dict):
        return old | {key: _merge(old.get(key), value) for key, value in new.items()}
    if isinstance(old, list) and isinstance(new, list) and all(isinstance(item, dict) for item in new):
        items = {item["name"]: item for item in new}
        known = [_merge(item, items.pop(item.get("name"), {})) for item in old]
        return [*known, *items.values()]
    return new
