"""What the user sees while a command works."""

from __future__ import annotations

import json
import sys
import threading

from ..base.errors import Cancelled


class Told:
    """What the user sees of the progress, and whether Ctrl-C was pressed."""

    def __init__(self, as_json: bool, stream=None):
        """as_json: JSON lines; otherwise a bar where `stream` (default stderr) is a terminal."""
        self._stream = stream or sys.stderr
        self._json = as_json
        self._bar = not as_json and self._stream.isatty()
        self._stop = threading.Event()
        self._last = ""

    def progress(self, fraction: float, text: str) -> None:
        """Shows how far the work is."""
        if self._json:
            print(json.dumps({"progress": round(fraction, 4), "text": text}), file=self._stream, flush=True)
        elif self._bar:
            done = int(round(30 * fraction))
            line = f"\r[{'#' * done}{'.' * (30 - done)}] {fraction:4.0%} {text[:40]:40s}"
            if line != self._last:
                print(line, end="", file=self._stream, flush=True)
                self._last = line

    def note(self, text: str) -> None:
        """Tells something that the user should know, on the stream of the progress."""
        print(json.dumps({"note": text}) if self._json else f"note: {text}", file=self._stream, flush=True)

    def end(self) -> None:
        """Clears the bar."""
        if self._last:
            print("\r" + " " * 80 + "\r", end="", file=self._stream, flush=True)
            self._last = ""

    def cancel(self) -> None:
        """Asks the work to stop."""
        self._stop.set()

    def cancelled(self) -> bool:
        """Whether the user wants out."""
        return self._stop.is_set()

    def check(self) -> None:
        """Raises Cancelled where the user wants out."""
        if self.cancelled():
            raise Cancelled("cancelled")
