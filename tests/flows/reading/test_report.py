"""The report page, in a real browser: what an analyst clicks, drags and downloads works from the disk."""

import csv
import json
import shutil
from typing import Any

import numpy as np
import pytest

from flows.making.generate import generate_dataset
from flows.reading.report import make_report
from flows.store.layout import Layout
from flows.store.telemetry import read_columns
from tasks.conventions import TICK_CHANNELS
from tests.browsers import find_barriers, open_chromium
from tests.flows.reseal import reseal
from tests.toy_street import write_toy_grid


@pytest.fixture(scope="module")
def page_folder(toy_dataset, tmp_path_factory):
    folder = tmp_path_factory.mktemp("report") / "page"
    result = make_report(str(toy_dataset.root), out=str(folder))
    assert (result["clips"], result["traced"], result["films_made"]) == (4, 4, 4)
    return folder


@pytest.fixture(scope="module")
def browser():
    with open_chromium() as browser:
        yield browser


@pytest.fixture
def page(browser, page_folder):
    yield from opened(browser, page_folder)


def opened(browser, folder):
    """The page, ready; what it says on the console is an error."""
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    tab, complaints = context.new_page(), []
    tab.on("console", lambda message: complaints.append(message.text))
    tab.on("pageerror", lambda error: complaints.append(str(error)))
    tab.goto(f"file://{folder}/index.html")
    tab.wait_for_selector("body[data-ready]")
    yield tab
    context.close()
    assert complaints == []


def labels(page) -> list[str]:
    return page.locator("#clips tbody tr td:first-child").all_inner_texts()


def cursor_s(page) -> float:
    """The time at which the cursor stands on the axis of the plot [s]."""
    return page.evaluate(
        "(({ xaxis }) => xaxis.p2l(parseFloat(traces.cursor.style.left) - xaxis._offset))(traces.plot._fullLayout)"
    )


def test_nothing_keeps_anybody_from_using_the_page(browser, page_folder):
    assert find_barriers(browser, page_folder / "index.html", ready="body[data-ready]") == []


def test_the_page_lists_every_clip_and_each_filter_reduces_them(page):
    assert labels(page) == ["dry/flat", "dry/hump", "snow-3/flat", "snow-3/hump"]
    page.click("#weather .chip[data-value=snow]")
    assert labels(page) == ["snow-3/flat", "snow-3/hump"]
    page.click("#hazard .chip[data-value=hump]")
    assert labels(page) == ["snow-3/hump"]
    page.click("#reset")
    assert not page.is_visible("#calibration"), "all clips lie off the grid: nothing to choose"
    page.fill("#speed-from", "50")
    assert labels(page) == []
    page.fill("#speed-from", "40")
    page.fill("#search", "HUMP")
    assert labels(page) == ["dry/hump", "snow-3/hump"]
    assert page.inner_text("#count") == "2 of 4 clips"


def test_a_click_on_a_head_sorts_and_another_turns_the_order(page, toy_dataset):
    clips = json.loads(toy_dataset.manifest.read_bytes())["clips"]
    by_pitch = [c["label"] for c in sorted(clips, key=lambda c: c["figures"]["peak_pitch"])]
    page.click("#clips th:nth-child(6)")
    assert labels(page) == by_pitch
    page.click("#clips th:nth-child(6)")
    assert labels(page) == by_pitch[::-1]


def test_the_keyboard_sorts_and_leaves_the_heads(page):
    page.locator("#clips th:first-child button").focus()
    page.keyboard.press("Enter")
    assert page.get_attribute("#clips th:first-child", "aria-sort") in {"ascending", "descending"}
    for _ in range(page.locator("#clips th").count()):
        page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.closest('thead')") is None
    assert page.evaluate("document.activeElement.closest('#clips tbody') !== null")


def test_the_sibling_stands_beside_with_its_film_its_traces_and_what_it_changes(page, toy_dataset):
    data = json.loads(toy_dataset.manifest.read_bytes())["clips"]
    clips = {c["label"]: c["figures"] for c in data}
    page.click("#clips tbody tr:nth-child(2)")
    page.wait_for_function("traces.shown[0]?.label === 'dry/hump'")
    assert page.locator("#sibling option:checked").inner_text() == "snow-3/hump"
    assert page.locator("video:visible").count() == 2
    assert page.evaluate("traces.plot.data.length") == 2 * page.evaluate("REPORT.panels.length")
    change = clips["snow-3/hump"]["surface_friction"] - clips["dry/hump"]["surface_friction"]
    assert f"friction −{-change:.3f}" in page.inner_text("#changes")
    own = clips["dry/hump"]
    low, high = own["surface_friction_p05"], own["surface_friction_p95"]
    assert f"friction {own['surface_friction']:.3f} ({low:.3f} to {high:.3f})" in page.inner_text("#labels")
    assert "does not brake" in page.inner_text("#labels")
    assert "weather dry → snow" in page.inner_text("#changes")
    page.click("#clips tbody tr:nth-child(3)")
    page.wait_for_function("traces.shown[0]?.label === 'snow-3/flat'")
    assert "no stop within the clip" in page.inner_text("#labels")
    (verdict,) = (c["verdict"] for c in data if c["label"] == "snow-3/flat")
    assert page.inner_text("#reasons") == "; ".join(verdict["reasons"]) != ""
    page.select_option("#sibling", "")
    page.wait_for_function("traces.shown.length === 1")
    assert page.locator("video:visible").count() == 1


