"""Values as YAML that the strict reader reads back as the same: what comes from outside is data, whatever it holds."""

from typing import Any

import yaml

from stemcal.files.showing import unprintable
from stemcal.study.types.strict_yaml import resolve


class _Emitter(yaml.SafeDumper):
    """Block style, keys in their order; texts that could be read as something else, or not be read, in quotes."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _text(emitter: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    quoted = not isinstance(resolve(text), str) or unprintable(text) is not None
    return emitter.represent_scalar("tag:yaml.org,2002:str", text, style='"' if quoted else None)


_Emitter.add_representer(str, _text)


def yaml_text(data: Any) -> str:
    r"""Return mappings, lists, texts, numbers, booleans and None as YAML.

    >>> print(yaml_text({"name": "a\nsolver: {kind: lsdyna}", "low": 0.5, "units": ["mm", "1e9"]}), end="")
    name: "a\nsolver: {kind: lsdyna}"
    low: 0.5
    units:
    - mm
    - "1e9"
    """
    return yaml.dump(
        data, Dumper=_Emitter, sort_keys=False, default_flow_style=False, allow_unicode=True, width=float("inf")
    )
