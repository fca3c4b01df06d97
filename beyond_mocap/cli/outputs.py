"""Where results may be written, and who writes them; checked before work begins."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from ..base.errors import InputError

Writer = Callable[[object, Path], Sequence[str] | None]
"""Writes a take, or what the verb `match` has made, to a file; lines for the user, if any."""


def writer_of(out: Path, writers: Mapping[str, Writer]) -> Writer:
    """Who writes a file with the suffix of `out`; `writers`: by suffix, beside BVH."""
    known = {".bvh": write_bvh, **writers}
    if out.suffix.lower() not in known:
        raise InputError(
            out, f"no file ending in {out.suffix} can be written here" if out.suffix else "no file ending",
            f"one of {', '.join(sorted(known))}",
            "choose another ending" if writers else "inside Blender .blend, .fbx, .glb and .usdc can be written too",
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
    verb.add_argument("--provenance", type=Path, metavar="P.csv")
    verb.add_argument("--ball", type=Path, metavar="B.csv")