def test_the_cursor_follows_the_film_and_the_readout_is_the_telemetry_of_that_moment(page, toy_dataset):
    clip = json.loads(toy_dataset.manifest.read_bytes())["clips"][0]
    columns = read_columns(
        toy_dataset.telemetry / "ticks" / "family=dry", clip["clip_id"], most=10_000, exact=False
    )
    before = cursor_s(page)
    page.click("#play")
    page.wait_for_function("!player.running && player.time > 0.85", timeout=10_000)
    time = page.evaluate("player.time")
    assert before == pytest.approx(0, abs=0.01)
    assert cursor_s(page) == pytest.approx(time, abs=0.01)
    assert page.evaluate("player.films[0].currentTime") == pytest.approx(time, abs=0.11)
    shown = float(page.locator(".panel-head output.a").first.inner_text())
    assert shown == pytest.approx(3.6 * columns["speed"][round(1000 * time)], abs=0.051)


def test_each_clip_has_an_address_that_opens_the_page_at_it(page):
    link = page.locator("#clips tbody tr:nth-child(4) a")
    address = f"{page.url.partition('#')[0]}{link.get_attribute('href')}"
    link.click()
    page.wait_for_function("traces.shown[0]?.label === 'snow-3/hump'")
    page.click("#clips tbody tr:nth-child(1)")
    page.wait_for_function("traces.shown[0]?.label === 'dry/flat'")
    page.evaluate("(address) => { location.href = address; }", address)  # typed into the open page
    page.wait_for_function("traces.shown[0]?.label === 'snow-3/hump'")
    page.goto("about:blank")
    page.goto(address)
    page.wait_for_selector("body[data-ready]")
    assert page.inner_text("#label") == "snow-3/hump"


def test_the_exaggerated_horizon_rises_by_five_times_the_pitch_and_only_where_asked_for(page, toy_dataset):
    clip = json.loads(toy_dataset.manifest.read_bytes())["clips"][0]
    pitch = read_columns(
        toy_dataset.telemetry / "ticks" / "family=dry", clip["clip_id"], most=10_000, exact=False
    )["pitch"]
    assert page.locator("svg.horizon:visible").count() == 0
    page.check("#horizon input")
    page.evaluate("scrub(0.9)")
    assert page.locator("svg.horizon:visible").count() == 2
    level, now = (
        float(page.locator(f"figure.a line.{name}").get_attribute("y1").rstrip("%")) / 100
        for name in ("level", "pitched")
    )
    assert level == pytest.approx(0.5)  # a level mount
    assert level - now == pytest.approx(5 * 80 / 64 * np.tan(pitch[900])) and level - now > 0.01
    page.uncheck("#horizon input")
    assert page.locator("svg.horizon:visible").count() == 0


def test_dragging_in_the_traces_moves_the_cursor_and_both_films(page):
    box = page.locator("#plot .nsewdrag").first.bounding_box()
    page.mouse.move(box["x"] + 5, box["y"] + 30)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.7 * box["width"], box["y"] + 30, steps=4)
    page.mouse.up()
    assert cursor_s(page) == pytest.approx(0.7, abs=0.01)
    films = page.evaluate("player.films.map((film) => film.currentTime)")
    assert films == pytest.approx([0.725, 0.725])


def test_the_csv_is_the_stored_telemetry_to_the_last_bit(page, toy_dataset, tmp_path):
    clip = json.loads(toy_dataset.manifest.read_bytes())["clips"][2]
    page.click("#clips tbody tr:nth-child(3)")
    with page.expect_download() as download:
        page.click("#csv")
    assert download.value.suggested_filename == "snow-3_flat.csv"
    download.value.save_as(tmp_path / "clip.csv")
    head, *rows = csv.reader((tmp_path / "clip.csv").open())
    assert head == ["clip_id", "label", "weather", *(channel.name for channel in TICK_CHANNELS)]
    assert len(rows) == 1001
    assert rows[0][:3] == [clip["clip_id"], "snow-3/flat", "snow"]
    stored = read_columns(
        toy_dataset.telemetry / "ticks" / "family=snow", clip["clip_id"], most=10_000, exact=False
    )
    for k, channel in enumerate(TICK_CHANNELS, start=3):
        np.testing.assert_array_equal([float(row[k]) for row in rows], stored[channel.name].astype(float))


