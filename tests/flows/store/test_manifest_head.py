"""The manifest without its clips: what a reader of the tables takes from it, and when it reads the whole."""

import json
import shutil

import pytest

import flows.store.sealed as sealed
import musync
from flows.reading.query import query_dataset
from flows.store.layout import Layout
from flows.store.sealed import read_manifest, read_manifest_head
from manifests.manifest import head_of_sealed
from tasks.errors import InputError
from tests.flows.reseal import reseal


@pytest.fixture
def dataset(toy_dataset, tmp_path):
    """A dataset whose manifest may be changed."""
    layout = Layout(tmp_path / "data")
    shutil.copytree(toy_dataset.root, layout.root, copy_function=shutil.copyfile)
    return layout


def test_the_head_is_the_manifest_without_its_clips(toy_dataset):
    manifest = read_manifest(toy_dataset)
    del manifest["clips"]
    assert read_manifest_head(toy_dataset) == manifest


def test_sql_and_open_read_no_clip_and_len_does(toy_dataset, monkeypatch):
    checked = []
    monkeypatch.setattr(sealed, "check_manifest", lambda content, place: checked.append(place))
    assert query_dataset(str(toy_dataset.root), "SELECT count(*) AS n FROM clips")["rows"] == [{"n": 4}]
    data = musync.open(toy_dataset.root)
    data.sql("SELECT 1")
    data.connection.close()
    assert checked == []
    monkeypatch.undo()
    assert len(data) == 4


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace(b'"label":"dry/flat"', b'"label":"dry/flaT"'),  # of a clip
        lambda text: text.replace(b'"backend":"', b'"backend":"x'),
        lambda text: text + b"\n",
        lambda text: json.dumps(json.loads(text)).encode(),  # not canonical
        lambda text: text[:-1],
        lambda text: b"",
    ],
    ids=["a clip changed", "changed beside the clips", "a byte more", "other spaces", "cut off", "empty"],
)
def test_bytes_that_were_not_sealed_have_no_head(toy_dataset, change):
    content = toy_dataset.manifest.read_bytes()
    assert head_of_sealed(content) is not None
    assert head_of_sealed(change(content)) is None


def test_a_sealed_manifest_whose_clips_are_followed_by_something_else_has_no_head(dataset):
    reseal(dataset, lambda manifest: manifest.pop("environment"))
    assert head_of_sealed(dataset.manifest.read_bytes()) is None


def test_without_its_seal_the_whole_manifest_is_held_to_its_form(dataset):
    content = json.loads(dataset.manifest.read_text())
    content["clips"][0]["index"] = -1
    dataset.manifest.write_text(json.dumps(content))
    with pytest.raises(InputError, match="index"):
        read_manifest_head(dataset)


@pytest.mark.parametrize(
    "change",
    [
        lambda m: m["artifacts"].update({"../../victim": "0" * 64}),
        lambda m: m["artifacts"].update({"a": "0" * 64, "clips": [{}], "environment": {}}),
        lambda m: m.update(run_on_open="os.system"),
        lambda m: m["environment"].update(a=[{}], environment={}),
        lambda m: m["grid"].update(frames=0),
        lambda m: m.update(format="musync-manifest/2"),
        lambda m: m.update(clips=[None, {}]),
        lambda m: m.update(clips="abc"),
        lambda m: m.update(clips=[]),
    ],
    ids=[
        "a path out",
        "a cut within",
        "a key more",
        "another cut",
        "a grid of none",
        "another format",
        "clips that are none",
        "clips that are text",
        "no clips",
    ],
)
def test_a_forged_head_is_refused_with_its_seal_made_again(dataset, change):
    reseal(dataset, change)
    with pytest.raises(InputError):
        read_manifest_head(dataset)


def test_a_text_that_looks_like_a_cut_is_text(dataset):
    cuts = ',"clips":[{}],"environment":{}'
    reseal(
        dataset,
        lambda manifest: manifest.update(backend=cuts, made_with={"code": {"x": cuts}, "libraries": {}}),
    )
    head = head_of_sealed(dataset.manifest.read_bytes())
    assert head is not None and b'"clip_id"' not in head
    assert read_manifest_head(dataset)["backend"] == cuts


def test_forged_clips_are_refused_when_they_are_asked_for(dataset):
    reseal(dataset, lambda manifest: manifest["clips"][0].update(clip_id="' OR 1=1"))
    data = musync.open(dataset.root)
    with pytest.raises(InputError, match="clip_id"):
        data.pandas("ticks", clip="dry/flat")


def test_a_dataset_that_was_sealed_anew_is_opened_again(dataset):
    data = musync.open(dataset.root)
    reseal(dataset, lambda manifest: manifest.update(backend="other"))
    with pytest.raises(InputError, match="sealed anew: open it again"):
        len(data)
