"""A car that is an FMU, driven step by step."""

from pathlib import Path

import numpy as np
import pytest

from tasks.vehicle.model.simulation import COLUMNS

fmpy = pytest.importorskip("fmpy", reason="FMPy, which loads FMUs, is not installed: pip install fmpy")
from fmpy.fmi2 import FMU2Slave  # noqa: E402


class Car:
    """Drives with the inputs that were set last; what the FMU says of a mistake is kept in ``said``."""

    def __init__(self, path: Path, folder: Path, **given: float) -> None:
        self.description = fmpy.read_model_description(str(path))
        self.places = {v.name: (v.valueReference, v.type) for v in self.description.modelVariables}
        self.said: list[str] = []
        fmpy.extract(str(path), str(folder))
        self.slave = FMU2Slave(
            guid=self.description.guid, unzipDirectory=str(folder), instanceName="car",
            modelIdentifier=self.description.coSimulation.modelIdentifier,
        )  # fmt: skip
        callbacks = fmpy.fmi2.fmi2CallbackFunctions()
        callbacks.logger = fmpy.fmi2.fmi2CallbackLoggerTYPE(
            lambda *words: self.said.append(words[4].decode())
        )
        self.slave.instantiate(callbacks=callbacks)
        self.callbacks, self.time = callbacks, 0.0
        self.begin_drive(**given)

    def begin_drive(self, **given: float) -> None:
        self.time = 0.0
        self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()
        self.set_inputs(**given)
        self.slave.exitInitializationMode()

    def set_inputs(self, **given: float) -> None:
        for name, value in given.items():
            place, kind = self.places[name]
            setter = {"Real": self.slave.setReal, "Boolean": self.slave.setBoolean}.get(
                kind, self.slave.setInteger
            )
            setter([place], [value])

    def take_step(self, length: float) -> None:
        self.slave.doStep(self.time, length)
        self.time = round(self.time + length, 9)

    def read_row(self) -> np.ndarray:
        return np.array(self.slave.getReal([self.places[name][0] for name in COLUMNS]))
