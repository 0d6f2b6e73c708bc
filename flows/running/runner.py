"""Where the work of a run happens: threads, processes or Dask, behind one executor protocol."""

import logging
import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from importlib.util import find_spec
from itertools import islice
from multiprocessing import get_context, parent_process
from queue import SimpleQueue
from threading import Thread
from typing import Any, Literal, get_args

from flows.running.processors import count_processors
from flows.running.terminal import print_lines
from tasks.errors import InputError

RunnerName = Literal["threads", "processes", "dask"]
RunnerChoice = RunnerName | Literal["auto"]
IN_FLIGHT = 1000
"""Calls submitted and not yet returned [1]: two for each worker of the largest cluster that the project plans for."""
CONNECT_TIMEOUT = "10s"
ONE_THREAD = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")
"""One frame per worker, one thread each: measured faster than threads within a frame, and repeatable."""
SPAWNED = "distributed.nanny.pre-spawn-environ"
"""Dask's setting for what workers find in their environment when they start; the allocator reads it only then."""
MEBIBYTE = 1 << 20
ALLOCATOR = {
    "MALLOC_TRIM_THRESHOLD_": 512 * MEBIBYTE,
    "MALLOC_MMAP_THRESHOLD_": 32 * MEBIBYTE,
    "MALLOC_TOP_PAD_": 64 * MEBIBYTE,
}
"""How a worker keeps freed memory (mallopt(3)) [B]. Dask gives back all above 64 KiB, and a clip, which frees and takes
the same arrays at every frame, then spends a third of its time in the kernel. Arrays of a whole clip are given back."""
WATCH = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "500ms",
    "distributed.admin.system-monitor.interval": "5s",
}
"""How a local cluster watches itself. Dask samples every worker's stack a hundred times a second, wakes every process
fifty times and reads memory twice, which takes 3 % of a core in each; a clip takes seconds."""


@contextmanager
def open_executor(
    runner: RunnerName,
    workers: int | None = None,
    scheduler: str | None = None,
    warm: Callable[[], Any] | None = None,
) -> Iterator[Executor]:
    """An executor for the length of a run.

    Parameters
    ----------
    runner : ``threads`` in this process, ``processes`` on this machine, or ``dask``
    workers : how many at once; None takes the processors this process may use [1]
    scheduler : address of a running Dask scheduler (tcp:// or tls://); None starts a local cluster
    warm : what each worker of a running cluster does before it is given work

    Raises
    ------
    InputError
        If there is no such runner, a scheduler is named for another one, none answers at the address, or its workers
        are not set up like this machine.
    """
    check_runner(runner, scheduler)
    count = workers or count_processors()
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
    if runner == "threads":
        with ThreadPoolExecutor(count) as executor:
            yield executor
    elif runner == "processes":
        # spawn: a forked child would inherit the locks of OpenCV's and Arrow's threads
        with ProcessPoolExecutor(count, get_context("spawn"), initializer=end_with_parent) as executor:
            yield executor
    else:
        with _dask_client(count, scheduler, warm) as client, client.get_executor(pure=False) as executor:
            yield executor


def check_runner(runner: str, scheduler: str | None) -> None:
    """Raise `InputError` for a runner that does not exist, or a scheduler that it does not take.

    Parameters
    ----------
    runner : ``threads``, ``processes`` or ``dask``
    scheduler : address of a running Dask scheduler
    """
    if problems := list_runner_problems(runner, scheduler):
        raise InputError(problems)


def list_runner_problems(runner: str, scheduler: str | None) -> list[str]:
    """Return a sentence for each rule that a runner and a scheduler break.

    Parameters
    ----------
    runner, scheduler : as of `check_runner`
    """
    problems = []
    if runner not in get_args(RunnerName):
        problems.append(f"--runner must be one of {', '.join(get_args(RunnerName))}; it is {runner}")
    if scheduler is not None and runner != "dask":
        problems.append(f"--scheduler {scheduler} belongs to --runner dask; the runner is {runner}")
    return problems


def end_with_parent() -> None:
    """In a worker process: end when the process that started it does, even if that one is killed."""
    parent = parent_process()
    if parent is not None:

        def wait() -> None:
            parent.join()
            os._exit(1)

        Thread(target=wait, daemon=True).start()


