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

from ...beyond_mocap.errors import BeyondMocapError, Cancelled

LOOK = 0.1  # seconds between two looks whether somebody wants out
PATIENCE = 60.0  # seconds that a cancelled process has to come to its end
_running: set[subprocess.Popen] = set()


def run(arguments: list[str], progress: Callable[[float, str], None], cancelled: Callable[[], bool]) -> list[str]:
    """Runs `beyond-mocap ARGUMENTS --json` and returns its notes; in any thread.

    Cancelled: somebody wanted out, and it has ended; what was finished is kept. BeyondMocapError: what the command told
    when it ended otherwise.
    """
    while _running:  # one that was cancelled comes to its end
        progress(0.0, "waiting for what was cancelled to end")
        if cancelled():
            raise Cancelled("cancelled")
        time.sleep(LOOK)
    process = subprocess.Popen(
        [sys.executable, "-m", "beyond_mocap", *arguments, "--json"],
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, encoding="utf-8",
        errors="replace", env=_surroundings(), **_own_group(),
    )
    _running.add(process)
    try:
        notes, last, asked = _heard(process, progress, cancelled)
    finally:
        process.stderr.close()
        _running.discard(process)
    if process.returncode == 0:
        return notes
    if asked or process.returncode == Cancelled.exit_status:
        raise Cancelled("cancelled; what was finished is kept, and the next run goes on there")
    ended = f"the process that makes the match ended with status {process.returncode}"
    raise BeyondMocapError(last.removeprefix("beyond-mocap: ") or ended)


def end_all() -> None:
    """Asks all such processes to end; for the moment in which the extension is switched off."""
    for process in list(_running):
        _interrupt(process)


def _heard(process, progress, cancelled) -> tuple[list[str], str, bool]:
    """Follow a process to its end: its notes, its last other line, and whether it was asked to stop."""
    lines: queue.SimpleQueue = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(process.stderr, lines), daemon=True).start()
    notes, last, waited = [], "", None
    while True:
        try:
            line = lines.get(timeout=LOOK)
        except queue.Empty:
            line = ""
        if line is None:
            process.wait()
            return notes, last, waited is not None
        told = _told(line)
        if told is None:
            last = line.strip() or last
        elif "note" in told:
            notes.append(str(told["note"]))
        elif waited is None:
            progress(float(told.get("progress", 0.0)), str(told.get("text", "")))
        if waited is None and cancelled():
            _interrupt(process)
            waited = 0.0
        elif waited is not None:
            waited += LOOK
            if waited > PATIENCE:
                process.kill()


def _listen(stream, lines) -> None:
    """Every line of a stream, then None."""
    try:
        for line in stream:
            lines.put(line)
    except ValueError:  # closed meanwhile
        pass
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
