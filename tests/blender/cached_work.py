"""What operators work out between reading and writing a scene, worked out once in a session for the same order, and in
`make test` once for all its runs.

Work never touches bpy, and the same order gives the same bits (tests/core proves both). What Blender's tests try is
how operators read from a scene and write into it, and there the same few pieces of work come again and again. Each is
done once; every further call gets its own copy of the result. Work in a thread is done each time: how it is cancelled
and how it reports is tried there.
"""

import hashlib
import io
import os
import pickle
import sys
import threading
from importlib import import_module
from pathlib import Path, PurePath
from types import FunctionType, MappingProxyType

import bpy
import numpy as np
import scipy
import sklearn

FUNCTIONS = {
    "evaluation.report": "evaluate", "library.library": "_build_synthetic_library",
    "markers.reconstruct": "reconstruct", "passes.passes": "synthesize_passes",
    "synthesis.resynthesize": "resynthesize", "synthesis.synthesize": "synthesize", "throws.throw": "throw_at",
}  # fmt: skip
"""Module of the core -> its function that takes long."""
OPERATORS = (
    "clean_markers", "kick_at_target", "learn_words", "make_match", "passes_make", "reconstruct_markers", "stream_play",
    "throw_at_target",
)  # fmt: skip
"""Operators whose work is more than one of these functions, or reads or writes files: each session does it."""


def _build_view(values: dict) -> MappingProxyType:
    return MappingProxyType(values)


class _Packer(pickle.Pickler):
    """Values as bytes, the same for equal values. Libraries go by what they were built from, since they are large and
    stay as they are; a function within a function has no form, and is equal to itself alone; the folder of the
    session's files has another name in each."""

    def __init__(self, out, cache: "WorkCache"):
        super().__init__(out)
        self.fast = True  # no note of which equal parts are one
        self.cache, self.has_ids = cache, False

    def persistent_id(self, value):
        if isinstance(value, (str, PurePath)):
            return self._find_form(value)
        if isinstance(value, FunctionType) and "<locals>" in value.__qualname__:
            name, self.has_ids = ("function", id(value)), True
        elif isinstance(value, self.cache.library):
            name = "library", *vars(value).get("index_place", (None, id(value)))[1:]
            self.has_ids |= "index_place" not in vars(value)
        else:
            return None
        self.cache.kept[name] = value
        return name

    def _find_form(self, value):
        parts = str(value).split(self.cache.base)
        return ("path" if isinstance(value, PurePath) else "text", *parts) if len(parts) > 1 else None

    def reducer_override(self, value):
        """Read-only views of dictionaries have no form of their own."""
        return (_build_view, (dict(value),)) if isinstance(value, MappingProxyType) else NotImplemented


class _Unpacker(pickle.Unpickler):
    """The values again."""

    def __init__(self, packed: bytes, cache: "WorkCache"):
        super().__init__(io.BytesIO(packed))
        self.cache = cache

    def persistent_load(self, name):
        if name[0] in ("text", "path"):
            text = self.cache.base.join(name[1:])
            return text if name[0] == "text" else Path(text)
        return self.cache.kept[name]


class WorkCache:
    """The results of a session by function and order, and those of other sessions in a folder."""

    def __init__(self, core: str, base: Path, folder: Path | None):
        """core: the core's dotted name; base: folder of this session's files; folder: what other runs of the same
        core, Python and libraries share, None for none."""
        self.library, self.kept, self.results = import_module(f"{core}.library.library").Library, {}, {}
        self.base, self.folder = str(base), folder
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            self.version = _digest_version(Path(import_module(core).__file__).parent)

    def pack(self, value) -> tuple[bytes, bool]:
        """The value as bytes, and whether another process has the same for it."""
        out = io.BytesIO()
        packer = _Packer(out, self)
        packer.dump(value)
        return out.getvalue(), not packer.has_ids

    def unpack(self, packed: bytes):
        """The value again."""
        return _Unpacker(packed, self).load()

    def _find_file(self, order: bytes) -> Path:
        return self.folder / hashlib.sha256(self.version + order).hexdigest()

    def keep_results(self, work, shared: bool = True):
        """A function that does `work` once for equal arguments; those for progress and cancelling do not count.
        shared: other sessions use the result too, for work that neither reads nor writes files."""

        def work_once(*args, **named):
            if threading.current_thread() is not threading.main_thread():
                return work(*args, **named)
            asked = [value for value in args if not callable(value)], [
                item for item in sorted(named.items()) if not callable(item[1])]
            order, is_shared = self.pack((work.__module__, work.__qualname__, asked))
            file = self._find_file(order) if self.folder and shared and is_shared else None
            if order not in self.results and file is not None and file.is_file():
                self.results[order] = file.read_bytes()
            if order in self.results:
                try:
                    return self.unpack(self.results[order])
                except KeyError:  # of a library that only another session has
                    pass
            self.results[order], is_shared = self.pack(work(*args, **named))
            if file is not None and is_shared:
                _write_whole(file, self.results[order])
            return self.unpack(self.results[order])  # as other sessions have it, with nothing that was added since

        return work_once


def _digest_version(folder: Path) -> bytes:
    """A digest of Python, the libraries and all files of the core: what other code worked out is not used."""
    found = hashlib.sha256(f"{sys.version} {np.__version__} {scipy.__version__} {sklearn.__version__}".encode())
    for path in sorted(path for path in folder.rglob("*") if path.is_file() and path.suffix != ".pyc"):
        found.update(str(path.relative_to(folder)).encode() + path.read_bytes())
    return found.digest()


def _write_whole(file: Path, content: bytes) -> None:
    """Write a file that another process may read at any time."""
    part = file.with_suffix(f".{os.getpid()}")
    part.write_bytes(content)
    part.replace(file)


def cache_functions(monkeypatch, core: str, base: Path, folder: Path | None) -> WorkCache:
    """Let FUNCTIONS work once for the same order, until monkeypatch takes it back; arguments as of `WorkCache`."""
    cache = WorkCache(core, base, folder)
    for module, name in FUNCTIONS.items():
        work = getattr(import_module(f"{core}.{module}"), name)
        once = cache.keep_results(work)
        for user in [user for place, user in sys.modules.items() if place.startswith(core)]:
            if vars(user).get(name) is work:
                monkeypatch.setattr(user, name, once)
    return cache


def cache_operators(monkeypatch, cache: WorkCache) -> None:
    """The same for OPERATORS within a session, where no test changes the files that they read or write."""
    for name in OPERATORS:
        operator = getattr(bpy.types, f"BEYOND_MOCAP_OT_{name}")
        monkeypatch.setattr(operator, "run_job", staticmethod(cache.keep_results(operator.run_job, shared=False)))
