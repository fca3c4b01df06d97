"""Run the command line in its own process: plain Python on the core, beside Blender.

Functions of an extension cannot be sent to another process, and Blender's window must stay responsive. So a match is
synthesized by the command that scripts use, and its progress is passed on.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

from ...beyond_mocap.base.errors import BeyondMocapError, Cancelled

LOOK = 0.1  # s between two checks for a cancellation
PATIENCE = 60.0  # s that a cancelled process has to stop
SILENCE = 3.0  # s to wait for last lines after its end: workers may hold its pipe open
OWN = "beyond-mocap: "
"""Start of the command's own error lines."""

_running: set[subprocess.Popen] = set()


def run(arguments: list[str], progress: Callable[[float, str], None], cancelled: Callable[[], bool]) -> list[str]:
    """Run `beyond-mocap ARGUMENTS --json`, in any thread.

    Args:
        arguments: of the command line.
        progress: receives the share done and a text.
        cancelled: called now and then; True cancels the work.
    Returns:
        Its notes.
    Raises:
        Cancelled: if `cancelled` returned True and the process has ended; finished work is kept.
        BeyondMocapError: with the command's message, if it ended otherwise.
    """
    while _running:  # a cancelled process is still stopping
        progress(0.0, "waiting for the cancelled run to stop")
        if cancelled():
            raise Cancelled("cancelled")
        time.sleep(LOOK)
    process = subprocess.Popen([sys.executable, "-m", "beyond_mocap", *arguments, "--json"], stdin=subprocess.DEVNULL,
                               stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, encoding="utf-8",
                               errors="replace", env=_surroundings(), **_own_group())
    _running.add(process)
    try:
        notes, last, asked = _heard(process, progress, cancelled)
    finally:
        _interrupt(process)  # if reading stopped before the process ended
        _running.discard(process)
    if process.returncode == 0:
        return notes
    if asked or process.returncode == Cancelled.exit_status:
        raise Cancelled("cancelled; finished work is kept, and the next run resumes there")
    ended = f"the match process ended with status {process.returncode}"
    trouble = BeyondMocapError(last.removeprefix(OWN) or ended)
    trouble.exit_status = process.returncode if process.returncode > 0 else trouble.exit_status
    raise trouble


def end_all() -> None:
    """Ask all such processes to stop, when the extension is disabled."""
    for process in list(_running):
        _interrupt(process)


def _heard(process, progress, cancelled) -> tuple[list[str], str, bool]:
    """Follow a process to its end; return its notes, its last other line (its own error, if any), and whether it was
    stopped.
    """
    lines: queue.SimpleQueue = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(process.stderr, lines), daemon=True).start()
    notes, last, asked, ended = [], "", None, None  # stop time and end time, by the clock
    while True:
        line = _next(lines)
        now = time.monotonic()
        ended = now if ended is None and process.poll() is not None else ended
        if line is None or (not line and ended is not None and now - ended > SILENCE):
            process.wait()
            return notes, last, asked is not None
        told = _told(line)
        if told is None:
            last = line.strip() or last if line.startswith(OWN) or not last.startswith(OWN) else last
        elif "note" in told:
            notes.append(str(told["note"]))
        elif asked is None:
            progress(float(told.get("progress", 0.0)), str(told.get("text", "")))
        if asked is None and cancelled():
            _interrupt(process)
            asked = now
        elif asked is not None and now - asked > PATIENCE:
            process.kill()


def _next(lines: queue.SimpleQueue) -> str | None:
    """Read the next line; "" if none arrives in time, None at the end."""
    try:
        return lines.get(timeout=LOOK)
    except queue.Empty:
        return ""


def _listen(stream, lines) -> None:
    """Read every line of a stream, then None; close the stream here, because nothing else may while it is read."""
    with stream:
        for line in stream:
            lines.put(line)
    lines.put(None)


def _told(line: str) -> dict | None:
    """Parse a progress line of the command; None for any other line."""
    if not line.startswith("{"):
        return None
    try:
        return json.loads(line)
    except ValueError:
        return None


def _surroundings() -> dict[str, str]:
    """Build the environment in which a plain Python finds the core and its dependencies where Blender found them."""
    core = Path(__file__).resolve().parents[2]
    paths = [str(core), *(path for path in sys.path if path and os.path.isdir(path))]
    ours = {"PYTHONPATH": os.pathsep.join(dict.fromkeys(paths)), "PYTHONSAFEPATH": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    return os.environ | ours


def _own_group() -> dict:
    """Build the options of a separate process group: Windows interrupts whole groups."""
    return {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP} if os.name == "nt" else {}


def _interrupt(process: subprocess.Popen) -> None:
    """Ask a process to stop, as Ctrl-C would."""
    if process.poll() is None:
        process.send_signal(signal.CTRL_BREAK_EVENT if os.name == "nt" else signal.SIGINT)
