"""The files of config/ and envs/ say what the models and pyproject say."""

import difflib
import re
import tomllib
from pathlib import Path

import jsonschema
import pytest
import yaml

from surgisim.config.whole import ON_REQUEST, PARENTS, Whole, files, group, schemas

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", list(files()))
def test_generated_files_are_up_to_date(name):
    written, wanted = (ROOT / "config" / name).read_text(), files()[name]
    diff = "\n".join(
        difflib.unified_diff(written.splitlines(), wanted.splitlines(), "committed", "models", lineterm="")
    )
    assert not diff, f"config/{name} is out of date; run `make config`.\n{diff}"


def test_the_written_defaults_are_the_models_defaults():
    assert Whole.model_validate(yaml.safe_load((ROOT / "config" / "config.yaml").read_text())) == Whole()


def test_the_schemas_accept_the_project_and_refuse_what_is_extra():
    made = schemas()
    config = yaml.safe_load((ROOT / "config" / "config.yaml").read_text())
    jsonschema.validate(config, made["config.schema.json"])
    jsonschema.validate(yaml.safe_load((ROOT / "config" / "variants.yaml").read_text()), made["variants.schema.json"])
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({"ingest": {"sise": 3}}, made["config.schema.json"])


@pytest.mark.parametrize("path", sorted((ROOT / "config" / "protocols").glob("*.yaml")), ids=lambda path: path.stem)
def test_protocols_are_settings_that_differ_from_the_defaults(path):
    changes = yaml.safe_load(path.read_text())
    assert Whole.model_validate(changes) != Whole()
    for stage, settings in changes.items():
        same = [key for key, value in settings.items() if value == group(stage).model_fields[key].default]
        assert not same, f"{stage}: {same} are the defaults"


def test_no_schema_object_allows_extra_keys():
    def objects(node):
        if isinstance(node, dict):
            if "properties" in node:
                yield node
            for part in node.values():
                yield from objects(part)
        elif isinstance(node, list):
            for part in node:
                yield from objects(part)

    for schema in schemas().values():
        assert all(found["additionalProperties"] is False for found in objects(schema))


@pytest.mark.parametrize("stage", [*PARENTS, *ON_REQUEST])
def test_every_setting_says_what_it_is_and_ends_in_its_unit(stage):
    for name, field in group(stage).model_fields.items():
        assert re.search(r"\[[^\]]+\]\.?$", field.description or ""), f"{stage}.{name}: {field.description}"


def test_the_lock_names_no_host_and_no_cuda():
    lock = (ROOT / "requirements.txt").read_text()
    assert "://" not in lock
    assert not re.search(r"^(torch|triton|nvidia|cuda)\b", lock, re.MULTILINE)
    pinned = re.findall(r"^([a-z0-9-]+)==", lock, re.MULTILINE)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = {*project["dependencies"], *project["optional-dependencies"]["develop"]}
    assert {re.split(r"[><=]", name)[0] for name in wanted} - {"torch"} <= set(pinned)
