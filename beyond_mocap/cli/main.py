"""The command line: `python -m beyond_mocap VERB ...`; Blender's command and batch script use the same parser.

Exit status: 0 done; 2 the command line or an input is wrong; 3 the library lacks what was requested; 130 cancelled;
141 the reader of the output ended, as `head` does. Errors are one line on stderr. See the project's README for
examples.
"""

from __future__ import annotations

import argparse
import os
import re
import signal
import sys
import threading
from collections.abc import Callable, Mapping
from pathlib import Path

from .. import __version__
from ..base.content import is_waiting_for_pipe
from ..base.errors import BeyondMocapError, InputError, UserCancelledError
from .bodies import add_bodies
from .compare_methods import add_compare
from .convert import add_mirror, add_retarget, add_stream
from .freezing import add_freeze_frame
from .library import add_library
from .matching import add_match, add_touches
from .outputs import ProgressReporter, Writer
from .passing import add_passes
from .path_editing import add_path
from .reconstructing import add_reconstruct, add_release
from .study import add_study
from .synthesize import add_evaluate, add_synthesize
from .throwing import add_throw

VERBS = (add_library, add_synthesize, add_path, add_touches, add_stream, add_passes, add_reconstruct, add_release,
         add_bodies, add_throw, add_match, add_freeze_frame, add_study, add_mirror, add_retarget, add_evaluate,
         add_compare)  # fmt: skip
"""Functions that add a verb, in the order of `--help`; each takes the sub-parsers and returns its parser."""
IsolatedRunner = Callable[[list[str], Callable[[float, str], None], Callable[[], bool]], object]
"""Runs a command line in another process: (arguments, progress callback, cancellation callback)."""
Converter = Callable[[Path, Path | None, ProgressReporter], None]
"""Converts recordings of a library that only the host reads: (library, cache folder or None for its own, reporter)."""
_DOCUMENTS = "documents: the folder docs beside the source; all commands: docs/reference/commands.md"
_UNREAD = 141  # exit status that shells give to a program that SIGPIPE ended


class OneLineParser(argparse.ArgumentParser):
    """A parser whose errors are one line, with exit status 2."""

    def __init__(self, *args, **more):
        super().__init__(*args, **more)
        self._negative_number_matcher = re.compile(r"-\.?\d")  # like Python 3.14: -10,2,1 is a value, not an option

    def error(self, message: str):
        """Raise the message as an InputError.

        Args:
            message: argparse's description of the problem.
        Raises:
            InputError: always.
        """
        raise InputError(self.prog, message, "", f"see '{self.prog} --help'")

    def _get_values(self, action, arg_strings):
        """Refuse `--option=--`, for which argparse gives an option an empty list as its value."""
        if action.option_strings and action.nargs is None and arg_strings == ["--"]:
            self.error(f"argument {'/'.join(action.option_strings)}: expected one argument")
        return super()._get_values(action, arg_strings)

    def parse_known_args(self, args=None, namespace=None):
        """Parse arguments, and raise an InputError for unknown ones here, where the command that lacks them is known.

        Args:
            args: the arguments; None for `sys.argv`.
            namespace: takes the values; None for a new one.
        Returns:
            The namespace, and an empty list.
        Raises:
            InputError: for unknown or wrong arguments.
        """
        namespace, unknown = super().parse_known_args(args, namespace)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        return namespace, unknown


def build_parser(prog: str = "beyond-mocap") -> argparse.ArgumentParser:
    """Build the parser of all verbs.

    Args:
        prog: the program's name in help and errors.
    Returns:
        The parser; its result has the verb in `verb` and the function to run in `run`.
    """
    top = OneLineParser(prog=prog, description="Full-body animation from tracking data, labels and motion capture.",
                        epilog=_DOCUMENTS)
    top.add_argument("--version", action="version", version=f"beyond-mocap {__version__}")
    verbs = top.add_subparsers(dest="verb", required=True, metavar="VERB", parser_class=OneLineParser)
    for add in VERBS:
        verb = add(verbs)
        verb.formatter_class = argparse.RawDescriptionHelpFormatter  # keeps the lines of examples
        verb.epilog = "\n\n".join(filter(None, (verb.epilog, _DOCUMENTS)))
        verb.add_argument("--json", action="store_true", help="progress as JSON lines on stderr")
    return top


