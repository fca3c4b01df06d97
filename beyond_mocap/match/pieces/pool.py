"""Run pieces of work in processes of this machine, or on a Dask cluster; the results are the same wherever they run.

    for key, result in run_tasks(tasks, work, WorkerConfig(workers=2)):
        ...

Local workers are plain Python processes (joblib's loky); with a scheduler, the workers of its cluster. If a worker
dies, the pieces it had are run again by others; a piece that ends its worker every time fails alone.
"""

from __future__ import annotations

import contextlib
import logging
import os
import re
import signal
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from dataclasses import dataclass
from typing import NoReturn

from ...base.errors import BeyondMocapError, InputError, UserCancelledError
from ...base.memory import read_peak_memory
from ...base.optional_packages import import_optional
from .interrupts import block_interrupts

PIECES_PER_WORKER = 2
"""Pieces that each worker runs or has waiting: enough that none is idle, few enough to save memory."""

POLL_SECONDS = 0.2
"""s between two checks for a cancellation."""

MAX_WAIT = 60.0
"""s without any worker after which a cluster is given up."""

OFFLINE = "BEYOND_MOCAP_OFFLINE"
"""Environment variable by which a host, such as Blender, says that no other machine may be reached."""

_ANSWER_TIMEOUT = "10s"  # the longest a scheduler may take to answer
_IDLE_SECONDS = 60
"""Seconds after which a local worker without work ends: it holds up to .7 GiB while the main process works alone. One
that is started again loads the core and the cached library in two to three seconds of processor time."""
_MAX_BREAKS = 2  # breaks of the workers after which pieces run one by one

Work = Callable[..., object]
Task = tuple[object, tuple]
"""A key, and the arguments of the work."""


@dataclass(frozen=True)
class TaskFailure:
    """A piece of work that failed.

    Attributes:
        reason: why, in one line.
        exit_status: of a command that fails so.
    """

    reason: str
    exit_status: int = BeyondMocapError.exit_status


@dataclass(frozen=True, eq=False)
class TaskResult:
    """A piece of work that was run.

    Attributes:
        result: what the work returned, or a `TaskFailure`.
        memory: MB, the peak of its process so far.
        seconds: s of processor time of this piece.
    """

    result: object
    memory: float = 0.0
    seconds: float = 0.0


@dataclass(frozen=True)
class WorkerConfig:
    """Where work runs.

    Attributes:
        workers: processes on this machine; 1: this process itself.
        scheduler: address of a Dask scheduler, "" for this machine.
    Raises:
        InputError: for fewer than one worker.
    """

    workers: int = 1
    scheduler: str = ""

    def __post_init__(self):
        if self.workers < 1:
            raise InputError("workers", f"{self.workers}", "1 or more")


def check_workers(config: WorkerConfig) -> None:
    """Check that a cluster's scheduler answers, so that an error is reported before work starts; InputError
    otherwise.
    """
    if config.scheduler:
        with _connect_cluster(config.scheduler):
            pass


def start_workers(config: WorkerConfig, work: Work, arguments: tuple) -> None:
    """Start the processes of this machine, each with a piece of work whose result is not needed.

    Nothing happens where this process works alone, or a cluster does.

    Args:
        config: where the work runs.
        work: as for `run_tasks`.
        arguments: of the work.
    """
    if config.workers > 1 and not config.scheduler:
        workers = _Processes(config.workers)
        with contextlib.suppress(BrokenExecutor):  # the first piece that is waited for starts them again
            for _ in range(config.workers):
                workers.submit(work, arguments)


def run_tasks(
    tasks: Iterable[Task], work: Work, config: WorkerConfig, cancelled: Callable[[], bool] | None = None,
    report_result: Callable[[TaskResult], None] | None = None,
) -> Iterator[tuple[object, object]]:
    """Run tasks and give their results as they end, in any order.

    Args:
        tasks: (key, arguments), taken one by one when a worker is free.
        work: a function of a module, which other processes can import by name.
        config: where the work runs.
        cancelled: called now and then; True cancels the work.
        report_result: receives each `TaskResult`.
    Returns:
        An iterator over (key, result); the result is a `TaskFailure` if `work` raises. Closing it, or an error, stops
        the remaining work.
    Raises:
        UserCancelledError: soon after `cancelled` returns True.
        InputError: if the cluster does not answer, has no workers, or goes away.
    """
    is_cancelled = cancelled or (lambda: False)
    if config.scheduler:
        with _connect_cluster(config.scheduler) as client:
            yield from _report_results(_run_on_workers(iter(tasks), work, _Cluster(client), is_cancelled),
                                       report_result)
    elif config.workers == 1:
        yield from _report_results(_run_here(tasks, work, is_cancelled), report_result)
    else:
        yield from _report_results(_run_on_workers(iter(tasks), work, _Processes(config.workers), is_cancelled),
                                   report_result)