@contextmanager
def _dask_client(workers: int, scheduler: str | None, warm: Callable[[], Any] | None) -> Iterator[Any]:
    import dask
    from distributed import Client, LocalCluster, Security

    from flows.running.cluster import check_cluster, check_joining, share_gpus, warm_cluster

    # a closing cluster says so in a dozen lines, and Prefect lets every library log
    logging.getLogger("distributed").setLevel(logging.ERROR)
    if scheduler is None:
        spawned = dask.config.get(SPAWNED) | ALLOCATOR
        # within the block: a worker that dies is started again with the same
        with (
            dask.config.set({SPAWNED: spawned, **WATCH}),
            LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                dashboard_address="127.0.0.1:0",
                silence_logs=40,
                # certificates of this run alone: without them any user of this machine has its workers run code
                security=Security.temporary(),
            ) as cluster,
            Client(cluster) as client,
        ):
            share_gpus(client)
            log_dashboard(client)
            yield client
        return
    try:
        client = _connect(scheduler)
    except TypeError:  # what Dask raises for tls:// without certificates
        raise InputError(
            f"--scheduler {scheduler}: tls needs certificates; name them in Dask's configuration "
            "(distributed.comm.tls.ca-file, .client.cert, .client.key)"
        ) from None
    except (OSError, ValueError) as error:
        raise InputError(f"--scheduler {scheduler}: no Dask scheduler answers there ({error})") from None
    with client:
        check_cluster(client, scheduler)
        with check_joining(client, scheduler):
            share_gpus(client)
            if warm is not None:
                warm_cluster(client, warm, scheduler)
            log_dashboard(client)
            yield client


def _connect(address: str) -> Any:
    """A `distributed.Client` of a scheduler, or what it raises, closed.

    Dask leaves one that cannot connect running until Python collects it. It then closes itself, and takes a lock for
    that which another client holds while it starts: where that one's start is what made Python collect, both wait for
    ever (`LoopRunner._lock`).
    """
    from distributed import Client

    client = Client.__new__(Client)
    try:
        client.__init__(address, timeout=CONNECT_TIMEOUT)
    except (TypeError, OSError, ValueError):
        client.close()
        raise
    return client


def log_dashboard(client: Any) -> None:
    """Print where Dask's dashboard is; without bokeh its pages say no more than that bokeh is missing."""
    if find_spec("bokeh") is not None:
        print_lines(f"Dask's dashboard: {client.dashboard_link}", error=True)


def choose_runner(asked: RunnerChoice, pictures: bool, scheduler: str | None = None) -> RunnerName:
    """The runner of a run: the one asked for, and of ``auto`` the quickest for what is made.

    A clip without frames takes some 20 ms of processor time and then waits for the disk: threads make it while other
    runners still start. Frames take seconds of Python and NumPy each, which threads of one process make in turns.

    Parameters
    ----------
    asked : by the user
    pictures : whether frames are made
    scheduler : address of a running Dask scheduler, which only Dask takes
    """
    if asked != "auto":
        return asked
    return "dask" if pictures or scheduler is not None else "threads"


def run_unordered(
    executor: Executor, function: Callable[..., Any], arguments: Iterable[tuple[Any, ...]]
) -> Iterator[tuple[tuple[Any, ...], Future[Any]]]:
    """Submit the calls, `IN_FLIGHT` of them at once, and yield the arguments and the finished future of each.

    Nothing is kept of a call that was yielded, so that memory does not grow with their number.
    """
    calls = iter(arguments)
    ended: SimpleQueue[Future[Any]] = SimpleQueue()
    pending: dict[Future[Any], tuple[Any, ...]] = {}

    def submit(count: int) -> None:
        for call in islice(calls, count):
            try:
                future = executor.submit(function, *call)
            except (
                BrokenExecutor
            ) as error:  # the workers died: the calls that are left fail as those under way do
                future = Future()
                future.set_exception(error)
            pending[future] = call
            future.add_done_callback(ended.put)

    try:
        submit(IN_FLIGHT)
        while pending:
            future = ended.get()
            call = pending.pop(future)
            submit(1)
            yield call, future
            del future
    finally:
        for future in pending:
            future.cancel()
