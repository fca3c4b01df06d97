"""Run long work in a thread, polled by whichever operator started it; scripts without a window call the work directly.

The thread gets plain values and arrays, never bpy. The result of a job is dropped if a newer job of its kind has
started, or the user has cancelled it.
"""

from __future__ import annotations

import queue
import sys
import threading
from time import perf_counter
from typing import Any, Callable

from ...beyond_mocap.base.errors import UserCancelledError
from .time_left import TimeLeft

Work = Callable[[Callable[[float, str], None], Callable[[], bool], Callable[[], bool]], Any]

_newest: dict[str, "Job"] = {}
_working_threads, _count_lock = [0], threading.Lock()
_default_interval = sys.getswitchinterval()  # seconds for which a thread keeps the interpreter
# the same while work runs: Blender's drawing thread needs the interpreter a dozen times per redraw
WORK_INTERVAL = 0.0005


class Job:
    """Work of one kind ("library", "synthesis") in its own thread.

    `work(progress, cancelled, hurry)` is called there; `hurry()` becomes true when the user wants to stop with what is
    done so far. `fraction` and `text` describe the progress; once `poll()` has returned True, either `result` or
    `error` is set.
    """

    def __init__(self, kind: str, work: Work, can_end_early: bool = False):
        """Start the job; an older job of the same kind is cancelled.

        Args:
            kind: name of the kind.
            work: the function to run.
            can_end_early: whether the work can end early with what it has.
        """
        cancel_jobs(kind)
        self.kind, self.can_end_early = kind, can_end_early
        self.fraction, self.text = 0.0, ""
        self._time_left = TimeLeft(perf_counter())
        self.result, self.error, self._ended = None, None, False
        self._stop, self._end_requested, self._messages = threading.Event(), threading.Event(), queue.SimpleQueue()
        _newest[kind] = self
        threading.Thread(target=self._run_work, args=(work,), name=f"beyond-mocap {kind}", daemon=True).start()

    def poll(self) -> bool:
        """Receive what the thread has sent; return True once it has ended."""
        while not self._messages.empty():
            what, value = self._messages.get()
            if what == "progress":
                self.fraction, self.text = value
                self._time_left.add_share(self.fraction, perf_counter())
                continue
            setattr(self, what, value)
            self._ended = True
            return True
        return False

    def describe_progress(self) -> str:
        """Describe what is done now, its share and the time left, such as "Searching 41 %, about 6 s left"."""
        text = self.text[:1].upper() + self.text[1:] or "Starting"
        left = self._time_left.describe(perf_counter())
        return f"{text} {100.0 * self.fraction:.0f} %{', ' if left else ''}{left}"

    def cancel(self) -> None:
        """Ask the thread to stop; its result is dropped."""
        self._stop.set()

    def request_end(self) -> None:
        """Ask the thread to end with what it has; the second time, or where it cannot, cancel it."""
        if self.can_end_early and not self.is_ending:
            self._end_requested.set()
        else:
            self.cancel()

    @property
    def is_ending(self) -> bool:
        """Whether the thread was asked to end with what it has."""
        return self._end_requested.is_set()

    @property
    def is_ended(self) -> bool:
        """Whether `poll` has found the end."""
        return self._ended

    @property
    def is_stale(self) -> bool:
        """Whether the result is no longer wanted."""
        return self._stop.is_set() or _newest.get(self.kind) is not self

    def _send_progress(self, fraction: float, text: str) -> None:
        self._messages.put(("progress", (fraction, text)))

    def _run_work(self, work: Work) -> None:
        """Run the work in the thread, and send its result or error."""
        _count_thread(1)
        try:
            result = work(self._send_progress, self._stop.is_set, self._end_requested.is_set)
        except BaseException as error:  # passed to the main thread, which reports or raises it
            self._messages.put(("error", error))
        else:
            self._messages.put(("result", result))
        finally:
            _count_thread(-1)


def _count_thread(step: int) -> None:
    """Count one more working thread, or one less; a short switch interval is used while there is one."""
    with _count_lock:
        _working_threads[0] += step
        sys.setswitchinterval(WORK_INTERVAL if _working_threads[0] else _default_interval)


def cancel_jobs(kind: str | None = None) -> None:
    """Cancel the running job of one kind, or all."""
    for name, job in list(_newest.items()):
        if kind in (None, name):
            job.cancel()


def end_jobs() -> None:
    """End all running jobs, as ESC does: see `Job.request_end`."""
    for job in list(_newest.values()):
        job.request_end()


def is_cancelled(job: Job) -> bool:
    """Return whether an ended job was stopped by the user rather than by an error."""
    return job.is_stale or isinstance(job.error, UserCancelledError)
