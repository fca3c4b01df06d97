"""Long work in a thread, polled by whoever started it. Scripts and farms, which have no window, call the work itself.

The thread sees plain values and arrays, never bpy. When a newer job of its kind has started, or the user has cancelled,
what a job brings is dropped.
"""

from __future__ import annotations

import queue
import sys
import threading
from typing import Any, Callable

from ...beyond_mocap.base.errors import Cancelled

Work = Callable[[Callable[[float, str], None], Callable[[], bool], Callable[[], bool]], Any]

_newest: dict[str, "Job"] = {}
_working, _counting = [0], threading.Lock()
_usual = sys.getswitchinterval()  # seconds for which a thread keeps the interpreter to itself
POLITE = 0.0005  # the same while work runs: Blender's own thread, which draws, asks for it a dozen times a picture


class Job:
    """Work of one kind ("library", "synthesis") in a thread of its own.

    `work(progress, cancelled, hurry)` is called there; `hurry()` turns true when the user wants an end and what is
    there by then. `fraction` and `text` say how far it is; after `poll()` has returned True either `result` or `error`
    is set."""

    def __init__(self, kind: str, work: Work, keeps: bool = False):
        """Starts at once and takes the place of an older job of the same kind, which is cancelled. keeps: whether the
        work can come to an early end with what it has."""
        stop(kind)
        self.kind, self.keeps = kind, keeps
        self.fraction, self.text = 0.0, ""
        self.result, self.error, self._ended = None, None, False
        self._stop, self._soon, self._news = threading.Event(), threading.Event(), queue.SimpleQueue()
        _newest[kind] = self
        threading.Thread(target=self._run, args=(work,), name=f"beyond-mocap {kind}", daemon=True).start()

    def poll(self) -> bool:
        """Take in what the thread has sent; True once it has ended."""
        while not self._news.empty():
            what, value = self._news.get()
            if what == "progress":
                self.fraction, self.text = value
                continue
            setattr(self, what, value)
            self._ended = True
            return True
        return False

    def cancel(self) -> None:
        """Ask the thread to stop; its result will be dropped."""
        self._stop.set()

    def end(self) -> None:
        """Ask the thread to come to an end with what it has; asked again, or where it keeps nothing, cancel it."""
        if self.keeps and not self.ending:
            self._soon.set()
        else:
            self.cancel()

    @property
    def ending(self) -> bool:
        """Whether it has been asked to come to an end with what it has."""
        return self._soon.is_set()

    @property
    def ended(self) -> bool:
        """Whether `poll` has found its end."""
        return self._ended

    @property
    def stale(self) -> bool:
        """Whether nobody waits for this job's result any more."""
        return self._stop.is_set() or _newest.get(self.kind) is not self

    def _tell(self, fraction: float, text: str) -> None:
        self._news.put(("progress", (fraction, text)))

    def _run(self, work: Work) -> None:
        _work(1)
        try:
            result = work(self._tell, self._stop.is_set, self._soon.is_set)
        except BaseException as error:  # carried to the main thread, which reports or raises it
            self._news.put(("error", error))
        else:
            self._news.put(("result", result))
        finally:
            _work(-1)


def _work(step: int) -> None:
    """Count one more thread at work, or one less; threads are polite as long as there is one."""
    with _counting:
        _working[0] += step
        sys.setswitchinterval(POLITE if _working[0] else _usual)


def stop(kind: str | None = None) -> None:
    """Cancel the running job of one kind, or all."""
    for name, job in list(_newest.items()):
        if kind in (None, name):
            job.cancel()


def end() -> None:
    """What ESC does, to all running jobs: see `Job.end`."""
    for job in list(_newest.values()):
        job.end()


def cancelled(job: Job) -> bool:
    """Whether an ended job was stopped by the user rather than by trouble."""
    return job.stale or isinstance(job.error, Cancelled)
