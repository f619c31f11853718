"""The Chinese README has the commands, links and numbers of the English one."""

import re
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[2]
ENGLISH, CHINESE = ((ROOT / name).read_text(encoding="utf-8") for name in ("README.md", "README.zh-CN.md"))


def blocks(text: str) -> list[str]:
    return re.findall(r"^```.*?^```", text, re.MULTILINE | re.DOTALL)


def prose(text: str) -> str:
    """Return a page without its blocks and without the line that leads to the other language."""
    text = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    return "\n".join(line for line in text.splitlines() if not re.fullmatch(r"\[\S+\]\(README\S*\)", line))


def test_blocks_of_commands_and_output_are_the_same() -> None:
    assert blocks(CHINESE) == blocks(ENGLISH) and len(blocks(ENGLISH)) > 4


def test_codes_links_and_numbers_are_the_same() -> None:
    for pattern in (r"`[^`]+`", r"\]\(([^)]+)\)", r"\d+(?:\.\d+)?"):
        assert Counter(re.findall(pattern, prose(CHINESE))) == Counter(re.findall(pattern, prose(ENGLISH))), pattern


def test_each_leads_to_the_other() -> None:
    assert "(README.zh-CN.md)" in ENGLISH and "(README.md)" in CHINESE
