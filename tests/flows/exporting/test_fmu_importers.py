"""The FMU in co-simulation engines that share no code with FMPy: OSP's libcosim (FMI Library) and Ecos (fmilibcpp).

Both are of C++; neither knows variables of type Enumeration. ``make study-exports`` installs them; without one of
them no car is made.
"""

import shutil
from importlib.util import find_spec

import numpy as np
import pytest

from flows.exporting.fmu import write_fmu

fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed: pip install fmpy")
pytestmark = [
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler"),
    pytest.mark.skipif(
        find_spec("libcosimpy") is None and find_spec("ecospy") is None,
        reason="neither libcosim nor Ecos is installed: pip install libcosimpy ecospy",
    ),
]
OUTPUTS = ["speed", "station", "braking_slip_f", "pitch", "heave", "axle_load_f"]
GIVEN = {"initial_speed": 20.0, "road_friction": 0.3, "brake_pressure": 1.6}
SNOW = 3
END_S, STEP_S = 3.0, 0.001


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    path = tmp_path_factory.mktemp("fmu") / "car.fmu"
    write_fmu("multibody-grown", out=str(path))
    return path


@pytest.fixture(scope="module")
def by_fmpy(fmu) -> np.ndarray:
    ride = fmpy.simulate_fmu(
        str(fmu), start_values=GIVEN | {"weather": SNOW}, output=OUTPUTS, stop_time=END_S, step_size=STEP_S,
        output_interval=STEP_S,
    )  # fmt: skip
    return np.array([ride[name][-1] for name in OUTPUTS])


def test_libcosim_stops_on_snow_as_fmpy_does(fmu, by_fmpy):
    pytest.importorskip("libcosimpy", reason="libcosim is not installed: pip install libcosimpy")
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    execution = CosimExecution.from_step_size(step_size=round(STEP_S * 1e9))
    car = execution.add_local_slave(local_slave=CosimLocalSlave(fmu_path=str(fmu), instance_name="car"))
    places = {v.name.decode(): v.reference for v in execution.slave_variables(slave_index=car)}
    for name, value in GIVEN.items():
        assert execution.real_initial_value(slave_index=car, variable_reference=places[name], value=value)
    assert execution.integer_initial_value(slave_index=car, variable_reference=places["weather"], value=SNOW)
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer=observer)
    assert execution.simulate_until(target_time=round(END_S * 1e9))
    found = observer.last_real_values(slave_index=car, variable_references=[places[name] for name in OUTPUTS])
    np.testing.assert_array_equal(found, by_fmpy)


def test_ecos_stops_on_snow_as_fmpy_does(fmu, by_fmpy):
    try:
        ecospy = pytest.importorskip("ecospy", reason="Ecos is not installed: pip install ecospy")
    except OSError as error:
        pytest.skip(f"Ecos cannot be loaded: {error} (Debian's libtbb12 has libtbb)")
    from ecospy.EcosParameterSet import EcosParameterSet
    from ecospy.EcosSimulationStructure import EcosSimulationStructure

    with EcosSimulationStructure() as structure, EcosParameterSet() as given:
        structure.add_model("car", str(fmu))
        for name, value in GIVEN.items():
            given.add_real(f"car::{name}", value)
        given.add_int("car::weather", SNOW)
        structure.add_parameter_set("start", given)
        with ecospy.EcosSimulation(structure=structure, step_size=STEP_S) as simulation:
            simulation.init(parameter_set="start")
            simulation.step(round(END_S / STEP_S))
            found = [simulation.get_real(f"car::{name}") for name in OUTPUTS]
    np.testing.assert_array_equal(found, by_fmpy)
