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

import bpy

from ...beyond_mocap.base.errors import BeyondMocapError, UserCancelledError

POLL_SECONDS = 0.1  # s between two checks for a cancellation
STOP_TIMEOUT = 60.0  # s that a cancelled process has to stop
FINAL_WAIT = 3.0  # s to wait for last lines after its end: workers may hold its pipe open
ERROR_PREFIX = "beyond-mocap: "
"""Start of the command's own error lines."""

_running: set[subprocess.Popen] = set()


def run_command(arguments: list[str], progress: Callable[[float, str], None],
                cancelled: Callable[[], bool]) -> list[str]:
    """Run `beyond-mocap ARGUMENTS --json`, in any thread.

    Args:
        arguments: of the command line.
        progress: receives the share done and a text.
        cancelled: called now and then; True cancels the work.
    Returns:
        Its notes.
    Raises:
        UserCancelledError: if `cancelled` returned True and the process has ended; finished work is kept.
        BeyondMocapError: with the command's message, if it ended otherwise.
    """
    while _running:  # a cancelled process is still stopping
        progress(0.0, "waiting for the cancelled run to stop")
        if cancelled():
            raise UserCancelledError("cancelled")
        time.sleep(POLL_SECONDS)
    command = [sys.executable, "-m", "beyond_mocap", *arguments, "--json"]
    return run_process(command, progress, cancelled, subject="the match process", environment=_build_environment())


def run_process(command: list[str], progress: Callable[[float, str], None], cancelled: Callable[[], bool], *,
                subject: str, environment: dict[str, str] | None = None) -> list[str]:
    """Run a process that writes its progress as JSON lines to stderr, in any thread.

    Args:
        command: program and arguments.
        progress: receives the share done and a text.
        cancelled: called now and then; True cancels the work.
        subject: what it is, for messages.
        environment: its environment variables; None for those of this process.
    Returns:
        Its notes.
    Raises:
        UserCancelledError: if `cancelled` returned True and the process has ended.
        BeyondMocapError: with its message, if it ended otherwise.
    """
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                               text=True, encoding="utf-8", errors="replace", env=environment, **_build_group_options())
    _running.add(process)
    try:
        notes, last, is_stopped = _follow_process(process, progress, cancelled)
    finally:
        _stop_process(process)  # if reading stopped before the process ended
        _running.discard(process)
    if process.returncode == 0:
        return notes
    if is_stopped or process.returncode == UserCancelledError.exit_status:
        raise UserCancelledError("cancelled; finished work is kept, and the next run resumes there")
    ended = f"{subject} ended with status {process.returncode}"
    error = BeyondMocapError(last.removeprefix(ERROR_PREFIX) or ended)
    error.exit_status = process.returncode if process.returncode > 0 else error.exit_status
    raise error


def stop_all() -> None:
    """Ask all such processes to stop, when the extension is disabled."""
    for process in list(_running):
        _stop_process(process)


def _follow_process(process, progress, cancelled) -> tuple[list[str], str, bool]:
    """Follow a process to its end; return its notes, its last other line (its own error, if any), and whether it was
    stopped.
    """
    lines: queue.SimpleQueue = queue.SimpleQueue()
    threading.Thread(target=_read_lines, args=(process.stderr, lines), daemon=True).start()
    notes, last, stop_time, end_time = [], "", None, None  # stop time and end time, by the clock
    while True:
        line = _read_next_line(lines)
        now = time.monotonic()
        end_time = now if end_time is None and process.poll() is not None else end_time
        if line is None or (not line and end_time is not None and now - end_time > FINAL_WAIT):
            process.wait()
            return notes, last, stop_time is not None
        values = _parse_line(line)
        if values is None:
            last = line.strip() or last if line.startswith(ERROR_PREFIX) or not last.startswith(ERROR_PREFIX) else last
        elif "note" in values:
            notes.append(str(values["note"]))
        elif stop_time is None:
            progress(float(values.get("progress", 0.0)), str(values.get("text", "")))
        if stop_time is None and cancelled():
            _stop_process(process)
            stop_time = now
        elif stop_time is not None and now - stop_time > STOP_TIMEOUT:
            process.kill()


def _read_next_line(lines: queue.SimpleQueue) -> str | None:
    """Read the next line; "" if none arrives in time, None at the end."""
    try:
        return lines.get(timeout=POLL_SECONDS)
    except queue.Empty:
        return ""


def _read_lines(stream, lines) -> None:
    """Read every line of a stream, then None; close the stream here, because nothing else may while it is read."""
    with stream:
        for line in stream:
            lines.put(line)
    lines.put(None)


def _parse_line(line: str) -> dict | None:
    """Parse a progress line of the command; None for any other line."""
    if not line.startswith("{"):
        return None
    try:
        return json.loads(line)
    except ValueError:
        return None


def _build_environment() -> dict[str, str]:
    """Build the environment in which a plain Python finds the core and its dependencies where Blender found them."""
    core = Path(__file__).resolve().parents[2]
    paths = [str(core), *(path for path in sys.path if path and os.path.isdir(path))]
    allowed = bpy.app.online_access  # the user's choice in the preferences; a constant that any thread may read
    added = {"PYTHONPATH": os.pathsep.join(dict.fromkeys(paths)), "PYTHONSAFEPATH": "1", "PYTHONDONTWRITEBYTECODE": "1",
             "BEYOND_MOCAP_OFFLINE": "" if allowed else "1"}
    return os.environ | added


def _build_group_options() -> dict:
    """Build the options of a separate process group: Windows interrupts whole groups."""
    return {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP} if os.name == "nt" else {}


def _stop_process(process: subprocess.Popen) -> None:
    """Ask a process to stop, as Ctrl-C would."""
    if process.poll() is None:
        process.send_signal(signal.CTRL_BREAK_EVENT if os.name == "nt" else signal.SIGINT)
