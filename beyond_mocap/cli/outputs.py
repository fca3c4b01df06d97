"""Shared by all verbs: progress, notes and cancellation, output files, and common options."""

from __future__ import annotations

import argparse
import json
import os
import sys
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from ..base.errors import InputError, UserCancelledError
from ..base.settings.options import parse_path
from ..files.clip_file import FOREIGN
from ..files.file_names import identify_file

Writer = Callable[..., Sequence[str] | None]
"""Writes a take, or the result of the verb `match`, to a file, and joints above a take's hips where they are given:
(take, path, above=()). Returns lines for the user, if any."""


class ProgressReporter:
    """Shows progress and notes on the command line, and knows whether the user pressed Ctrl-C."""

    def __init__(self, as_json: bool, stream=None):
        """Choose the form of the output.

        Args:
            as_json: write JSON lines; otherwise a bar if the stream is a terminal.
            stream: a text stream; None for stderr.
        """
        self._stream = stream or sys.stderr
        self._json = as_json
        self._bar = not as_json and self._stream.isatty()
        self._stop_requested = threading.Event()
        self._stops_at_once = False
        self._last = ""

    def show_progress(self, fraction: float, text: str) -> None:
        """Show the progress.

        Args:
            fraction: 0 to 1.
            text: what is being done.
        """
        if self._json:
            print(json.dumps({"progress": round(fraction, 4), "text": text}), file=self._stream, flush=True)
        elif self._bar:
            done = int(round(30 * fraction))
            line = f"\r[{'#' * done}{'.' * (30 - done)}] {fraction:4.0%} {text[:40]:40s}"
            if line != self._last:
                print(line, end="", file=self._stream, flush=True)
                self._last = line

    def show_note(self, text: str) -> None:
        """Show a message to the user, on the stream of the progress.

        Args:
            text: one line.
        """
        print(json.dumps({"note": text}) if self._json else f"note: {text}", file=self._stream, flush=True)

    def finish(self, notes: Iterable[str] = ()) -> None:
        """Clear the bar and show notes.

        Args:
            notes: one line each.
        """
        if self._last:
            print("\r" + " " * 80 + "\r", end="", file=self._stream, flush=True)
            self._last = ""
        for text in notes:
            self.show_note(text)

    def cancel(self) -> None:
        """Request cancellation; a second request, and one within `stop_at_once`, interrupts.

        Raises:
            KeyboardInterrupt: where it interrupts.
        """
        is_repeated = self.is_cancelled()
        self._stop_requested.set()
        if is_repeated or self._stops_at_once:
            raise KeyboardInterrupt

    @contextmanager
    def stop_at_once(self):
        """Context manager: Ctrl-C interrupts the block wherever it is.

        For work that never asks `is_cancelled`, and has nothing to save or to end.
        """
        self.check_cancelled()
        self._stops_at_once = True
        try:
            yield
        finally:
            self._stops_at_once = False

    def is_cancelled(self) -> bool:
        """Return whether the user requested cancellation."""
        return self._stop_requested.is_set()

    def check_cancelled(self) -> None:
        """Raise UserCancelledError if the user requested cancellation."""
        if self.is_cancelled():
            raise UserCancelledError("cancelled")


@contextmanager
def locate_errors(path):
    """Add the file's name to errors about its content: skeletons, motions and scenes do not know their file.

    Args:
        path: the file, or words for several files.
    Raises:
        InputError: the error of the block, with `path` in front.
    """
    try:
        yield
    except InputError as error:
        if error.where.startswith(str(path)):
            raise
        raise InputError(path, str(error)) from None


def choose_writer(out: Path, writers: Mapping[str, Writer],
                  hint: str = "run inside Blender to write .blend, .fbx, .glb " "or .usdc") -> Writer:
    """Choose the function that writes an output file.

    Args:
        out: the output file.
        writers: functions by file suffix, in addition to BVH.
        hint: next step of the error if `writers` is empty; "" for "choose another file type".
    Returns:
        The function.
    Raises:
        InputError: if no function writes this kind of file.
    """
    by_suffix = {".bvh": write_bvh, **writers}
    if out.suffix.lower() not in by_suffix:
        raise InputError(
            out, f"file type {out.suffix} cannot be written here" if out.suffix else "no file type",
            f"one of {', '.join(sorted(by_suffix))}",
            "choose another file type" if writers or not hint else hint,
        )
    return by_suffix[out.suffix.lower()]


def write_bvh(take, out: Path, above: Sequence = ()) -> None:
    """Write a take's motion as BVH.

    Args:
        take: a `Take`.
        out: the file.
        above: joints above the hips (`JointAboveHips`), from the root down.
    """
    from ..files.bvh import bvh
    from ..files.bvh.bvh_write import BvhForm

    bvh.write_bvh(out, take.motion, BvhForm(above=tuple(above)))