def _report_results(results: Generator[tuple[object, TaskResult], None, None],
                    report_result) -> Iterator[tuple[object, object]]:
    with contextlib.closing(results):
        for key, one in results:
            if report_result is not None:
                report_result(one)
            yield key, one.result


def run_task(work: Work, arguments: tuple) -> TaskResult:
    """Run `work` with `arguments` and measure it.

    Errors become text, because not every error can be sent to another process. Raises UserCancelledError.
    """
    started = time.process_time()
    try:
        result = work(*arguments)
    except UserCancelledError:
        raise
    except BeyondMocapError as error:
        result = TaskFailure(str(error), error.exit_status)
    except Exception as error:  # an error of one piece must not stop the others
        result = TaskFailure(" ".join(f"{type(error).__name__}: {error}".split()))
    return TaskResult(result, read_peak_memory(), time.process_time() - started)


def _run_here(tasks: Iterable[Task], work: Work, is_cancelled: Callable[[], bool]) -> Generator[tuple[object,
        TaskResult], None, None]:
    for key, arguments in tasks:
        if is_cancelled():
            raise UserCancelledError("cancelled")
        yield key, run_task(work, arguments)


def _run_on_workers(tasks: Iterator[Task], work: Work, workers, is_cancelled) -> Generator[tuple[object, TaskResult],
        None, None]:
    """Keep workers busy, give results as they end, and run lost pieces again.

    After a break all pieces that were running are run again; after several breaks pieces run one by one, so that the
    one that ends its worker is found.
    """
    repeated: deque[Task] = deque()
    running: dict[Future, Task] = {}
    breaks = 0
    try:
        while True:
            alone = breaks >= _MAX_BREAKS and bool(repeated or running)
            while (len(running) < (1 if alone else workers.find_capacity())
                   and (task := _take_next(repeated, tasks)) is not None):
                try:
                    running[workers.submit(work, task[1])] = task
                except BrokenExecutor:  # a worker ended in the meantime
                    repeated.appendleft(task)
                    break
            if not running and repeated:
                breaks += 1
                workers.restart_workers()
                continue
            if not running:
                return
            done, _ = wait(running, timeout=POLL_SECONDS, return_when=FIRST_COMPLETED)
            if is_cancelled():
                raise UserCancelledError("cancelled")
            workers.check(bool(done))
            lost = []
            for future in done:
                task = running.pop(future)
                if not _is_broken(future):
                    yield task[0], _take_result(future)
                elif alone:
                    workers.restart_workers()
                    yield task[0], TaskResult(TaskFailure("its worker process ended, possibly for lack of memory"))
                else:
                    lost.append(task)
            if lost:
                repeated.extend([*lost, *running.values()])
                running.clear()
                breaks += 1
                workers.restart_workers()
            elif not repeated and not running:
                breaks = 0
    finally:
        workers.close(running)


def _take_next(repeated: deque[Task], tasks: Iterator[Task]) -> Task | None:
    return repeated.popleft() if repeated else next(tasks, None)


def _is_broken(future: Future) -> bool:
    """Say whether the worker failed, not the work; nothing else cancels running pieces."""
    return future.cancelled() or isinstance(future.exception(), (BrokenExecutor, CancelledError))


def _take_result(future: Future) -> TaskResult:
    """Get the result of a future; an error in sending it counts as a failure of this piece."""
    try:
        return future.result()
    except Exception as error:  # such as a result that cannot be sent
        return TaskResult(
            TaskFailure(f"its worker gave no result ({' '.join(f'{type(error).__name__}: {error}'.split())[:200]})"))


class _Processes:
    """Processes of this machine."""

    shared_executor: Executor | None = None
    """The processes this program started last; they may wait for more work."""

    def __init__(self, workers: int):
        self._workers = workers
        self._executor: Executor | None = None

    def find_capacity(self) -> int:
        """Find how many pieces may run or wait at once."""
        return PIECES_PER_WORKER * self._workers

    def submit(self, work: Work, arguments: tuple) -> Future:
        """Submit a piece; processes of an earlier stage continue with what they have loaded.

        BrokenExecutor if one of them has ended.
        """
        if self._executor is None:
            loky = import_optional("joblib.externals.loky", "workers")
            # with psutil, loky replaces a worker that has grown by 300 MB: our libraries do that, and nothing is lost
            warnings.filterwarnings("ignore", message="A worker stopped while some jobs were given", module="joblib")
            self._executor = loky.get_reusable_executor(
                self._workers, timeout=_IDLE_SECONDS, reuse=True, initializer=_start_worker, initargs=(os.getpid(),),
                env={name: "1" for name in _THREADS},
            )  # fmt: skip
            _Processes.shared_executor = self._executor
        with block_interrupts():  # it may start processes
            return self._executor.submit(run_task, work, arguments)

    def check(self, has_progress: bool) -> None:
        """Do nothing: the executor reports when a process ends."""

    def close(self, running: Iterable[Future]) -> None:
        """End the processes if they still work; otherwise they wait for the next stage."""
        if any(not future.done() for future in running):
            self.restart_workers()

    def restart_workers(self) -> None:
        """End the processes after one has ended; the next piece starts new ones."""
        executor, self._executor = self._executor, None
        if executor is not None:
            executor.shutdown(wait=True, kill_workers=True)  # type: ignore[call-arg]  # loky's own


