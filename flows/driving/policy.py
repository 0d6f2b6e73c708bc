"""A policy: a function of the observation that says the brake's pressure, from a module of the user's."""

import importlib
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from types import FrameType

from flows.driving.simulator import Observation, Simulator
from tasks.errors import InputError

LONGEST_CALL_S = 30.0
"""Time after which a call of a policy is given up [s]."""
Act = Callable[[Observation], float]


@dataclass(frozen=True, kw_only=True)
class Policy:
    """A policy of a module.

    Parameters
    ----------
    name : ``module:function``
    source : of the module
    begin : gives what one drive asks at each step: the function, or a new object of the class
    camera : name or file of the camera whose pictures it reads: the ``camera`` of function or class; None for none
    """

    name: str
    source: bytes
    begin: Callable[[], Act]
    camera: str | None = None

    @property
    def source_sha256(self) -> str:
        """SHA-256 of the source."""
        return sha256(self.source).hexdigest()


def load_policy(name: str) -> Policy:
    """Import a policy; modules of the working folder are found too.

    Parameters
    ----------
    name : ``module:function``; of a class each drive gets an object of its own, which is called

    Raises
    ------
    InputError
        If there is no such module or function, or the module cannot be imported.
    """
    module_name, mark, attribute = name.partition(":")
    if not (mark and module_name and attribute):
        raise InputError(f"policy must be module:function; it is {name[:80]!r}")
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.insert(0, here)
    try:
        module = importlib.import_module(module_name)
    except Exception as error:
        raise InputError(f"policy {name}: the module cannot be imported: {_describe_error(error)}") from None
    found = getattr(module, attribute, None)
    if not callable(found):
        raise InputError(f"policy {name}: {module_name} has no function or class {attribute}")
    file = getattr(module, "__file__", None)
    if file is None:
        raise InputError(f"policy {name}: {module_name} has no source file, whose hash could be kept")
    camera = getattr(found, "camera", None)
    if not isinstance(camera, str | None):
        raise InputError(f"policy {name}: camera must be the name or file of a camera; it is {camera!r:.80}")
    return Policy(
        name=name, source=Path(file).read_bytes(), begin=found if isinstance(found, type) else lambda: found,
        camera=camera,
    )  # fmt: skip


def drive_with(
    policy: Policy, simulator: Simulator, place: str, is_over: Callable[[Observation], bool] | None = None
) -> list[float]:
    """Drive to the end and return the pressures that the policy asked for [MPa].

    Parameters
    ----------
    policy : that is asked when each step begins
    simulator : the drive
    place : what messages call the drive
    is_over : whether nothing more can happen; None drives to the end

    Raises
    ------
    InputError
        If the policy raises, says no pressure, or takes longer than `LONGEST_CALL_S`.
    """
    pressures: list[float] = []
    with _report_failures(policy, place, 0.0):
        act = policy.begin()
    seen = simulator.reset()
    while not (seen.ends or (is_over is not None and is_over(seen))):
        with _report_failures(policy, place, seen.time):
            pressure = float(act(seen))
        try:
            seen = simulator.step(pressure)
        except InputError as error:
            raise InputError(f"policy {policy.name}: {place}: at {seen.time:g} s: {error}") from None
        pressures.append(pressure)
    return pressures


@contextmanager
def _report_failures(policy: Policy, place: str, at: float) -> Iterator[None]:
    """Report in a sentence where a policy raises or takes too long."""
    where = f"policy {policy.name}: {place}: at {at:g} s"
    began = time.monotonic()
    late = f"{where}: took longer than {LONGEST_CALL_S:g} s for one step: make it faster"
    # only the main thread of a Unix process can be woken
    wakes = hasattr(signal, "setitimer") and threading.current_thread() is threading.main_thread()

    def wake(_: int, __: FrameType | None) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, wake) if wakes else None
    try:
        if wakes:
            signal.setitimer(signal.ITIMER_REAL, LONGEST_CALL_S)
        yield
    except TimeoutError:
        raise InputError(late) from None
    except Exception as error:
        raise InputError(f"{where}: raised {_describe_error(error)}") from None
    finally:
        if wakes:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, before)
    if time.monotonic() - began > LONGEST_CALL_S:
        raise InputError(late)


def _describe_error(error: BaseException) -> str:
    lines = str(error).splitlines()
    return f"{type(error).__name__}: {lines[0][:200]}" if lines else type(error).__name__