def check_outputs(*paths: Path | None, reserved: tuple[Path | None, ...] = (), library: Path | None = None,
                  labels: Path | None = None, motion: Path | None = None) -> None:
    """Check before the work that every output can be written and that no two paths are the same file.

    Args:
        paths: the output files; None is skipped.
        reserved: files that must not be overwritten, such as the inputs; None is skipped.
        library: a folder whose recordings, labels and balls must not be overwritten, and where no output may have the
            name of a recording, labels or a ball that do not exist yet; None for none.
        labels: one of the paths, a table of labels, which may become a new one of the library; None for none.
        motion: one of the paths, which may become a recording of the library; None for none.
    Raises:
        InputError: for the first path that fails.
    """
    used = {path.resolve() for path in reserved if path is not None}
    is_listed = any(path.is_file() or path.suffix in (".txt", ".csv") for path in filter(None, paths))
    recorded = _identify_library_files(library, labels) if library is not None and is_listed else set()
    for path in filter(None, paths):
        resolved = path.resolve()  # a link is written where it leads
        folder = resolved.parent
        if path.is_dir():
            raise InputError(path, "is a folder", "a file", "add a file name")
        if path.exists() and not path.is_file():
            raise InputError(path, "is a device or a pipe", "a regular file", "choose another file")
        if not folder.is_dir():
            raise InputError(path, "its folder does not exist", "an existing folder", "create the folder first")
        if not os.access(folder, os.W_OK | os.X_OK):
            raise InputError(path, "its folder is not writable", "a writable folder", "choose another folder")
        if resolved in used:
            problem = "is both an output and another file of the command"
            raise InputError(path, problem, "different files", "rename one of them")
        used.add(resolved)
        if path.exists() and identify_file(path) in recorded:
            raise InputError(path, f"is a file of the library {library}", "another file", "choose another name")
        if not path.exists() and os.path.normcase(resolved) in recorded:
            raise InputError(path, f"would be read as labels or as a ball of the library {library}", "another file",
                             "choose another name")
        if library is not None and path is not motion and _is_named_like_recording(resolved, library):
            raise InputError(path, f"would be read as a recording of the library {library}", "another file",
                             "choose another name")


def _is_named_like_recording(path: Path, library: Path) -> bool:
    """Return whether a file below a library would be read as a recording by its name; an .npz is by its content."""
    return path.suffix.lower() in (".bvh", *FOREIGN) and path.is_relative_to(library.resolve())


def _identify_library_files(library: Path, labels: Path | None) -> set[tuple[int, int] | str]:
    """Identify the recordings, labels and balls of a library, also where links lead to them; labels and balls that do
    not exist by their paths, without the table that `labels` becomes.
    """
    from ..library.folder.annotations import TABLE_NAME, list_table_places
    from ..library.folder.recordings import find_recordings

    found = find_recordings(library)
    beside = [os.path.splitext(path)[0] + ending for path in found for ending in (".txt", ".ball.csv")]
    files = [*map(str, found), *beside, *map(str, list_table_places(library, found))]
    folders = {folder: os.path.realpath(folder) for folder in set(map(os.path.dirname, files))}
    there = set(filter(os.path.exists, files))
    missing = {os.path.normcase(os.path.join(folders[os.path.dirname(path)], os.path.basename(path)))
               for path in files if path not in there}
    if labels is not None and labels.name == TABLE_NAME:
        missing.discard(os.path.normcase(labels.resolve()))
    return {*map(identify_file, there), *missing}


def add_take_files(verb) -> None:
    """Add the options for the files beside a motion: provenance and ball.

    Args:
        verb: the parser to add them to.
    """
    verb.add_argument("--provenance", type=parse_path, metavar="P.csv", help="which clip each frame is from")
    verb.add_argument("--ball", type=parse_path, metavar="B.csv", help="the ball as it is shown")


def add_subverbs(verb, dest: str, *adders: Callable):
    """Add verbs below a verb, each with --json as every verb has.

    Args:
        verb: the parser of the verb above.
        dest: the option that holds the chosen verb.
        adders: each adds one verb to the sub-parsers and returns its parser.
    Returns:
        The parser of the verb above.
    """
    subparsers = verb.add_subparsers(dest=dest, required=True, metavar="VERB", parser_class=type(verb))
    for add_one in adders:
        add_one(subparsers).add_argument("--json", action="store_true", default=argparse.SUPPRESS,
                                         help="progress as JSON lines on stderr")  # fmt: skip
    return verb


def build_take(motion, clip: str, method: str, **fields):
    """Build a take from a motion that is one clip, played frame by frame, for the writers of formats other than BVH.

    Args:
        motion: the motion, F frames.
        clip: name of the clip.
        method: how the motion came about, as reports name it.
        fields: fields of the take that differ from those of a plainly played clip.
    Returns:
        A `Take`.
    """
    import numpy as np

    from ..annotation import Timeline
    from ..synthesis.take import Take

    count = len(motion)
    defaults = dict(
        start_time=0.0, clip=np.zeros(count, int), clip_frame=np.arange(count, dtype=float), keys=(), ball=None, seed=0,
        mirrored=np.zeros(count, bool), words=((),) * count, contacts=np.zeros((count, 2), bool),
        seams=np.zeros(0, int), timeline=Timeline(),
    )  # fmt: skip
    return Take(motion=motion, clips=(clip,), method=method, **{**defaults, **fields})
