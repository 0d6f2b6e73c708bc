import os
import subprocess
import sys
import threading
import time
from concurrent.futures import BrokenExecutor, ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace

import dask
import pytest

from flows.making.generate import generate_dataset
from flows.running.orchestration import run_as_stage
from flows.running.runner import (
    ALLOCATOR,
    SPAWNED,
    choose_runner,
    log_dashboard,
    open_executor,
    run_unordered,
)
from manifests.provenance import SOURCE_ROOT
from tasks.errors import InputError
from tests.flows.running.calls import (
    end_worker,
    list_variables,
    square_or_fail,
    tell_process_id,
)
from tests.hostile.other_user import run_as_other


@pytest.fixture(scope="module")
def executors():
    """An executor of every runner, as each takes seconds to start; Dask's on a machine with two GPUs."""
    import distributed  # noqa: F401  (brings its settings)

    settings = dask.config.get(SPAWNED)
    with pytest.MonkeyPatch.context() as patch, ExitStack() as running:
        patch.setenv("CUDA_VISIBLE_DEVICES", "0,1")
        opened = {
            runner: running.enter_context(open_executor(runner, workers))
            for runner, workers in (("threads", 2), ("processes", 1), ("dask", 2))
        }
        yield opened
    assert dask.config.get(SPAWNED) == settings, "what workers find is changed for the run alone"


@pytest.mark.parametrize("runner", ["threads", "processes", "dask"])
def test_every_runner_returns_each_result_and_keeps_going_past_a_failure(executors, runner):
    ended = {
        call[0]: future
        for call, future in run_unordered(executors[runner], square_or_fail, [(i,) for i in range(6)])
    }
    assert {number: ended[number].result() for number in (0, 1, 2, 4, 5)} == {0: 0, 1: 1, 2: 4, 4: 16, 5: 25}
    assert isinstance(ended[3].exception(), ValueError)


def test_only_so_many_calls_are_submitted_at_once(monkeypatch):
    monkeypatch.setattr("flows.running.runner.IN_FLIGHT", 4)
    asked = []

    def calls():
        for number in range(40):
            asked.append(number)
            yield (number,)

    with ThreadPoolExecutor(2) as executor:
        for ended, _ in enumerate(run_unordered(executor, tell_process_id, calls()), start=1):
            assert len(asked) <= ended + 4
    assert asked == list(range(40))


def test_a_run_that_stops_asks_for_no_further_calls(monkeypatch):
    monkeypatch.setattr("flows.running.runner.IN_FLIGHT", 4)
    calls = iter([(number,) for number in range(40)])
    with ThreadPoolExecutor(2) as executor:
        running = run_unordered(executor, tell_process_id, calls)
        next(running)
        running.close()
    assert len(list(calls)) >= 35


def test_calls_that_are_left_when_the_workers_die_fail_one_by_one(monkeypatch):
    monkeypatch.setattr("flows.running.runner.IN_FLIGHT", 2)
    with open_executor("processes", 1) as executor:
        ended = list(run_unordered(executor, end_worker, [(number,) for number in range(6)]))
    assert len(ended) == 6
    assert all(isinstance(future.exception(), BrokenExecutor) for _, future in ended)


def test_without_frames_the_run_is_on_threads_unless_a_runner_is_named():
    assert choose_runner("auto", pictures=True) == "dask"
    assert choose_runner("auto", pictures=False) == "threads"
    assert choose_runner("auto", pictures=False, scheduler="tcp://host:8786") == "dask"
    assert choose_runner("processes", pictures=False) == "processes"


def test_processes_are_other_processes(executors):
    assert executors["processes"].submit(tell_process_id, 0).result() != os.getpid()


def certificates(client) -> dict[str, str]:
    """Dask's settings with which another client of a local cluster is let in."""
    own = client.security.get_tls_config_for_role("client")
    names = {"ca-file": "ca_file", "client.cert": "cert", "client.key": "key"}
    return {f"distributed.comm.tls.{name}": own[field] for name, field in names.items()}


def test_a_running_dask_cluster_is_used_by_its_address_and_its_certificates(executors):
    client = executors["dask"]._client
    address = client.scheduler.address
    assert address.startswith("tls://127.0.0.1:")
    with (
        pytest.raises(InputError, match="belongs to --runner dask"),
        open_executor("threads", 1, address),
    ):
        pass
    with dask.config.set(certificates(client)), open_executor("dask", None, address) as executor:
        assert executor.submit(tell_process_id, 0).result() in client.run(os.getpid).values()


@pytest.mark.parametrize(
    ("scheme", "said"), [("tls", "tls needs certificates"), ("tcp", "no Dask scheduler answers there")]
)
def test_nobody_without_the_certificates_of_a_run_reaches_its_scheduler(executors, monkeypatch, scheme, said):
    monkeypatch.setattr("flows.running.runner.CONNECT_TIMEOUT", "1s")
    address = executors["dask"]._client.scheduler.address.replace("tls", scheme)
    with pytest.raises(InputError, match=said), open_executor("dask", None, address):
        pass


