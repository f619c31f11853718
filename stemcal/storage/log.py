"""The log of a study, ``log.jsonl``: a line of JSON for each event."""

import json
import logging
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from stemcal.errors import StemcalError
from stemcal.storage.atomic import refuse_link
from stemcal.storage.canonical import jsonable

logger = logging.getLogger(__name__)


def append(path: Path, event: str, facts: Mapping[str, Any]) -> None:
    """Append an event with its facts and the time; if the file cannot be written, log a warning instead of failing."""
    line = json.dumps({"time": now(), "event": event, **jsonable(facts)}, ensure_ascii=False, allow_nan=False)
    try:
        refuse_link(path)
        with path.open("ab") as file:
            file.write(f"{line}\n".encode("utf-8", "backslashreplace"))
    except (OSError, StemcalError) as error:
        logger.warning("log.jsonl: %s", error)


def now() -> str:
    """Return the present time, UTC, in ISO 8601."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")
