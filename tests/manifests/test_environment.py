"""The list of what is installed is read by CycloneDX tools, the same each time, and silent about the machine."""

import importlib.metadata
import json
import sys

import pytest
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
from packageurl import PackageURL
from packaging.utils import canonicalize_name

from manifests.environment import environment_bom
from manifests.provenance import SOURCE_ROOT


@pytest.fixture
def anew():
    environment_bom.cache_clear()
    yield
    environment_bom.cache_clear()


def test_the_list_keeps_to_the_schema_of_cyclonedx_1_6():
    assert environment_bom()["specVersion"] == "1.6"
    assert JsonStrictValidator(SchemaVersion.V1_6).validate_str(json.dumps(environment_bom())) is None


def test_it_holds_every_installed_distribution_with_its_version():
    listed = {row["name"]: row["version"] for row in environment_bom()["components"]}
    found = {
        canonicalize_name(d.name): importlib.metadata.version(d.name)
        for d in importlib.metadata.distributions()
    }
    assert listed == found
    for row in environment_bom()["components"]:
        address = PackageURL.from_string(row["purl"])
        assert (address.type, address.name, address.version) == ("pypi", row["name"], row["version"])


def test_it_is_the_same_each_time_and_sorted(anew):
    first = json.dumps(environment_bom())
    environment_bom.cache_clear()
    assert json.dumps(environment_bom()) == first
    names = [row["name"] for row in environment_bom()["components"]]
    assert names == sorted(names) and len(set(names)) == len(names)


def test_no_path_of_this_machine_gets_into_it():
    text = json.dumps(environment_bom())
    for private in (str(SOURCE_ROOT), sys.prefix, "file:", "timestamp", "serialNumber"):
        assert private not in text


@pytest.mark.parametrize("reader", ["importlib.metadata", "importlib_metadata"])
def test_what_a_broken_installation_leaves_is_passed_over(anew, tmp_path, monkeypatch, reader):
    pytest.importorskip(
        reader
    )  # the second, which packages bring along, takes the place of the first for good
    before = environment_bom()
    environment_bom.cache_clear()
    (tmp_path / "gone-1.0.dist-info").mkdir()
    (tmp_path / "half-1.0.dist-info").mkdir()
    (tmp_path / "half-1.0.dist-info" / "METADATA").write_text("Name: half\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert environment_bom() == before
