"""Any video against a claim: other sizes, rates and codecs; damaged files in one clear line."""

import tracemalloc
from collections.abc import Iterator
from fractions import Fraction
from hashlib import sha256
from pathlib import Path

import av
import cv2
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from catalogs.entries import load
from studies.evaluation.metrics.foreign_video import VideoClaim, judge_motion, sample_claim
from studies.foreign_video import sources
from studies.foreign_video.judge import judge_video, read_claim
from studies.foreign_video.retention import measure_retention
from studies.foreign_video.sources import (
    LEVEL,
    MOST_PIXELS,
    ForeignCamera,
    read_video,
)
from studies.synthetic_street import Clip, drive_clip
from tasks.errors import InputError
from tasks.eval.poses.motion import RecoveredMotion
from tasks.eval.poses.resampling import undistort_frames
from tests.laboratory.foreign_video.test_trajectories import tum_lines


@pytest.fixture(scope="module")
def street() -> Clip:
    return drive_clip(frames=24, frame_rate=16.0, hump_at=0.2, width=360, height=240, focal=300.0)


@pytest.fixture(scope="module", autouse=True)
def each_video_followed_once() -> Iterator[None]:
    """The motion in equal frames is the same, whatever is claimed of it."""
    seen: dict[tuple[bytes, ...], RecoveredMotion] = {}
    recover = sources.recover_motion_essential

    def recover_once(frames: np.ndarray, *geometry: np.ndarray) -> RecoveredMotion:
        key = (sha256(frames).digest(), *(array.tobytes() for array in geometry))
        if key not in seen:
            seen[key] = recover(frames, *geometry)
        return seen[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sources, "recover_motion_essential", recover_once)
        yield


def encode(path: Path, frames: np.ndarray, rate: float, codec: str) -> Path:
    size = frames.shape[2], frames.shape[1]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*codec), rate, size)
    for frame in frames:
        writer.write(cv2.cvtColor(frame, cv2.COLOR_RGB2BGR))
    writer.release()
    return path


def write_inputs(folder: Path, clip: Clip, pitch: np.ndarray | None = None) -> dict[str, str]:
    height, width = clip.frames.shape[1:3]
    (folder / "K.yaml").write_text(
        f"width: {width}\nheight: {height}\nfx: {clip.K[0, 0]}\nfy: {clip.K[1, 1]}\n"
        f"cx: {clip.K[0, 2]}\ncy: {clip.K[1, 2]}\n"
    )
    times = np.arange(len(clip.frames)) / 16.0
    table = {"time": times, "pitch": clip.pitch if pitch is None else pitch, "station": clip.station}
    pq.write_table(pa.table(table), folder / "claim.parquet")
    return {"claim": str(folder / "claim.parquet"), "camera": str(folder / "K.yaml")}


@pytest.mark.parametrize(("suffix", "codec", "scale"), [("mp4", "mp4v", 1.0), ("avi", "MJPG", 0.75)])
def test_a_true_claim_passes_in_other_codecs_and_sizes(
    street: Clip, tmp_path: Path, suffix: str, codec: str, scale: float
) -> None:
    frames = np.stack(
        [cv2.resize(f, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) for f in street.frames]
    )
    video = encode(tmp_path / f"v.{suffix}", frames, 16.0, codec)
    result = judge_video(str(video), **write_inputs(tmp_path, street), out=str(tmp_path / "out"))
    assert result["passed"], result["reasons"]
    assert result["failed_frames"] == 0 and result["frame_rate_hz"] == pytest.approx(16.0, rel=0.01)
    assert (
        all("needs depth" in line for line in result["not_run"])
        and (tmp_path / "out" / "judgement.json").is_file()
    )


@pytest.mark.parametrize("factor", [0.0, 0.7, -1.0])
def test_a_false_pitch_is_refused(street: Clip, tmp_path: Path, factor: float) -> None:
    video = encode(tmp_path / "v.mp4", street.frames, 16.0, "mp4v")
    false = street.pitch.copy() * factor if factor else np.roll(street.pitch, 6)
    assert not judge_video(str(video), **write_inputs(tmp_path, street, false))["passed"]


