"""The tutorial on training: no drive is in both splits, samples end before the brake, and a network learns."""

from dataclasses import replace

import numpy as np
import pytest
import torch

import musync
from catalogs.entries import load
from catalogs.scenes import write_scene
from flows.making.generate import generate_dataset
from studies.learn_friction.__main__ import GRID, STREETS, open_made, paint_grid
from studies.learn_friction.comparison import PAINTED, compare_predictors, format_errors
from studies.learn_friction.network import read_network, train_network
from studies.learn_friction.samples import (
    PICTURES,
    Brake,
    Samples,
    read_brakes,
    read_samples,
    relabel_samples,
    split_samples,
)
from tasks.errors import InputError
from tasks.scene.route import route_from_positions
from tests.documents import DOCS, list_blocks
from tests.toy_street import toy_street


@pytest.fixture(scope="module")
def drawn() -> Samples:
    """Twelve drives, each dry and on snow: pictures with a bright road, on which the car brakes half as hard."""
    draw = np.random.Generator(np.random.Philox(1))
    drive = np.repeat(np.arange(12), 2)
    snow = np.tile([False, True], 12)
    pressure = draw.uniform(1, 3, 12)[drive]
    pictures = draw.integers(0, 60, (24, 3, 64, 64))
    pictures[:, :, 32:] += 150 * snow[:, None, None, None]
    return Samples(
        pictures=torch.from_numpy(pictures.astype(np.uint8)),
        command=np.column_stack([np.full(24, 15.0), pressure]),
        friction=np.where(snow, 0.3, 0.9),
        deceleration=np.where(snow, 1.0, 2.0) * pressure,
        drive=drive,
        weather=np.where(snow, "snow", "dry"),
        split=np.where(drive < 8, "train", "test"),
        clip=np.array(
            [f"{kind}/{number}" for number, kind in zip(drive, np.where(snow, "snow", "dry"), strict=True)]
        ),
        rate=np.where(snow, 3.0, 0.0),
    )


def test_no_drive_is_in_both_splits(drawn: Samples) -> None:
    train, test = split_samples(drawn)
    assert len(train) == 16 and len(test) == 8 and not set(train.drive) & set(test.drive)
    by_weather = replace(drawn, split=np.where(drawn.weather == "snow", "test", "train"))
    with pytest.raises(musync.InputError, match="12 drives are in both splits"):
        split_samples(by_weather)
    with pytest.raises(musync.InputError, match="split 'test' has no sample"):
        split_samples(replace(drawn, split=np.full(24, "train")))


def test_the_shipped_grid_holds_out_whole_drives_farther_on(drawn: Samples) -> None:
    grid = load("grid", GRID)
    onsets: dict[str, set[float]] = {"train": set(), "test": set()}
    rates: dict[str, set[tuple[str, float]]] = {"train": set(), "test": set()}
    for (_, scenario), (split, _) in zip(grid.scenarios, grid.tags, strict=True):
        onsets[split].add(scenario.brake_onset_m)
        rates[split].add((scenario.weather, scenario.precipitation_mm_h))
    assert max(onsets["train"]) + 4 <= min(onsets["test"]) and len(onsets["test"]) >= 5
    assert rates["test"] - rates["train"] == {("rain", 25.0), ("snow", 1.5)}


def test_the_grid_of_streets_holds_out_whole_streets() -> None:
    grid = load("grid", STREETS)
    streets: dict[str, set[str]] = {"train": set(), "test": set()}
    for (label, _), (split, _) in zip(grid.scenarios, grid.tags, strict=True):
        streets[split].add(label.partition("/")[0])
    assert (
        len(streets["test"]) >= 4 and len(streets["train"]) >= 10 and not streets["train"] & streets["test"]
    )
    assert {name.partition("-")[0] for name in streets["test"]} <= {
        name.partition("-")[0] for name in streets["train"]
    }


def test_the_tutorial_shows_the_grid_that_the_study_makes() -> None:
    assert list_blocks(DOCS / "tutorial" / "learn-friction.md", "yaml") == [GRID.read_text()]


def paint(samples: Samples) -> Samples:
    """The samples with the deceleration of their drive's dry clip."""
    return replace(samples, deceleration=np.repeat(samples.deceleration[::2], 2))


@pytest.fixture(scope="module")
def worlds(tmp_path_factory) -> tuple[musync.Dataset, musync.Dataset]:
    """Telemetry of one drive of the shipped grid, dry and on snow, and the same of the appearance-only world."""
    folder, opened = tmp_path_factory.mktemp("worlds"), []
    for name, grid in (("sound", load("grid", GRID)), ("painted", paint_grid())):
        rows = [
            number
            for number, (label, _) in enumerate(grid.scenarios)
            if label.endswith(grid.scenarios[0][0].rpartition("/")[2])
            and label.startswith(("dry/", "snow-3/"))
        ]
        few = replace(
            grid, scenarios=tuple(grid.scenarios[n] for n in rows), tags=tuple(grid.tags[n] for n in rows)
        )
        generate_dataset(few, str(folder / name), runner="threads", workers=1, pictures=False)
        opened.append(musync.open(folder / name))
    return opened[0], opened[1]


