"""Keep a terminal's Ctrl-C from processes that are being started.

A terminal sends it to all processes of a command. One that is still loading Python would print a traceback: it
sets what signals do only later.
"""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Iterator
from multiprocessing import resource_tracker


@contextlib.contextmanager
def block_interrupts() -> Iterator[None]:
    """Context manager: processes and threads that this thread starts have Ctrl-C blocked from their first moment.

    One that arrives for this thread in the meantime is delivered at the end. Where the system has no such masks
    (Windows), nothing happens.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # starting it later would unblock the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