def test_the_manifest_s_facts_stand_on_the_page(page, toy_dataset):
    manifest = json.loads(toy_dataset.manifest.read_bytes())
    page.click("#run-facts summary")
    text = page.inner_text("#run-facts")
    for fact in (manifest["run_id"], manifest["seal"], manifest["made_with"]["code"]["source_sha256"]):
        assert fact in text


def test_telemetry_alone_gets_the_page_without_films(browser, toy_dataset, tmp_path):
    grid = str(toy_dataset.root.parent / "grid.yaml")
    bare = generate_dataset(grid, str(tmp_path / "bare"), runner="threads", workers=1, pictures=False).layout
    result = make_report(str(bare.root), clips=["dry/hump"])
    assert result["page"] == str(tmp_path / "bare-report" / "index.html")
    assert (result["traced"], result["films_made"]) == (1, 0)
    for page in opened(browser, tmp_path / "bare-report"):
        assert page.locator("video:visible").count() == 0
        page.click("#clips tbody tr:nth-child(2)")
        page.wait_for_function("traces.shown[0]?.label === 'dry/hump'")
        page.click("#play")
        page.wait_for_function("player.time > 0.3")
        assert cursor_s(page) > 0.25
        assert "No traces of snow-3/hump" in page.inner_text("#untraced")


def test_a_second_report_keeps_the_films(toy_dataset, page_folder):
    assert make_report(str(toy_dataset.root), out=str(page_folder))["films_made"] == 0


HOSTILE = [
    '<img src=x onerror="window.owned=1">', "</script><script>window.owned=1</script>", "javascript:window.owned=1",
    "=HYPERLINK(\"http://x\")${window.owned=1}`+'\u2028\u2029",
]  # fmt: skip


def test_labels_are_text_in_the_page_whatever_they_hold(browser, toy_dataset, tmp_path):
    shutil.copytree(toy_dataset.root, tmp_path / "data")

    def rename_clips(manifest: dict[str, Any]) -> None:
        for clip, label in zip(manifest["clips"], HOSTILE, strict=True):
            clip["label"] = label
            clip["verdict"]["reasons"] = [label]
        manifest["grid"]["name"] = HOSTILE[0]

    reseal(Layout(tmp_path / "data"), rename_clips)
    make_report(str(tmp_path / "data"), out=str(tmp_path / "page"))
    assert "</script>" not in (tmp_path / "page" / "data.js").read_text()
    for page in opened(browser, tmp_path / "page"):
        shown = page.locator("#clips tbody tr td:first-child").all_text_contents()
        assert shown == HOSTILE
        assert page.title().startswith(HOSTILE[0]) and page.locator("h1").text_content() == HOSTILE[0]
        for row in range(4):
            page.click(f"#clips tbody tr:nth-child({row + 1})")
            page.wait_for_function(f"traces.shown[0]?.label === REPORT.clips[{row}].label")
            assert page.locator("#label").text_content() == HOSTILE[row]
        assert page.evaluate("window.owned") is None
        assert page.locator("img").count() == 0 and page.locator("script").count() == 5 + 4
        with page.expect_download() as download:
            page.click("#csv")
        first = next(csv.reader(download.value.path().read_text().splitlines()[1:2]))
        assert first[1].startswith("'=HYPERLINK")


ROAD_USERS = """\
name: users
scene: {folder}/scene
camera: {folder}/camera.yaml
frames: 6
frame_rate_hz: 10
axes:
  road:
    lead: {{initial_speed_km_h: 20, objects: [{{kind: car, track: {{gap_m: 9, speed_km_h: 10}}}}]}}
    alone: {{initial_speed_km_h: 20}}
"""


def test_the_box_of_a_road_user_stands_over_the_frame_that_is_shown(browser, tmp_path):
    generate_dataset(write_toy_grid(tmp_path, ROAD_USERS), str(tmp_path / "ds"), runner="threads", workers=1)
    table = read_columns(tmp_path / "ds/telemetry/objects/clip-00000.parquet", most=6)
    make_report(str(tmp_path / "ds"), out=str(tmp_path / "page"))
    for page in opened(browser, tmp_path / "page"):
        for frame in (0, 4):
            page.evaluate(f"scrub({frame / 10})")
            shown = page.locator("figure.a svg.boxes rect")
            found = {name: float(shown.get_attribute(name)) for name in ("x", "y", "width", "height")}
            left, top, right, bottom = (
                table[f"box_{side}"][frame] for side in ("left", "top", "right", "bottom")
            )
            assert found == {"x": left, "y": top, "width": right - left, "height": bottom - top}
        assert page.text_content("figure.a svg.boxes text") == "car"
        assert page.locator("figure.b svg.boxes rect").count() == 0
        page.uncheck("#boxes input")
        assert page.locator("svg.boxes rect").count() == 0
