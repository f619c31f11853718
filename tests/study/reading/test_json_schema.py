import json
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from stemcal.study.model.study import StudyForm
from stemcal.study.reading.json_schema import json_schema, keys_of, meanings, section_places, section_with
from stemcal.study.types.strict_yaml import read_yaml

ROOT = Path(__file__).parents[3]
SPECS = [*sorted((ROOT / "configs").glob("*.yaml")), *sorted((ROOT / "tests" / "cases" / "good").glob("*.yaml"))]


def test_schema_describes_the_yaml_form() -> None:
    schema = json_schema()
    assert json.loads(json.dumps(schema)) == schema
    assert list(schema["properties"]) == [
        str(field.validation_alias or name) for name, field in StudyForm.model_fields.items()
    ]
    assert sorted(schema["required"]) == ["factors", "name"]  # and either `targets` or `goal`
    assert schema["anyOf"] == [{"required": ["targets"]}, {"required": ["goal"]}]
    assert schema["$defs"]["BladeSection"]["properties"]["width"]["type"] == "string"


def test_no_key_is_undescribed() -> None:
    """Every key says what it means, each in its field, and every section of the model has a place in the spec."""
    schema = json_schema()
    sections = {"": schema, **schema["$defs"]}
    described = {f"{name}.{key}": node["description"] for name, section in sections.items()
                 for key, node in section["properties"].items()}  # fmt: skip
    # one that several kinds have counts once, and so does one that a layer has as `material`
    places = {place.partition(",")[0].replace("layers[]", "material") for place in meanings()}
    assert len(places) <= 173
    assert [key for key, meaning in described.items() if not meaning.endswith(".")] == []
    assert set(section_places()) == set(schema["$defs"])


def test_a_key_has_its_meaning() -> None:
    found = meanings()["screen.alpha"], meanings()["solver.files, kind: command"]
    significance = "Significance level. Factors with a smaller p-value are significant."
    assert found == (significance, "Files that are copied to each run folder.")


def test_sections_have_places() -> None:
    places = section_places()
    assert places["Factor"] == "factors[]"
    assert places["TargetRow"] == "targets[]"
    assert places["Growth"] == "material.*"  # also in `specimen` and in layers
    assert places["ResultReader"] == "solver.result, kind: command"


def test_keys_are_found_by_path() -> None:
    whole_cut = ("cutting_energy", "first_fracture_force", "first_fracture_travel")
    responses = ("force", "travel", "work", *whole_cut, "slope")
    assert keys_of(("targets", 3)) == ("test", "diameter", *responses, "sd", "n", "curves")
    assert keys_of(("solver", "sheet"))[:3] == ("kind", "file", "templates")
    assert keys_of(("nowhere", "at", "all")) == ()


def test_the_section_of_a_key_is_known_if_it_is_one() -> None:
    assert section_with("clearance") == "supports"
    assert section_with("mass_scaling") == "solver"
    assert section_with("design") is None


@cache
def validator() -> Any:
    """Return a validator of JSON schemas, such as an editor has."""
    draft, schema = pytest.importorskip("jsonschema").Draft202012Validator, json_schema()
    draft.check_schema(schema)
    return draft(schema)


def complaints(data: object) -> list[str]:
    return [f"{list(error.absolute_path)}: {error.message}" for error in validator().iter_errors(data)]


@pytest.mark.parametrize("spec", SPECS, ids=lambda path: path.stem)
def test_every_shipped_spec_satisfies_the_schema(spec: Path) -> None:
    assert complaints(read_yaml(spec.read_bytes()).data) == []


def test_what_init_writes_satisfies_the_schema() -> None:
    from stemcal.cli.spec import spec_text

    for full in (False, True):
        assert complaints(read_yaml(spec_text("mine", full).encode("utf-8")).data) == []


@pytest.mark.parametrize(
    ("section", "value"),
    [
        ("blade", {"width": 28}),
        ("blade", {"widht": "28 mm"}),  # codespell:ignore widht
        ("solver", {"kind": "abaqus"}),
        ("factors", []),
        ("refine", {"budget": "many"}),
    ],
)
def test_what_is_wrong_is_underlined(section: str, value: object) -> None:
    spec = read_yaml((ROOT / "configs" / "smoke.yaml").read_bytes()).data
    assert complaints({**spec, section: value})
