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
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from dataclasses import dataclass
from typing import NoReturn

from ...base.errors import BeyondMocapError, Cancelled, InputError

AHEAD = 2
"""Pieces that each worker runs or has waiting: enough that none is idle, few enough to save memory."""

POLL = 0.2
"""s between two checks for a cancellation."""

PATIENCE = 60.0
"""s without any worker after which a cluster is given up."""

_ANSWERS = "10s"  # the longest a scheduler may take to answer
_IDLE = 60  # s after which a local worker without work ends
_BREAKS = 2  # breaks of the workers after which pieces run one by one

Work = Callable[..., object]
Task = tuple[object, tuple]
"""A key, and the arguments of the work."""


@dataclass(frozen=True)
class Failed:
    """A piece of work that failed.

    Attributes:
        reason: why, in one line.
    """

    reason: str


@dataclass(frozen=True, eq=False)
class Done:
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
class Workplace:
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


def check_place(place: Workplace) -> None:
    """Check that a cluster's scheduler answers, so that an error is reported before work starts; InputError
    otherwise.
    """
    if place.scheduler:
        with _cluster(place.scheduler):
            pass


def run(
    tasks: Iterable[Task], work: Work, place: Workplace, cancelled: Callable[[], bool] | None = None,
    spent: Callable[[Done], None] | None = None,
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
        Cancelled: soon after `cancelled` returns True.
        InputError: if the cluster does not answer, has no workers, or goes away.
    """
    stop = cancelled or (lambda: False)
    if place.scheduler:
        with _cluster(place.scheduler) as client:
            yield from _told(_spread(iter(tasks), work, _Cluster(client), stop), spent)
    elif place.workers == 1:
        yield from _told(_here(tasks, work, stop), spent)
    else:
        yield from _told(_spread(iter(tasks), work, _Processes(place.workers), stop), spent)


def _told(done: Generator[tuple[object, Done], None, None], spent) -> Iterator[tuple[object, object]]:
    with contextlib.closing(done):
        for key, one in done:
            if spent is not None:
                spent(one)
            yield key, one.result


def attempt(work: Work, arguments: tuple) -> Done:
    """Run `work` with `arguments` and measure it.

    Errors become text, because not every error can be sent to another process. Raises Cancelled.
    """
    begun = time.process_time()
    try:
        result = work(*arguments)
    except Cancelled:
        raise
    except BeyondMocapError as error:
        result = Failed(str(error))
    except Exception as error:  # an error of one piece must not stop the others
        result = Failed(" ".join(f"{type(error).__name__}: {error}".split()))
    return Done(result, peak_memory(), time.process_time() - begun)


def peak_memory() -> float:
    """Measure the peak memory of this process in MB; 0 where the system does not provide it (Windows)."""
    try:
        import resource
    except ImportError:
        return 0.0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform == "darwin" else 1024.0)


def _here(tasks: Iterable[Task], work: Work, stop: Callable[[], bool]) -> Generator[tuple[object, Done], None, None]:
    for key, arguments in tasks:
        if stop():
            raise Cancelled("cancelled")
        yield key, attempt(work, arguments)


def _spread(tasks: Iterator[Task], work: Work, place, stop) -> Generator[tuple[object, Done], None, None]:
    """Keep workers busy, give results as they end, and run lost pieces again.

    After a break all pieces that were running are run again; after several breaks pieces run one by one, so that the
    one that ends its worker is found.
    """
    again: deque[Task] = deque()
    going: dict[Future, Task] = {}
    breaks = 0
    try:
        while True:
            alone = breaks >= _BREAKS and bool(again or going)
            while len(going) < (1 if alone else place.room()) and (task := _next(again, tasks)) is not None:
                try:
                    going[place.submit(work, task[1])] = task
                except BrokenExecutor:  # a worker ended in the meantime
                    again.appendleft(task)
                    break
            if not going and again:
                breaks += 1
                place.renew()
                continue
            if not going:
                return
            done, _ = wait(going, timeout=POLL, return_when=FIRST_COMPLETED)
            if stop():
                raise Cancelled("cancelled")
            place.check(bool(done))
            lost = []
            for future in done:
                task = going.pop(future)
                if not _is_broken(future):
                    yield task[0], _result(future)
                elif alone:
                    place.renew()
                    yield task[0], Done(Failed("its worker process ended, possibly for lack of memory"))
                else:
                    lost.append(task)
            if lost:
                again.extend([*lost, *going.values()])
                going.clear()
                breaks += 1
                place.renew()
            elif not again and not going:
                breaks = 0
    finally:
        place.close(going)


def _next(again: deque[Task], tasks: Iterator[Task]) -> Task | None:
    return again.popleft() if again else next(tasks, None)


def _is_broken(future: Future) -> bool:
    """Say whether the worker failed, not the work; nothing else cancels running pieces."""
    return future.cancelled() or isinstance(future.exception(), (BrokenExecutor, CancelledError))


def _result(future: Future) -> Done:
    """Get the result of a future; an error in sending it counts as a failure of this piece."""
    try:
        return future.result()
    except Exception as error:  # such as a result that cannot be sent
        return Done(Failed(f"its worker gave no result ({' '.join(f'{type(error).__name__}: {error}'.split())[:200]})"))


class _Processes:
    """Processes of this machine."""

    started: Executor | None = None
    """The processes this program started last; they may wait for more work."""

    def __init__(self, workers: int):
        self._workers = workers
        self._executor: Executor | None = None

    def room(self) -> int:
        """Find how many pieces may run or wait at once."""
        return AHEAD * self._workers

    def submit(self, work: Work, arguments: tuple) -> Future:
        """Submit a piece; processes of an earlier stage continue with what they have loaded.

        BrokenExecutor if one of them has ended.
        """
        if self._executor is None:
            from joblib.externals.loky import get_reusable_executor

            self._executor = get_reusable_executor(
                self._workers, timeout=_IDLE, reuse=True, initializer=_follow, initargs=(os.getpid(),),
                env={name: "1" for name in _THREADS},
            )  # fmt: skip
            _Processes.started = self._executor
        return self._executor.submit(attempt, work, arguments)

    def check(self, moved: bool) -> None:
        """Do nothing: the executor reports when a process ends."""

    def close(self, going: Iterable[Future]) -> None:
        """End the processes if they still work; otherwise they wait for the next stage."""
        if any(not future.done() for future in going):
            self.renew()

    def renew(self) -> None:
        """End the processes after one has ended; the next piece starts new ones."""
        executor, self._executor = self._executor, None
        if executor is not None:
            executor.shutdown(wait=True, kill_workers=True)  # type: ignore[call-arg]  # loky's own


_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def _follow(parent: int) -> None:
    """Set up a worker: it ignores Ctrl-C, which a terminal sends to all processes of a command, and ends soon after
    the process `parent` that started it.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_after, args=(parent,), daemon=True).start()


