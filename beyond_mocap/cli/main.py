"""The command line: `python -m beyond_mocap VERB ...`; Blender's command and batch script use the same parser.

Exit status: 0 done; 2 the command line or an input is wrong; 3 asked for something the library cannot do; 130
cancelled. What is wrong stands in one line on stderr. See the project's README for examples.
"""

from __future__ import annotations

import argparse
import re
import signal
import sys
import threading
from collections.abc import Callable, Mapping

from .. import __version__
from ..base.errors import BeyondMocapError, Cancelled, InputError
from .convert import add_mirror, add_retarget, add_stream
from .library import add_library
from .matching import add_match, add_touches
from .outputs import Told, Writer
from .passing import add_passes
from .reconstructing import add_reconstruct, add_release
from .ride_path import add_path
from .study import add_study
from .synthesize import add_evaluate, add_synthesize
from .throwing import add_throw

VERBS = (add_library, add_synthesize, add_path, add_touches, add_stream, add_passes, add_reconstruct, add_release,
         add_throw, add_match, add_study, add_mirror, add_retarget, add_evaluate)  # fmt: skip
"""What adds a verb, in the order of `--help`; each gets the sub-parsers and returns its parser."""
Apart = Callable[[list[str], Callable[[float, str], None], Callable[[], bool]], object]
"""Runs arguments, reports its progress, and is asked whether to stop."""


class OneLineParser(argparse.ArgumentParser):
    """A parser whose errors are one line, with status 2."""

    def __init__(self, *args, **more):
        super().__init__(*args, **more)
        self._negative_number_matcher = re.compile(r"-\.?\d")  # as from Python 3.14 on: -10,2,1 is no option

    def error(self, message: str):
        """Raises the message as an InputError."""
        raise InputError(self.prog, message, "", f"see '{self.prog} --help'")


def parser(prog: str = "beyond-mocap") -> argparse.ArgumentParser:
    """The parser of all verbs."""
    top = OneLineParser(prog=prog, description="From tracks, a few words and motion capture to moving bodies.")
    top.add_argument("--version", action="version", version=f"beyond-mocap {__version__}")
    verbs = top.add_subparsers(dest="verb", required=True, metavar="VERB", parser_class=OneLineParser)
    for add in VERBS:
        add(verbs).add_argument("--json", action="store_true", help="progress as JSON lines on stderr")
    return top


def main(
    argv: list[str] | None = None, writers: Mapping[str, Writer] | None = None, prog: str = "beyond-mocap",
    apart: Apart | None = None,
) -> int:  # fmt: skip
    """Runs one command and returns its exit status.

    writers: by suffix, further kinds of `--out` (Blender's). apart: runs a command line in a process of its own, where
    this one cannot send work to others, as within Blender."""
    told = None
    _escape(sys.stdout)
    try:
        argv = sys.argv[1:] if argv is None else argv
        options = parser(prog).parse_args(argv)
        options.argv, options.apart = argv, apart
        told = Told(options.json)
        with _interrupts(told):
            options.run(options, told, writers or {})
        return 0
    except BeyondMocapError as error:
        status, text = error.exit_status, str(error)
    except KeyboardInterrupt:
        status, text = Cancelled.exit_status, "cancelled"
    except OSError as error:
        place = error.filename or prog
        status, text = 2, f"{place}: {error.strerror or error}; check that the file can be read and its folder written"
    except SystemExit as done:  # --help and --version
        return int(done.code or 0)
    if told is not None:
        told.end()
    print(text if text.startswith(prog) else f"{prog}: {text}", file=sys.stderr)
    return status


def _escape(stream) -> None:
    """Lets a stream write what its encoding lacks as escapes instead of raising: names on a foreign console."""
    if getattr(stream, "errors", None) == "strict" and hasattr(stream, "reconfigure"):
        stream.reconfigure(errors="backslashreplace")


class _interrupts:
    """While it lasts, Ctrl-C, or a farm's request to end (SIGTERM), asks the work to stop instead of breaking it off;
    the second one breaks it off. Outside the main thread nothing is done."""

    def __init__(self, told: Told):
        self._told, self._before = told, {}

    def __enter__(self):
        if threading.current_thread() is threading.main_thread():
            self._before = {kind: signal.signal(kind, self._asked) for kind in (signal.SIGINT, signal.SIGTERM)}

    def __exit__(self, *_):
        for kind, before in self._before.items():
            # None: not set from Python, as by Blender for itself, and not to be had back from there
            signal.signal(kind, signal.SIG_DFL if before is None else before)

    def _asked(self, *_):
        if self._told.cancelled():
            raise KeyboardInterrupt
        self._told.cancel()
