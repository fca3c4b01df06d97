"""What is out of date, said in one place: fingerprints of what a take was made of, against what is asked now."""

from __future__ import annotations

import hashlib
import os
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

from ..beyond_mocap.annotation import Timeline
from ..beyond_mocap.plan import Plan


def fingerprint(value: Any) -> str:
    """Of plain values, arrays and dataclasses of them: equal for equal content, in every session."""
    digest = hashlib.blake2b(digest_size=12)
    _feed(digest, value)
    return digest.hexdigest()


def _feed(digest, value: Any) -> None:
    if is_dataclass(value):
        for place in fields(value):
            digest.update(place.name.encode())
            _feed(digest, getattr(value, place.name))
    elif isinstance(value, np.ndarray):
        digest.update(f"{value.dtype.str}{value.shape}".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, dict):
        _feed(digest, sorted(value.items()))
    elif isinstance(value, (list, tuple)):
        digest.update(f"({len(value)}".encode())
        for item in value:
            _feed(digest, item)
    elif isinstance(value, (set, frozenset)):
        _feed(digest, sorted(value))
    else:
        digest.update(f"{value!r};".encode())


def parts(plan: Plan, folder: str) -> dict[str, str]:
    """What a take is made of, each by its fingerprint: the track, the words, the other choices, the library on disk."""
    rest = replace(plan, track=None, timeline=Timeline(), library="")
    return {
        "track": fingerprint(plan.track),
        "words": fingerprint(plan.timeline),
        "choices": fingerprint(rest),
        "library": library_stamp(folder),
    }


def library_stamp(folder: str) -> str:
    """Of the clips and words of a folder as they lie on disk: their number, size and time, without reading them."""
    found = []
    for place, folders, names in os.walk(folder, followlinks=True):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(names):
            if name.lower().endswith((".bvh", ".txt", ".csv", ".fbx", ".glb", ".gltf")):
                try:
                    status = os.stat(os.path.join(place, name))
                except OSError:
                    continue
                found.append((name, status.st_size, status.st_mtime_ns))
    return fingerprint(found)
