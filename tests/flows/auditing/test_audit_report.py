"""The report of an audit stands alone: what, when, where and with what, in one page that loads nothing."""

import base64
import hashlib
import json
import platform
import re
import shutil
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat

import manifests.explain
from flows.auditing.audit import audit_dataset
from flows.auditing.audit_report import describe_verdict, format_text, write_audit_page
from flows.auditing.signing import sign_dataset
from flows.auditing.verify import verify_dataset
from flows.store.layout import Layout
from manifests.provenance import code_version, library_versions
from tests.browsers import find_barriers, open_chromium
from tests.flows.reseal import reseal
from tests.manifests.test_signing import private_pem, public_pem


def files_of(layout: Layout) -> dict[str, bytes]:
    return {layout.relative(p): p.read_bytes() for p in layout.root.rglob("*") if p.is_file()}


@pytest.fixture(scope="module")
def audit(toy_dataset, tmp_path_factory) -> dict[str, Any]:
    """One clip of a signed dataset made again, with its report in a folder."""
    folder = tmp_path_factory.mktemp("audit")
    shutil.copytree(toy_dataset.root, folder / "data")
    key = Ed25519PrivateKey.generate()
    (folder / "key.pem").write_bytes(private_pem(key))
    (folder / "public.pem").write_bytes(public_pem(key))
    sign_dataset(str(folder / "data"), key=str(folder / "key.pem"))
    layout = Layout(folder / "data")
    before = files_of(layout)
    result = audit_dataset(
        str(layout.root), share=0.25, key=str(folder / "public.pem"), out=str(folder / "out"), runner="threads",
        workers=1,
    )  # fmt: skip
    return {"result": result, "layout": layout, "before": before, "key": key, "folder": folder}


def test_the_record_names_dataset_key_time_machine_tools_and_clips(audit):
    result, layout = audit["result"], audit["layout"]
    manifest = json.loads(layout.manifest.read_bytes())
    for name in ("run_id", "seal"):
        assert result[name] == manifest[name]
    assert result["dataset"] == str(layout.root) and result["clips"] == 4
    assert result["manifest_sha256"] == hashlib.sha256(layout.manifest.read_bytes()).hexdigest()
    der = audit["key"].public_key().public_bytes(Encoding.DER, PublicFormat.SubjectPublicKeyInfo)
    assert result["signed"] is True and result["key_sha256"] == hashlib.sha256(der).hexdigest()
    assert result["signers"] == [result["key_id"]]
    began, ended = (datetime.fromisoformat(result[f"{name}_utc"]) for name in ("started", "ended"))
    assert began <= ended <= datetime.now(UTC) and began.utcoffset() == timedelta(0)
    assert result["machine"]["name"] == platform.node()
    assert (
        result["tools_here"]["code"] == code_version() and result["tools_recorded"]["git"] == manifest["git"]
    )
    assert result["tools_here"]["libraries"] == library_versions()
    (clip,) = result["remade"]
    assert clip["as_recorded"] and clip["label"] in {row["label"] for row in manifest["clips"]}
    assert result["compared"] == {"tables": 2, "arrays": 3}
    assert json.loads((audit["folder"] / "out" / "audit.json").read_text()) == result


def test_the_dataset_keeps_every_byte(audit):
    assert files_of(audit["layout"]) == audit["before"]


def test_verify_and_audit_count_the_same_files_and_say_so_positively(audit):
    result = audit["result"]
    verified = verify_dataset(str(audit["layout"].root))
    assert (
        result["files"] == verified["files"] == result["intact"] == len(audit["before"]) - 1
    )  # the envelope
    told = f"all {result['files']} files are those recorded"
    assert told in result["verdict"] and told in verified["verdict"]
    assert [result["not_checked"], result["verdict"]] == format_text(result).splitlines()[:2]
    assert result["verdict"] == describe_verdict(result)
    assert result["verdict"].startswith("Verified: ") and "1 of 4 clips, made again" in result["verdict"]


def test_the_first_sentence_counts_what_was_not_checked(audit):
    result = audit["result"]
    assert result["not_checked"] == (
        "Not checked: motion, pictures and pose check of 3 of 4 clips (not made again); records of processor, git and"
        " environment of 3 of 3 records (no byte follows from them)."
    )
    assert [(row["count"], row["of"], row["unit"]) for row in result["unchecked"]] == [
        (3, 4, "clips"),
        (3, 3, "records"),
    ]
    page = (audit["folder"] / "out" / "audit.html").read_text()
    body = page[page.index("<body>") :]
    assert 0 < body.index(result["not_checked"]) < body.index(result["verdict"])