def _end_after(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)


def ended() -> None:
    """Stop the local processes that wait for work."""
    executor, _Processes.started = _Processes.started, None
    if executor is not None:
        executor.shutdown(wait=True, kill_workers=True)  # type: ignore[call-arg]  # loky's own


class _Cluster:
    """The workers of a Dask cluster."""

    def __init__(self, client):
        self._client = client
        self._executor = client.get_executor(pure=False)
        self._looked, self._room, self._moved = -PATIENCE, AHEAD, time.monotonic()

    def room(self) -> int:
        """Find how many pieces may run or wait at once; workers may come and go."""
        if time.monotonic() - self._looked > 1.0:
            self._looked, self._room = time.monotonic(), AHEAD * max(self._threads(), 1)
        return self._room

    def submit(self, work: Work, arguments: tuple) -> Future:
        """Submit a piece; InputError if the scheduler is gone."""
        try:
            return self._executor.submit(attempt, work, arguments)
        except Exception:  # a client without a scheduler raises various errors
            return self.renew()

    def check(self, moved: bool) -> None:
        """Raise InputError if there has been no worker for too long."""
        if moved or self._threads():
            self._moved = time.monotonic()
        elif time.monotonic() - self._moved > PATIENCE:
            raise InputError("scheduler", f"no worker for {PATIENCE:g} s", "a worker", "start 'dask worker ADDRESS'")

    def renew(self) -> NoReturn:
        """Raise InputError: a cluster restarts its workers itself, so lost pieces mean that its scheduler is gone."""
        what = "start it and the command again; finished work is kept"
        raise InputError("scheduler", "the scheduler has stopped", "a running scheduler", what)

    def close(self, going: Iterable[Future]) -> None:
        """Cancel the pieces that are no longer needed."""
        for future in going:
            future.cancel()

    def _threads(self) -> int:
        with contextlib.suppress(Exception):  # a scheduler that is gone raises various errors
            if self._client.status == "running":
                return sum(worker["nthreads"] for worker in self._client.scheduler_info()["workers"].values())
        return 0


@contextlib.contextmanager
def _cluster(address: str) -> Iterator[object]:
    """Connect to the scheduler at `address`; InputError if it does not answer, or Dask is not installed."""
    try:
        from distributed import Client
    except ImportError as error:
        raise InputError("scheduler", f"Dask cannot be imported ({error})", "dask and distributed",
                         "pip install 'beyond-mocap[cluster]'") from None  # fmt: skip
    for name in [one for one in logging.root.manager.loggerDict if one.split(".")[0] == "distributed"]:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)  # errors are reported here, in one line
    try:
        client = Client(address, timeout=_ANSWERS, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        found = f"{address} does not answer ({' '.join(str(error).split())[:120]})"
        expected = "the address of a Dask scheduler, such as tcp://127.0.0.1:8786"
        raise InputError("scheduler", found, expected, "start one with 'dask scheduler'") from None
    try:
        yield client
    finally:
        with contextlib.suppress(Exception):  # closing fails if the scheduler is gone
            client.close(timeout=2)