def main(
    argv: list[str] | None = None, writers: Mapping[str, Writer] | None = None, prog: str = "beyond-mocap",
    run_isolated: IsolatedRunner | None = None, convert: Converter | None = None,
) -> int:  # fmt: skip
    """Run one command and return its exit status.

    Args:
        argv: the arguments without the program's name; None for `sys.argv`.
        writers: further output formats, by file suffix (Blender's).
        prog: the program's name in help and errors.
        run_isolated: runs a command line in a process of its own, for hosts such as Blender that cannot start workers.
        convert: converts the recordings of every library that the command reads, before it does.
    Returns:
        The exit status, see the module.
    """
    try:
        status = _run_command(argv, writers or {}, prog, run_isolated, convert)
    except BrokenPipeError:
        status = _UNREAD
    _discard_unwritable()
    return status


def _run_command(argv: list[str] | None, writers: Mapping[str, Writer], prog: str,
                 run_isolated: IsolatedRunner | None, convert: Converter | None) -> int:
    """Run one command, print its error, and return its exit status; BrokenPipeError if nothing reads the output."""
    reporter = None
    _escape_unencodable(sys.stdout)
    try:
        argv = sys.argv[1:] if argv is None else argv
        options = build_parser(prog).parse_args(argv)
        options.argv, options.run_isolated = argv, run_isolated
        reporter = ProgressReporter(options.json)
        with _InterruptHandler(reporter):
            for folder in _list_libraries(options) if convert else ():
                convert(folder, options.cache, reporter)
            options.run(options, reporter, writers)
        print(end="", flush=True)
        return 0
    except BeyondMocapError as error:
        status, text = error.exit_status, str(error)
    except KeyboardInterrupt:
        status, text = UserCancelledError.exit_status, "cancelled"
    except BrokenPipeError:
        raise
    except OSError as error:
        path = error.filename or "standard output or a temporary file"
        status, text = 2, f"{path}: {error.strerror or error}; check that the file can be read and its folder written"
    except MemoryError:
        status, text = 2, "not enough memory; close other programs, or take a smaller file, library or time span"
    except SystemExit as done:  # --help and --version
        return int(done.code or 0)
    if reporter is not None:
        reporter.finish()
    try:
        print(text if text.startswith(prog) else f"{prog}: {text}", file=sys.stderr)
    except BrokenPipeError:
        raise
    except OSError:  # such as a full disk: the status says it
        pass
    return status


def _list_libraries(options) -> list[Path]:
    """List the libraries that a command reads."""
    return [folder for name in ("library", "against") if (folder := getattr(options, name, None)) is not None]


def _discard_unwritable() -> None:
    """Discard output that cannot be written, of which Python would report an error when it ends."""
    for stream in filter(None, (sys.stdout, sys.stderr)):
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _escape_unencodable(stream) -> None:
    """Make a stream write characters that its encoding lacks as escapes instead of raising an error."""
    if getattr(stream, "errors", None) == "strict" and hasattr(stream, "reconfigure"):
        stream.reconfigure(errors="backslashreplace")


class _InterruptHandler:
    """Context manager: Ctrl-C, or a render farm's SIGTERM, requests cancellation (`ProgressReporter.cancel`).

    Outside the main thread it does nothing.
    """

    def __init__(self, reporter: ProgressReporter):
        self._reporter, self._previous_handlers = reporter, {}

    def __enter__(self):
        if threading.current_thread() is threading.main_thread():
            self._previous_handlers = {kind: signal.signal(kind, self._handle_signal)
                                       for kind in (signal.SIGINT, signal.SIGTERM)}

    def __exit__(self, *_):
        for kind, before in self._previous_handlers.items():
            # None: the handler was not set from Python (Blender's own) and cannot be restored from here
            signal.signal(kind, signal.SIG_DFL if before is None else before)

    def _handle_signal(self, *_):
        self._reporter.cancel()
        if is_waiting_for_pipe():
            raise KeyboardInterrupt
