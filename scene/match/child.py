"""The command line in a process of its own: plain Python on the core, beside Blender.

Functions of an extension cannot be sent to another process, and Blender's window must stay alive; so a match is made by
the verb that scripts use, and what it tells of its progress is passed on.
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

LOOK = 0.1  # seconds between two looks whether somebody wants out
PATIENCE = 60.0  # seconds that a cancelled process has to come to its end
SILENCE = 3.0  # seconds after its end for which its last words are waited for: workers may hold its pipe open
OWN = "beyond-mocap: "
"""What the command's own lines about trouble begin with."""

_running: set[subprocess.Popen] = set()


def run(arguments: list[str], progress: Callable[[float, str], None], cancelled: Callable[[], bool]) -> list[str]:
    """Runs `beyond-mocap ARGUMENTS --json` and returns its notes; in any thread.

    Cancelled: somebody wanted out, and it has ended; what was finished is kept. BeyondMocapError: what the command told
    when it ended otherwise."""
    while _running:  # one that was cancelled comes to its end
        progress(0.0, "waiting for what was cancelled to end")
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
        _interrupt(process)  # where something else than its end ended the listening
        _running.discard(process)
    if process.returncode == 0:
        return notes
    if asked or process.returncode == Cancelled.exit_status:
        raise Cancelled("cancelled; what was finished is kept, and the next run goes on there")
    ended = f"the process that makes the match ended with status {process.returncode}"
    trouble = BeyondMocapError(last.removeprefix(OWN) or ended)
    trouble.exit_status = process.returncode if process.returncode > 0 else trouble.exit_status
    raise trouble


def end_all() -> None:
    """Asks all such processes to end; for the moment in which the extension is switched off."""
    for process in list(_running):
        _interrupt(process)


def _heard(process, progress, cancelled) -> tuple[list[str], str, bool]:
    """Follow a process to its end: its notes, what it said last beside them (its own trouble, where it told some), and
    whether it was asked to stop."""
    lines: queue.SimpleQueue = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(process.stderr, lines), daemon=True).start()
    notes, last, asked, ended = [], "", None, None  # asked, ended: when, by the clock
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
    """The next line; empty where none comes for a while, None at their end."""
    try:
        return lines.get(timeout=LOOK)
    except queue.Empty:
        return ""


def _listen(stream, lines) -> None:
    """Every line of a stream, then None; it closes the stream, since nobody else may while it reads."""
    with stream:
        for line in stream:
            lines.put(line)
    lines.put(None)


def _told(line: str) -> dict | None:
    """What a line of the command's progress says; None where it is another line."""
    if not line.startswith("{"):
        return None
    try:
        return json.loads(line)
    except ValueError:
        return None


def _surroundings() -> dict[str, str]:
    """The environment in which a plain Python finds the core, and what it needs, where Blender found them."""
    core = Path(__file__).resolve().parents[2]
    paths = [str(core), *(path for path in sys.path if path and os.path.isdir(path))]
    ours = {"PYTHONPATH": os.pathsep.join(dict.fromkeys(paths)), "PYTHONSAFEPATH": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    return os.environ | ours


def _own_group() -> dict:
    """Windows interrupts whole groups of processes: this one is a group of its own."""
    return {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP} if os.name == "nt" else {}


def _interrupt(process: subprocess.Popen) -> None:
    """Ask it to stop, as Ctrl-C would."""
    if process.poll() is None:
        process.send_signal(signal.CTRL_BREAK_EVENT if os.name == "nt" else signal.SIGINT)
