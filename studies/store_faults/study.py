"""Running the machines: so many sequences from a seed, and what they came to."""

import contextlib
import io
import os

from hypothesis import HealthCheck, Phase, seed, settings
from hypothesis.stateful import run_state_machine_as_test

from studies.store_faults.clips import cheap_clips
from studies.store_faults.folder_machine import COUNTS, FolderMachine
from studies.store_faults.objects_machine import ObjectsMachine

STEPS = 8
"""Commands, faults and damages in one sequence."""
SHARE_OF_OBJECTS = 0.25
"""Of the sequences, those on an object store."""


def study_faults(sequences: int, first_seed: int) -> tuple[dict[str, int], list[str]]:
    """Run sequences on folders and on object stores; returns what was counted, and what broke.

    Parameters
    ----------
    sequences : how many, of both kinds together [1]
    first_seed : the same seed gives the same sequences
    """
    on_objects = round(sequences * SHARE_OF_OBJECTS)
    COUNTS.clear()
    broken = []
    for machine, count in ((FolderMachine, sequences - on_objects), (ObjectsMachine, on_objects)):
        chosen = settings(
            max_examples=count,
            stateful_step_count=STEPS,
            database=None,
            deadline=None,
            suppress_health_check=list(HealthCheck),
            phases=[Phase.generate, Phase.shrink],
            print_blob=True,
        )
        told = io.StringIO()
        with cheap_clips(), open(os.devnull, "w") as nowhere, contextlib.redirect_stderr(nowhere):
            try:
                with contextlib.redirect_stdout(told):
                    run_state_machine_as_test(seed(first_seed)(machine), settings=chosen)
            except Exception as error:
                notes = "\n".join(getattr(error, "__notes__", []))
                broken.append(
                    f"{machine.__name__}: {type(error).__name__}: {error}\n{notes}\n{told.getvalue()}"[-6000:]
                )
    return dict(COUNTS), broken
