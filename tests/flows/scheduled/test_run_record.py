"""The record of a run: kept up to date while it goes on, in a folder or a store, and read again."""

from datetime import UTC, datetime

import pytest

from flows.running.progress import progress_bar
from flows.scheduled.run_record import keep_record, read_record

AT = datetime(2026, 3, 1, 3, 0, tzinfo=UTC)
NAME = "toy-20260301T030000Z"


def test_in_a_store_the_record_is_an_object_and_the_metrics_are_a_file_here(tmp_path, monkeypatch):
    obstore = pytest.importorskip("obstore")
    monkeypatch.setattr(
        "obstore.store.S3Store",
        lambda bucket, prefix, **_: obstore.store.LocalStore(tmp_path / bucket / prefix, mkdir=True),
    )
    monkeypatch.chdir(tmp_path)
    place = tmp_path / "data" / "nightly" / "runs" / f"{NAME}.json"
    with (
        pytest.raises(KeyboardInterrupt),
        keep_record("toy", "s3://data/nightly", f"s3://data/nightly/{NAME}", AT),
        progress_bar("clips", 3) as advance,
    ):
        advance("what failed")  # a label like any other
        advance("wet", failed=True)
        advance("snow")
        record = read_record(place.read_bytes(), place)
        assert (record.to_make, record.made, record.failed, record.ended) == (3, 2, ["wet"], None)
        raise KeyboardInterrupt
    record = read_record(place.read_bytes(), place)
    assert record.error == "KeyboardInterrupt" and record.ended is not None
    text = (tmp_path / ".musync" / "runs" / "toy.prom").read_text()
    assert 'musync_run_clips_failed{grid="toy"} 1.0' in text


@pytest.mark.parametrize("content", [None, b"[", b"{}", b'{"format": "musync-run/1", "failed": 3}'])
def test_what_is_no_record_is_none(content):
    assert read_record(content, "here") is None