REACH = """
logging.disable()
async def reach(address, call):
    try:
        return await asyncio.wait_for(call(address), 20)
    except (TypeError, OSError, asyncio.TimeoutError) as error:  # of a comm that is closed, too
        return type(error).__name__
async def run_code(address):
    async with Client(address, asynchronous=True, timeout=3) as client:
        return await client.run_on_scheduler(os.getuid)
async def call(address):
    async with rpc(address, timeout=3) as remote:
        return await remote.identity()
async def reach_all():
    for address in sys.argv[1:]:
        for call_it in (run_code, call):
            print(await reach(address, call_it))
asyncio.run(reach_all())
"""


def test_another_user_runs_no_code_in_the_scheduler_or_the_workers_of_a_run(executors):
    imports = "import asyncio, logging\nfrom distributed import Client\nfrom distributed.core import rpc"
    client = executors["dask"]._client
    address, worker = next(iter(client.scheduler_info(n_workers=-1)["workers"].items()))
    doors = [client.scheduler.address, address, worker["nanny"]]
    assert all(door.startswith("tls://127.0.0.1:") for door in doors)
    tried = [door.replace("tls", scheme) for door in doors for scheme in ("tls", "tcp")]
    said = run_as_other(REACH, *tried, imports=imports).splitlines()
    assert len(said) == 2 * len(tried)
    assert set(said) <= {"TypeError", "OSError", "CommClosedError", "TimeoutError"}, said
    assert executors["dask"].submit(os.getuid).result() == os.getuid()


@pytest.mark.parametrize("runner", ["process", "Dask", ""])
def test_a_runner_that_does_not_exist_is_refused_and_not_taken_for_dask(runner, tmp_path):
    with (
        pytest.raises(InputError, match="--runner must be one of threads, processes, dask; it is"),
        open_executor(runner, 1),
    ):
        pass
    with pytest.raises(InputError, match="--runner must be one of threads, processes, dask; it is"):
        generate_dataset("demo", str(tmp_path / "new"), runner=runner)
    assert not any(tmp_path.iterdir()), "nothing is begun"


def test_local_workers_keep_the_memory_that_the_next_frame_needs(executors):
    found = executors["dask"].submit(list_variables, tuple(ALLOCATOR)).result()
    assert found == {name: str(value) for name, value in ALLOCATOR.items()}


def test_each_worker_process_sees_one_gpu_of_those_visible(executors):
    seen = executors["dask"]._client.run(os.getenv, "CUDA_VISIBLE_DEVICES")
    assert sorted(seen.values()) == ["0", "1"]


def test_the_dashboard_is_told_where_its_pages_can_be_drawn(monkeypatch, capsys):
    client = SimpleNamespace(dashboard_link="http://127.0.0.1:8787/status")
    for found, said in ((None, ""), (object(), "Dask's dashboard: http://127.0.0.1:8787/status\n")):
        monkeypatch.setattr("flows.running.runner.find_spec", lambda _, found=found: found)
        log_dashboard(client)
        assert capsys.readouterr().err == said


def test_two_runs_on_one_machine_do_not_quarrel_about_a_port(executors, recwarn):
    with open_executor("dask", 1, None) as second:
        assert second.submit(square_or_fail, 7).result() == 49
    assert not [str(w.message) for w in recwarn if "in use" in str(w.message)]


def test_a_scheduler_that_does_not_answer_is_an_input_error(monkeypatch):
    monkeypatch.setattr("flows.running.runner.CONNECT_TIMEOUT", "1s")
    with (
        pytest.raises(InputError, match="no Dask scheduler answers"),
        open_executor("dask", 1, "tcp://127.0.0.1:9"),
    ):
        pass


def test_a_client_that_fails_half_way_is_closed_at_once():
    """Closed when Python collects it, it waits for ever for another client that starts at that moment."""
    running = set(threading.enumerate())
    with (
        pytest.raises(InputError, match="unknown address scheme"),
        open_executor("dask", 1, "foo://127.0.0.1:9"),
    ):
        pass
    assert set(threading.enumerate()) <= running


def test_outside_a_flow_a_stage_is_its_function():
    assert run_as_stage(square_or_fail)(4) == 16
    with pytest.raises(ValueError, match="three"):
        run_as_stage(square_or_fail)(3)
    assert run_as_stage(square_or_fail).__name__ == "square_or_fail"


KILLED = """
import os, sys, time
from flows.running.runner import open_executor

if __name__ == "__main__":
    with open_executor("processes", 2) as executor:
        print(*{executor.submit(os.getpid).result() for _ in range(2)}, flush=True)
        executor.submit(time.sleep, 600)
        time.sleep(600)
"""


def test_workers_end_with_a_run_that_is_killed(tmp_path):
    (tmp_path / "run.py").write_text(KILLED)
    run = subprocess.Popen(
        [sys.executable, "run.py"], cwd=tmp_path, stdout=subprocess.PIPE, text=True,
        env=os.environ | {"PYTHONPATH": str(SOURCE_ROOT)},
    )  # fmt: skip
    workers = [int(pid) for pid in run.stdout.readline().split()]
    assert workers and all(Path(f"/proc/{pid}").exists() for pid in workers)
    run.kill()
    run.wait()
    until = time.monotonic() + 20
    while alive := [pid for pid in workers if Path(f"/proc/{pid}").exists()]:
        assert time.monotonic() < until, f"workers {alive} go on"
        time.sleep(0.05)