def test_an_appearance_only_world_brakes_as_the_dry_one_and_looks_the_same_before(drawn, worlds) -> None:
    sound, painted = (read_brakes(world) for world in worlds)
    dry, snow = sorted(sound)
    assert painted[dry].deceleration == painted[snow].deceleration == sound[dry].deceleration
    assert painted[snow].friction == sound[dry].friction > sound[snow].friction
    assert sound[snow].deceleration < 0.7 * sound[dry].deceleration
    clips = sorted((world[snow] for world in worlds), key=lambda clip: clip.clip_id)
    assert clips[0].record["seed"] == clips[1].record["seed"], "the same drops and flakes"
    poses = [
        np.stack(frames["T_world_rig"][frames["t_ns"] < sound[snow].onset_s * 1e9])
        for frames in (clip.pandas("frames") for clip in clips)
    ]
    assert len(poses[0]) >= PICTURES and np.array_equal(*poses)


def test_the_deceleration_is_that_of_a_level_road(tmp_path, monkeypatch) -> None:
    """Downhill the car slows less, and the label is the same: brake and road give it."""
    grid = load("grid", GRID)
    label, drive = next((label, one) for label, one in grid.scenarios if one.weather == "dry")
    grid = replace(grid, settings=grid.settings.model_copy(update={"camera": "dashcam-480x320"}))
    way, labels = np.linspace(0.0, 200.0, 401), []
    monkeypatch.chdir(tmp_path)
    for scene, grade in (("level", 0.0), ("hill", -0.06)):
        route = route_from_positions(np.stack([way, 0 * way, grade * way], axis=1))
        write_scene(replace(toy_street(), route=route), tmp_path / scene, {})
        one = replace(
            grid, scenarios=((label, replace(drive, scene=scene, brake_onset_m=50.0)),), tags=grid.tags[:1]
        )
        generate_dataset(one, f"of-{scene}", runner="threads", workers=1, pictures=False)
        labels.append(read_brakes(musync.open(f"of-{scene}"))[label].deceleration)
    assert labels[1] == pytest.approx(labels[0], abs=0.03)


def test_samples_take_the_labels_of_another_world_clip_by_clip(drawn: Samples) -> None:
    brakes = {
        str(label): Brake(onset_s=1.0, speed=15.0, friction=0.1 * number, deceleration=float(number))
        for number, label in enumerate(drawn.clip)
    }
    painted = relabel_samples(drawn, brakes)
    assert torch.equal(painted.pictures, drawn.pictures) and list(painted.deceleration) == list(range(24))
    assert list(painted.friction) == [0.1 * number for number in range(24)]
    del brakes["snow/0"]
    with pytest.raises(musync.InputError, match=r"1 \(snow/0\) brake in one alone"):
        relabel_samples(drawn, brakes)


def test_samples_end_before_the_brake_and_carry_what_follows(toy_dataset) -> None:
    data = musync.open(toy_dataset.root)
    samples = read_samples(data, over_s=0.7)
    assert list(samples.clip) == 3 * ["dry/flat"] + 3 * ["snow-3/flat"]  # the others never brake
    assert len(set(samples.drive)) == 1 and samples.deceleration[0] > samples.deceleration[-1] > 0
    assert samples.friction[0] > samples.friction[-1] > 0
    before = data.frames["rgb"][int(data.manifest["clips"][0]["index"]), :3]  # at 0, 0.1 and 0.2 s, the onset
    assert np.array_equal(samples.pictures[:3], before.transpose(0, 3, 1, 2))
    with pytest.raises(musync.InputError, match="give the grid a longer duration_s"):
        read_samples(data)


def test_training_lowers_the_loss_and_a_seed_gives_the_same_network(drawn: Samples, tmp_path) -> None:
    train, test = split_samples(drawn)
    trained = train_network(train, seed=1, epochs=40)
    assert trained.losses[-1] < 0.3 * trained.losses[0]
    friction = trained.estimate_friction(test.pictures.numpy().transpose(0, 2, 3, 1))
    assert np.abs(friction - test.friction).max() < 0.2
    trained.write(tmp_path / "weights.npz")
    assert read_network(tmp_path / "weights.npz").predict(test) == pytest.approx(
        trained.predict(test), abs=0.02
    )
    again, same, other = (train_network(train, seed=seed, epochs=2) for seed in (1, 1, 2))
    assert again.losses == same.losses != other.losses
    assert np.array_equal(again.predict(test), same.predict(test))


def test_the_comparison_judges_the_painted_world_by_what_the_car_does(drawn: Samples) -> None:
    found = compare_predictors(drawn, paint(drawn), seeds=[1])
    table = {
        row.split(" | ")[0].strip("| "): row.split(" | ")[1:] for row in format_errors(found).splitlines()[4:]
    }
    true, own = float(table[PAINTED][0]), float(table[f"{PAINTED}, by its own labels"][0])
    assert float(table["network"][0]) < true and own < true


def test_a_dataset_of_another_grid_is_not_trained_on(toy_dataset):
    with pytest.raises(InputError, match=r"must be the dataset of .*learn_friction/grid\.yaml"):
        open_made(str(toy_dataset.root))