def test_another_version_of_the_writer_is_counted_and_not_mistaken_for_a_forger(audit, tmp_path, monkeypatch):
    copy = Layout(Path(shutil.copytree(audit["layout"].root, tmp_path / "copy")))
    table = copy.telemetry / "clips.parquet"
    pq.write_table(pq.read_table(table), table, compression="zstd")
    reseal(copy)
    assert not audit_dataset(str(copy.root), share=0.0)["verified"]
    here = manifests.explain.tools_here()
    here["made_with"]["libraries"]["pyarrow"] = "9.9"
    monkeypatch.setattr("flows.auditing.audit_facts.tools_here", lambda: here)
    result = audit_dataset(str(copy.root), share=0.0)
    assert result["verified"] and result["contradictions"] == []
    files = result["files"]
    told = f"bytes of 1 of {files} files (written by another pyarrow; values are checked)"
    assert told in result["not_checked"]


def test_the_page_has_every_fact_and_loads_and_runs_nothing(audit):
    result = audit["result"]
    page = (audit["folder"] / "out" / "audit.html").read_text()
    body = page[page.index("<body>") :]
    shown = [
        result["verdict"], result["run_id"], result["seal"], result["manifest_sha256"], result["key_sha256"],
        result["key_id"], result["started_utc"], result["ended_utc"], result["machine"]["name"],
        result["remade"][0]["label"], result["tools_here"]["code"]["source_sha256"],
        result["tools_here"]["libraries"]["numpy"], f"{result['files']} files", "2 tables and 3 arrays of 1 of 4 clips",
    ]  # fmt: skip
    assert [fact for fact in shown if fact not in body] == []
    assert f'<h1 class="verdict good">{result["verdict"]}</h1>' in body
    assert not re.search(r"<script|<img|<link(?![^>]*data:,)|https?:|url\(|\son\w+=", page)
    (style,) = re.findall(r"<style>(.*?)</style>", page, flags=re.S)
    digest = base64.b64encode(hashlib.sha256(style.encode()).digest()).decode()
    assert f"default-src &#39;none&#39;; style-src &#39;sha256-{digest}&#39;" in page
    assert "prefers-color-scheme: dark" in style and 'name="viewport"' in page


def test_nothing_keeps_anybody_from_reading_the_page(audit):
    with open_chromium() as browser:
        assert find_barriers(browser, audit["folder"] / "out" / "audit.html") == []


def test_words_of_a_stranger_are_text_and_a_difference_is_marked(audit):
    strange = {"label": "<b>x</b>", "clip_id": "0" * 16}
    row = strange | {
        "stage": "vehicle", "channel": "speed", "counted_in": "tick", "tick": 3, "recorded": 1.0, "remade": 2.0,
        "changed": ["ticks"], "why": [],
    }  # fmt: skip
    result = audit["result"] | {
        "remade": [strange | {"as_recorded": False}],
        "mismatches": [row],
        "contradictions": ["plan.json: clips.0.label must be <b>x</b>, as in manifest.json"],
        "verified": False,
    }
    page = write_audit_page(result | {"verdict": describe_verdict(result)})
    assert "<b>x" not in page and "&lt;b&gt;x" in page
    assert "Records that contradict each other: plan.json: clips.0.label must be &lt;b&gt;x" in page
    assert "; its records contradict each other; " in describe_verdict(result)
    assert "Not verified: " in page and "0 came out as recorded and 1 did not" in page
    assert (
        "vehicle, speed, tick 3: 1.0 recorded, 2.0 made again. Can come from: no input that is recorded"
        in page
    )


def test_a_missing_signature_fails_the_audit_that_asks_for_it(audit, tmp_path):
    key = Ed25519PrivateKey.generate()
    (tmp_path / "other.pem").write_bytes(public_pem(key))
    result = audit_dataset(str(audit["layout"].root), share=0.0, key=str(tmp_path / "other.pem"))
    assert not result["verified"] and result["signed"] is False
    assert f"no valid signature of key {result['key_id'][:16]}" in result["verdict"]
    assert audit_dataset(str(audit["layout"].root), share=0.0)["verdict"].endswith(
        "; no signature was checked."
    )
