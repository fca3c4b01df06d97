"""What all verbs share: the progress that the user sees, where results may be written, and common options."""

from __future__ import annotations

import argparse
import json
import os
import sys
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from ..base.errors import Cancelled, InputError

Writer = Callable[[object, Path], Sequence[str] | None]
"""Writes a take, or what the verb `match` has made, to a file; lines for the user, if any."""


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

    def end(self, notes: Iterable[str] = ()) -> None:
        """Clears the bar and writes the notes."""
        if self._last:
            print("\r" + " " * 80 + "\r", end="", file=self._stream, flush=True)
            self._last = ""
        for text in notes:
            self.note(text)

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


@contextmanager
def naming(path):
    """What is wrong with what a file holds is reported with the file: skeletons, motions and scenes do not know theirs.
    path: or words for several files."""
    try:
        yield
    except InputError as error:
        if error.where.startswith(str(path)):
            raise
        raise InputError(path, str(error)) from None


def writer_of(out: Path, writers: Mapping[str, Writer], others: str = "inside Blender .blend, .fbx, .glb and .usdc can "
              "be written too") -> Writer:
    """Who writes a file with the suffix of `out`; `writers`: by suffix, beside BVH; others: what to do next where there
    are none, "" for no more than another ending."""
    known = {".bvh": write_bvh, **writers}
    if out.suffix.lower() not in known:
        raise InputError(
            out, f"no file ending in {out.suffix} can be written here" if out.suffix else "no file ending",
            f"one of {', '.join(sorted(known))}",
            "choose another ending" if writers or not others else others,
        )
    return known[out.suffix.lower()]


def write_bvh(take, out: Path) -> None:
    """The take's motion as BVH."""
    from ..files.bvh import bvh

    bvh.write(out, take.motion)


def check_outputs(*paths: Path | None, never: tuple[Path | None, ...] = ()) -> None:
    """Before work begins: every output's folder can be written to, and no output is another one or one of `never`."""
    taken = {path.resolve() for path in never if path is not None}
    for path in filter(None, paths):
        folder = path.absolute().parent
        if path.is_dir():
            raise InputError(path, "is a folder", "a file name", "add a file name")
        if path.exists() and not path.is_file():
            raise InputError(path, "a device or a pipe", "a file name", "choose another place")
        if not folder.is_dir():
            raise InputError(path, "its folder does not exist", "an existing folder", "make the folder first")
        if not os.access(folder, os.W_OK | os.X_OK):
            raise InputError(path, "its folder cannot be written to", "a folder of yours", "choose another folder")
        if path.resolve() in taken:
            what = "named for an output and for something else"
            raise InputError(path, what, "a file for each", "rename one of them")
        taken.add(path.resolve())


def named_folder(text: str) -> Path:
    """A folder that has a name: an empty one would be the folder at hand."""
    if not text.strip():
        raise argparse.ArgumentTypeError("no folder is named")
    return Path(text)


def add_take_files(verb) -> None:
    """Options for what belongs to a motion: provenance and ball."""
    verb.add_argument("--provenance", type=Path, metavar="P.csv")
    verb.add_argument("--ball", type=Path, metavar="B.csv")


def add_own_verbs(verb, dest: str, *adders: Callable):
    """Adds verbs below a verb, each with --json as every verb; returns the verb's parser. dest: the option that holds
    which one was chosen; adders: each adds one to the sub-parsers and returns its parser."""
    own = verb.add_subparsers(dest=dest, required=True, metavar="VERB", parser_class=type(verb))
    for add_one in adders:
        add_one(own).add_argument("--json", action="store_true", default=argparse.SUPPRESS,
                                  help="progress as JSON lines on stderr")  # fmt: skip
    return verb


def build_take(motion, clip: str, method: str, **known):
    """A motion that is one clip, played frame by frame, as a take, for writers of other forms than BVH. known: fields
    of the take that say more than that."""
    import numpy as np

    from ..annotation import Timeline
    from ..synthesis.take import Take

    count = len(motion)
    usual = dict(
        start_time=0.0, clip=np.zeros(count, int), clip_frame=np.arange(count, dtype=float), keys=(), ball=None, seed=0,
        mirrored=np.zeros(count, bool), words=((),) * count, contacts=np.zeros((count, 2), bool),
        seams=np.zeros(0, int), timeline=Timeline(),
    )  # fmt: skip
    return Take(motion=motion, clips=(clip,), method=method, **{**usual, **known})
