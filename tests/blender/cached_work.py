"""What operators work out between order and apply, worked out once for the same order.

Work never touches bpy, and the same order gives the same bits (tests/core proves both). Where hundreds of calls try
what operators read from a scene and write into it, the same few pieces of work come again and again; each is done
once, and every further call gets the same frozen values.
"""

import io
import pickle
from types import MappingProxyType

import bpy

CACHED_OPERATORS = (
    "clean_markers", "kick_at_target", "learn_words", "passes_make", "reconstruct_markers", "stream_play",
    "throw_at_target",
)  # fmt: skip


def _build_view(values: dict) -> MappingProxyType:
    return MappingProxyType(values)


class _Packer(pickle.Pickler):
    """Values as bytes. Libraries go by name, for nobody changes one and they are large."""

    def __init__(self, out, library: type, known: dict):
        super().__init__(out)
        self.library, self.known = library, known

    def persistent_id(self, value):
        if not isinstance(value, self.library):
            return None
        self.known[id(value)] = value
        return id(value)

    def reducer_override(self, value):
        """Read-only views of dictionaries have no form of their own."""
        return (_build_view, (dict(value),)) if isinstance(value, MappingProxyType) else NotImplemented


def cache_work(monkeypatch, library: type) -> None:
    """Lets PURE operators work once for the same order, until monkeypatch takes it back. library: the core's class."""
    done, known = {}, {}
    for name in CACHED_OPERATORS:
        operator = getattr(bpy.types, f"BEYOND_MOCAP_OT_{name}")
        cached = _build_cached(name, operator.run_job, library, done, known)
        monkeypatch.setattr(operator, "run_job", staticmethod(cached))


def _build_cached(name: str, work, library: type, done: dict, known: dict):
    def run_cached(order, *asking):
        out = io.BytesIO()
        _Packer(out, library, known).dump(order)
        key = name, out.getvalue()
        if key not in done:
            done[key] = work(order, *asking)
        return done[key]

    return run_cached