def test_half_the_frames_at_half_the_rate_are_judged_by_their_own_times(street: Clip, tmp_path: Path) -> None:
    video = encode(tmp_path / "v.mp4", street.frames[::2], 8.0, "mp4v")
    result = judge_video(str(video), **write_inputs(tmp_path, street))
    assert result["frame_rate_hz"] == pytest.approx(8.0, rel=0.01)
    assert result["pitch_rmse_deg"] < 0.1


def test_large_frames_are_judged_reduced_and_held_once(street: Clip, tmp_path: Path) -> None:
    large = np.stack([cv2.resize(f, (1440, 960), interpolation=cv2.INTER_CUBIC) for f in street.frames[:14]])
    video = encode(tmp_path / "v.mp4", large, 16.0, "mp4v")
    tracemalloc.start()
    frames, times, size = read_video(video)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert size == (1440, 960) and frames.shape == (14, 587, 881, 3) and len(times) == 14
    assert MOST_PIXELS > 881 * 587 and peak < 1.1 * frames.nbytes + 8 * large[0].nbytes
    reduced = cv2.resize(large[0], (881, 587), interpolation=cv2.INTER_AREA)
    assert np.abs(frames[0].astype(int) - reduced).mean() < 3.0
    result = judge_video(str(video), **write_inputs(tmp_path, street))
    assert result["passed"], result["reasons"]
    assert (result["width"], result["height"]) == (1440, 960)
    assert (result["judged_width"], result["judged_height"]) == (881, 587)


def test_what_fits_is_read_as_it_is(street: Clip, tmp_path: Path) -> None:
    video = encode(tmp_path / "v.mp4", street.frames, 16.0, "mp4v")
    frames, _, _ = read_video(video)
    assert frames.shape == street.frames.shape
    assert np.abs(frames.astype(int) - street.frames).mean() < 4.0


def stamped_film(path: Path, times: np.ndarray, form: str, codec: str = "libx264", **options: str) -> Path:
    """A film whose frames have these times [s]."""
    clock = Fraction(1, 90_000)
    with av.open(str(path), "w", format=form, options=options) as container:
        stream = container.add_stream(codec, rate=30)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        stream.time_base = stream.codec_context.time_base = clock
        for number, time in enumerate(times):
            noise = np.random.Generator(np.random.Philox(number)).integers(0, 255, (48, 64, 3), np.uint8)
            frame = av.VideoFrame.from_ndarray(noise, format="rgb24")
            frame.pts, frame.time_base = round(time / clock), clock
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path


CHANGING = np.r_[np.arange(15) / 30, 0.5 + np.arange(10) * 0.1, 1.5 + np.arange(15) / 30]
"""Times of 40 frames, 30 a second, then 10, then 30 [s]."""


@pytest.mark.parametrize("start", [0.0, 0.5])
@pytest.mark.parametrize(
    ("name", "form", "codec"),
    [("v.mp4", "mp4", "libx264"), ("v.mkv", "matroska", "libx264"), ("v.webm", "webm", "libvpx"),
     ("v.ts", "mpegts", "libx264"), ("v.flv", "flv", "libx264")],
)  # fmt: skip
def test_a_whole_film_is_read_with_its_own_times(
    tmp_path: Path, name: str, form: str, codec: str, start: float
) -> None:
    frames, times, _ = read_video(stamped_film(tmp_path / name, CHANGING + start, form, codec))
    assert len(frames) == 40
    np.testing.assert_allclose(times, CHANGING, atol=6e-4)


