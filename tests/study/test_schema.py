from __future__ import annotations

import json
import re

from stemcal.study.model import StudyForm
from stemcal.study.schema import json_schema, keys_of, section_with


def test_schema_describes_the_yaml_form() -> None:
    schema = json_schema()
    assert json.loads(json.dumps(schema)) == schema
    assert list(schema["properties"]) == list(StudyForm.model_fields)
    assert sorted(schema["required"]) == ["factors", "name", "targets"]
    length = schema["$defs"]["Blade"]["properties"]["length"]
    assert length["type"] == "string"
    assert re.match(length["pattern"], "90 mm") and not re.match(length["pattern"], "90 N")


def test_keys_are_found_by_path() -> None:
    assert keys_of(("targets", "forces", 3)) == ("diameter", "force", "sd", "n")
    assert keys_of(("solver", "table")) == ("kind", "screen", "rsm", "validate")
    assert keys_of(("solver", "embedded", "hourglass")) == ("form", "coefficient")
    assert keys_of(("rsm", "coding", "any")) == ("center", "half_step")
    assert keys_of(("published",))[0] == "screening"
    assert keys_of(("nowhere", "at", "all")) == ()


def test_the_section_of_a_key_is_known_if_it_is_one() -> None:
    assert section_with("clearance") == "supports"
    assert section_with("mass_scaling") == "solver"
    assert section_with("length") is None