_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def _start_worker(parent: int) -> None:
    """Set up a worker: it ignores Ctrl-C, which a terminal sends to all processes of a command, and ends soon after
    the process `parent` that started it.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_exit_after_parent, args=(parent,), daemon=True).start()


def _exit_after_parent(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)


def stop_workers() -> None:
    """Stop the local processes that wait for work."""
    executor, _Processes.shared_executor = _Processes.shared_executor, None
    if executor is not None:
        executor.shutdown(wait=True, kill_workers=True)  # type: ignore[call-arg]  # loky's own


class _Cluster:
    """The workers of a Dask cluster."""

    def __init__(self, client):
        self._client = client
        self._executor = client.get_executor(pure=False)
        self._checked_time, self._capacity, self._progress_time = -MAX_WAIT, PIECES_PER_WORKER, time.monotonic()

    def find_capacity(self) -> int:
        """Find how many pieces may run or wait at once; workers may come and go."""
        if time.monotonic() - self._checked_time > 1.0:
            self._checked_time, self._capacity = time.monotonic(), PIECES_PER_WORKER * max(self._count_threads(), 1)
        return self._capacity

    def submit(self, work: Work, arguments: tuple) -> Future:
        """Submit a piece; InputError if the scheduler is gone."""
        try:
            return self._executor.submit(run_task, work, arguments)
        except Exception:  # a client without a scheduler raises various errors
            return self.restart_workers()

    def check(self, has_progress: bool) -> None:
        """Raise InputError if there has been no worker for too long."""
        if has_progress or self._count_threads():
            self._progress_time = time.monotonic()
        elif time.monotonic() - self._progress_time > MAX_WAIT:
            raise InputError("scheduler", f"no worker for {MAX_WAIT:g} s", "a worker", "start 'dask worker ADDRESS'")

    def restart_workers(self) -> NoReturn:
        """Raise InputError: a cluster restarts its workers itself, so lost pieces mean that its scheduler is gone."""
        what = "start it and the command again; finished work is kept"
        raise InputError("scheduler", "the scheduler has stopped", "a running scheduler", what)

    def close(self, running: Iterable[Future]) -> None:
        """Cancel the pieces that are no longer needed."""
        for future in running:
            future.cancel()

    def _count_threads(self) -> int:
        with contextlib.suppress(Exception):  # a scheduler that is gone raises various errors
            if self._client.status == "running":
                return sum(worker["nthreads"] for worker in self._client.scheduler_info()["workers"].values())
        return 0


def _is_loopback(address: str) -> bool:
    """Return whether a scheduler's address is on this machine."""
    return bool(re.fullmatch(r"(\w+://)?(localhost|127(\.\d{1,3}){3}|\[::1\])(:\d+)?/?", address))


@contextlib.contextmanager
def _connect_cluster(address: str) -> Iterator[object]:
    """Connect to the scheduler at `address`; InputError if it does not answer, if Dask is not installed, or if it is on
    another machine and the host does not allow online access.
    """
    if os.environ.get(OFFLINE) and not _is_loopback(address):
        raise InputError("scheduler", f"{address} is on another machine, and Blender is offline", "online access",
                         "set Allow Online Access in Preferences > System, or start blender with --online-mode")
    distributed = import_optional("distributed", "scheduler")
    for name in [one for one in logging.root.manager.loggerDict if one.split(".")[0] == "distributed"]:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)  # errors are reported here, in one line
    try:
        client = distributed.Client(address, timeout=_ANSWER_TIMEOUT, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        found = f"{address} does not answer ({' '.join(str(error).split())[:120]})"
        expected = "the address of a Dask scheduler, such as tcp://127.0.0.1:8786"
        raise InputError("scheduler", found, expected, "start one with 'dask scheduler'") from None
    try:
        yield client
    finally:
        with contextlib.suppress(Exception):  # closing fails if the scheduler is gone
            client.close(timeout=2)