@pytest.mark.parametrize(
    ("form", "options"),
    [("matroska", {}), ("mp4", {"movflags": "faststart"}), ("mp4", {"movflags": "frag_keyframe+empty_moov"})],
)
def test_a_film_that_breaks_off_is_told(tmp_path: Path, form: str, options: dict[str, str]) -> None:
    whole = stamped_film(tmp_path / "v", CHANGING, form, **options)
    (tmp_path / "cut").write_bytes(whole.read_bytes()[: whole.stat().st_size * 3 // 4])
    with pytest.raises(InputError, match="the file breaks off"):
        read_video(tmp_path / "cut")


def test_times_that_fall_are_not_replaced_by_a_rate(tmp_path: Path) -> None:
    first, second = (
        stamped_film(tmp_path / f"{name}.ts", CHANGING + start, "mpegts").read_bytes()
        for name, start in (("a", 5.0), ("b", 0.0))
    )
    (tmp_path / "joined.ts").write_bytes(first + second)
    with pytest.raises(InputError, match="the time must rise from frame to frame"):
        read_video(tmp_path / "joined.ts")


def test_undistortion_in_parts_is_that_of_the_whole(street: Clip, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[np.ndarray] = []
    monkeypatch.setattr(sources, "CHUNK", 5)
    monkeypatch.setattr(sources, "recover_motion_essential", lambda frames, *rest: seen.append(frames))
    height, width = street.frames.shape[1:3]
    bent = np.array([-0.2, 0.05, 0.001, -0.001, 0.0])
    camera = ForeignCamera(K=street.K, width=width, height=height, mount=LEVEL, distortion=bent)
    film = sources.Footage(name="v", times=np.arange(24) / 16, frames=street.frames, poses=None)
    film.motion(camera, np.arange(2, 20))
    whole = undistort_frames({"rgb": street.frames[2:20]}, street.K, bent)["rgb"]
    assert (seen[0] == whole).all()


def test_damaged_and_empty_files_get_one_line_each(street: Clip, tmp_path: Path) -> None:
    (tmp_path / "empty.mp4").write_bytes(b"")
    (tmp_path / "noise.mp4").write_bytes(np.random.Generator(np.random.Philox(1)).bytes(20_000))
    whole = encode(tmp_path / "v.avi", street.frames, 16.0, "MJPG")
    (tmp_path / "cut.avi").write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    for name, words in (("empty.mp4", "is empty"), ("noise.mp4", "no frame can be read"), ("none.mp4", "no such file"),
                        ("cut.avi", "breaks off|no frame")):  # fmt: skip
        with pytest.raises(InputError, match=words) as caught:
            read_video(tmp_path / name)
        assert len(caught.value.problems) == 1


def test_all_wrong_inputs_are_told_at_once(tmp_path: Path) -> None:
    (tmp_path / "K.yaml").write_text("width: 480\n")
    pq.write_table(pa.table({"time": [0.0, 1.0]}), tmp_path / "claim.parquet")
    with pytest.raises(InputError) as caught:
        judge_video(
            str(tmp_path / "none.mp4"), claim=str(tmp_path / "claim.parquet"), camera=str(tmp_path / "K.yaml")
        )
    told = "\n".join(caught.value.problems)
    assert "no such file" in told and "lacks the column pitch" in told and "fx must be a number" in told


def test_a_claim_without_its_columns_is_told_which_it_has(tmp_path: Path) -> None:
    pq.write_table(pa.table({"t": [0.0, 1.0], "theta": [0.0, 0.0]}), tmp_path / "claim.parquet")
    with pytest.raises(InputError) as caught:
        read_claim(tmp_path / "claim.parquet")
    assert caught.value.problems == (
        f"{tmp_path}/claim.parquet: the claim lacks a column t_ns or time, the column pitch [rad], a column station [m]"
        " or speed [m/s]; its columns are t, theta.",
    )


def test_a_short_wrong_swing_is_not_hidden_by_a_long_quiet_clip() -> None:
    times = np.arange(81) * 0.1
    swing = 0.015 * np.exp(-((times - 3.0) ** 2) / 0.05)
    nothing = np.zeros(81)
    drifting = RecoveredMotion(
        method="exact", T_rig0_rig=np.tile(np.eye(4), (81, 1, 1)), pitch=swing + 5e-4 * times, heave=nothing,
        lateral=nothing, progress=np.full(81, np.nan), normalised_path=np.stack([times / 8, nothing, nothing], 1),
        pitch_std=nothing, progress_std=nothing, inliers=np.full(81, 100), failed=nothing > 0, failures=(),
    )  # fmt: skip
    for factor, good in ((1.0, True), (0.7, False), (-1.0, False)):
        claim = VideoClaim(time=times, pitch=factor * swing, station=10 * times)
        verdict = judge_motion(drifting, sample_claim(claim, times), load("foreign gate file"))
        assert verdict["pitch_judged"] and verdict["passed"] == good
    quiet = VideoClaim(time=times, pitch=nothing, station=10 * times)
    assert not judge_motion(drifting, sample_claim(quiet, times), load("foreign gate file"))["pitch_judged"]


def test_retention_sees_what_an_editor_kept_and_what_it_lost(tmp_path: Path) -> None:
    frames, dive = 81, 0.02 * np.exp(-((np.arange(81) - 50) ** 2) / 200.0)
    hump = 0.015 * np.sin((np.arange(81) - 16) / 4.0) * ((np.arange(81) >= 16) & (np.arange(81) <= 42))
    drift = 2e-4 * np.arange(81)
    (tmp_path / "K.yaml").write_text("width: 480\nheight: 320\nfocal_length: 400\n")

    def track(name: str, pitch: np.ndarray) -> str:
        poses = np.tile(LEVEL, (frames, 1, 1))
        turn = np.tile(np.eye(4), (frames, 1, 1))
        turn[:, 0, 0] = turn[:, 2, 2] = np.cos(pitch)
        turn[:, 0, 2], turn[:, 2, 0] = np.sin(pitch), -np.sin(pitch)
        turn[:, 0, 3] = np.arange(frames)
        (tmp_path / f"{name}.txt").write_text(tum_lines(np.arange(frames) * 0.1, turn @ poses))
        return str(tmp_path / f"{name}.txt")

    source, braking = track("source", dive + hump), track("braking", dive)
    kept, lost = (
        track("kept", 0.5 * dive - 0.4 * hump + drift),
        track("lost", 0.5 * dive + 0.4 * np.roll(hump, 6)),
    )
    edited_braking = track("edited-braking", 0.5 * dive)
    whole = measure_retention(source, braking, kept, edited_braking, camera=str(tmp_path / "K.yaml"))
    assert whole["motion_retention"] == pytest.approx(1.0, abs=0.01)
    part = measure_retention(
        source, braking, lost, edited_braking, camera=str(tmp_path / "K.yaml"), out=str(tmp_path / "out")
    )
    assert part["motion_retention"] < 0.7 and (tmp_path / "out" / "retention.json").is_file()
    with pytest.raises(InputError, match="event must lie within"):
        measure_retention(
            source, braking, kept, edited_braking, camera=str(tmp_path / "K.yaml"), event=(16, 80)
        )
    with pytest.raises(InputError, match=r"source\.txt: must be one of the four clips; it stands for two"):
        measure_retention(source, source, kept, edited_braking, camera=str(tmp_path / "K.yaml"))
    with pytest.raises(InputError, match="The edited clips must differ in pitch in the event; they do not"):
        measure_retention(
            source,
            braking,
            kept,
            track("copy", 0.5 * dive - 0.4 * hump + drift),
            camera=str(tmp_path / "K.yaml"),
        )


@pytest.mark.parametrize(
    "text",
    ["ffconcat version 1.0\nfile {}\n", "#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\n{}\n#EXT-X-ENDLIST\n"],
)
def test_a_playlist_opens_no_other_file(tmp_path: Path, street: Clip, text: str) -> None:
    encode(tmp_path / "other.avi", street.frames, 16.0, "MJPG")
    for name in ("list.mp4", "list.m3u8"):
        (tmp_path / name).write_text(text.format("other.avi"))
        with pytest.raises(InputError, match="no frame can be read"):
            read_video(tmp_path / name)
