"""Pressures with which a policy drove the clips of a dataset; they are kept, and nobody runs the policy again."""

import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray
from pydantic import Field

from catalogs.documents import read_content
from catalogs.quantities import CatalogueEntry, Number, Text, parse_entry
from tasks.errors import InputError

DRIVEN = "driven"
"""Folder among a dataset's kept inputs."""
POLICY, PRESSURES, SOURCE = (f"{DRIVEN}/{name}" for name in ("policy.json", "pressures.parquet", "policy.py"))
LARGEST_POLICY = 1_000_000


class PolicyEntry(CatalogueEntry):
    """Who drove: ``module:function``, the SHA-256 of its source, and how often it was asked."""

    policy: Text
    source_sha256: str = Field(pattern="^[0-9a-f]{64}$")
    rate_hz: Number


@dataclass(frozen=True, kw_only=True)
class DrivenClips:
    """What a policy asked of the brake.

    Parameters
    ----------
    entry : the policy
    pressures : of the steps of each clip, by its label, float64 [N] [MPa]
    """

    entry: PolicyEntry
    pressures: Mapping[str, Sequence[float] | NDArray[np.float64]]


def encode_driven(driven: DrivenClips, source: bytes) -> dict[str, bytes]:
    """Return the files that a dataset keeps, by their name under ``inputs/``.

    Parameters
    ----------
    driven : what the policy asked for
    source : its source
    """
    labels, values = list(driven.pressures), driven.pressures.values()
    table = pa.table({
        "label": pa.array(np.repeat(np.array(labels, dtype=object), [len(one) for one in values]), pa.string()),
        "pressure_mpa": pa.array(np.concatenate([np.asarray(one, np.float64) for one in values])),
    })  # fmt: skip
    packed = io.BytesIO()
    pq.write_table(table, packed)
    policy = json.dumps(driven.entry.model_dump(), indent=1, sort_keys=True).encode() + b"\n"
    return {POLICY: policy, PRESSURES: packed.getvalue(), SOURCE: source}


def read_driven(inputs: Path) -> DrivenClips | None:
    """Return what a policy asked for in a dataset; None in one that no policy drove.

    Parameters
    ----------
    inputs : folder of the kept inputs

    Raises
    ------
    InputError
        If a file is missing or holds something else.
    """
    path = inputs / POLICY
    if not path.is_file():
        return None
    entry = parse_entry(PolicyEntry, read_content(path, "policy", LARGEST_POLICY), path, "policy")
    file = inputs / PRESSURES
    try:
        table = pq.read_table(file, columns=["label", "pressure_mpa"])
        labels = table["label"].to_numpy(zero_copy_only=False)
        values = table["pressure_mpa"].to_numpy().astype(np.float64)
    except (OSError, pa.ArrowException) as error:
        raise InputError(
            f"{file}: must hold the pressures of a drive: {str(error).splitlines()[0]}"
        ) from None
    firsts: NDArray[np.intp] = np.flatnonzero(np.append(True, labels[1:] != labels[:-1])[: len(labels)])
    parts = np.split(values, firsts[1:]) if len(labels) else []
    return DrivenClips(entry=entry, pressures=dict(zip(labels[firsts], parts, strict=True)))
