"""The files of a set of edited videos: which model made which clip, from which source, under which claim."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from catalogs.sentences import cap_problems
from studies.foreign_video.trajectories import SUFFIXES
from studies.video_sets.protocol import VideoProtocol
from tasks.errors import InputError

SOURCE = "source"
"""Folder of what the editors were given; it stands for a model where no model's clip is asked for."""
VIDEO_METHOD = "essential"
"""Pose method of a clip that is a video; a trajectory is of the method that its name says."""
FORM = (
    "models/MODEL/seed-N/TASK/NAME.mp4 or NAME.METHOD.txt, source/TASK/NAME.mp4, claims/TASK/NAME.parquet,"
    " targets/NAME.mp4 and camera.yaml"
)


@dataclass(frozen=True, kw_only=True)
class SetClip:
    """One clip of a set.

    Parameters
    ----------
    model : that made it, or `SOURCE`
    seed : visual seed; empty for the source
    clip : TASK/NAME, as in the protocol
    method : pose method by which its motion is known
    path : of the video or the trajectory
    """

    model: str
    seed: str
    clip: str
    method: str
    path: Path


@dataclass(frozen=True, kw_only=True)
class VideoSet:
    """A folder of edited videos.

    Parameters
    ----------
    camera : file of the camera that all clips share
    clips : of all models and of the source
    claims : motion that a clip should show, by TASK/NAME
    targets : video of the mask where a road feature is prescribed, by the feature's name
    """

    camera: Path
    clips: tuple[SetClip, ...]
    claims: dict[str, Path]
    targets: dict[str, Path]

    @property
    def models(self) -> tuple[str, ...]:
        """Names of the models, sorted."""
        return tuple(sorted({clip.model for clip in self.clips} - {SOURCE}))

    def seeds(self, model: str) -> tuple[str, ...]:
        """Visual seeds of a model, sorted."""
        return tuple(sorted({clip.seed for clip in self.clips if clip.model == model}))


def find_set(folder: Path, protocol: VideoProtocol) -> VideoSet:
    """List the files of a set; a protocol's clip that is not there is no fault, a file that no protocol knows is.

    Parameters
    ----------
    folder : of the set
    protocol : whose clips it holds

    Raises
    ------
    InputError
        If there is no such folder, no model or no camera in it, and for each file of an unknown name.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; give one with {FORM}")
    clips: list[SetClip] = []
    problems: list[str] = []
    places = [(SOURCE, "", folder / "source")]
    places += [
        (place.parent.name, place.name.removeprefix("seed-"), place)
        for place in sorted(folder.glob("models/*/*"))
        if place.is_dir()
    ]
    for model, seed, place in places:
        if model != SOURCE and not (place.name.startswith("seed-") and seed):
            problems.append(f"{place}: a model's clips must lie in seed-N, with N their visual seed")
            continue
        for path in _list_files(place):
            name, method = _split_name(path)
            clip = f"{path.parent.name}/{name}"
            if clip in protocol.clips and path.parent.parent == place:
                clips.append(SetClip(model=model, seed=seed, clip=clip, method=method, path=path))
            else:
                problems.append(f"{path}: no clip of the protocol; there are: {', '.join(protocol.clips)}")
    claims = {f"{path.parent.name}/{path.stem}": path for path in sorted(folder.glob("claims/*/*.parquet"))}
    targets = {path.stem: path for path in _list_files(folder / "targets")}
    problems += [f"{path}: no clip of the protocol has this name" for name, path in claims.items()
                 if name not in protocol.clips]  # fmt: skip
    problems += [f"{path}: no road feature of the protocol; there are: {', '.join(protocol.geometry_features)}"
                 for name, path in targets.items() if name not in protocol.geometry_features]  # fmt: skip
    found = {(c.model, c.seed, c.clip, c.method) for c in clips}
    if len(found) < len(clips):
        problems.append(f"{folder}: a clip must have one file of each method; some have two")
    if not any(clip.model != SOURCE for clip in clips) and not problems:
        problems.append(f"{folder}: holds no model's clip; it must have the form {FORM}")
    if not (folder / "camera.yaml").is_file():
        problems.append(f"{folder}/camera.yaml: no such file; all clips of a set share one camera")
    if problems:
        raise InputError(cap_problems(problems))
    return VideoSet(camera=folder / "camera.yaml", clips=tuple(clips), claims=claims, targets=targets)


def _list_files(folder: Path) -> Iterator[Path]:
    return (path for path in sorted(folder.rglob("*")) if path.is_file() and not path.name.startswith("."))


def _split_name(path: Path) -> tuple[str, str]:
    """Name of the clip and pose method: rain-0.5.vggt.txt is rain-0.5 by vggt, rain-0.5.mp4 by the chain."""
    if path.suffix not in SUFFIXES:
        return path.stem, VIDEO_METHOD
    name, _, method = path.stem.rpartition(".")
    return name, method
