"""What a window of everybody says, kept in a file until it is needed again (never pickled)."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...files.whole import atomic_write
from .correction import Correction
from .crowd_window import CrowdPart

_ARRAYS = ("frames", "depth", "led_frames", "led")


def keep_parts(path: Path, parts: Sequence[CrowdPart]) -> None:
    """Writes a window's parts, in the order of the players; InputError where that cannot be done."""
    arrays = {}
    for number, one in enumerate(parts):
        arrays |= {f"{number}.{name}": getattr(one, name) for name in _ARRAYS}
        arrays |= {f"{number}.knots": one.correction.knots, f"{number}.values": one.correction.values}
    header = [[one.correction.fps, one.correction.step, one.before] for one in parts]
    out = io.BytesIO()
    np.savez_compressed(out, header=np.frombuffer(json.dumps(header).encode(), np.uint8), **arrays)
    atomic_write(path, out.getvalue())


def kept_parts(path: Path) -> tuple[CrowdPart, ...] | None:
    """The parts that `keep_parts` wrote; None where there are none, or none that can be read whole."""
    try:
        with np.load(path, allow_pickle=False) as kept:
            header = json.loads(kept["header"].tobytes())
            return tuple(
                CrowdPart(
                    correction=Correction(kept[f"{number}.knots"], kept[f"{number}.values"], fps, step),
                    before=before, **{name: kept[f"{number}.{name}"] for name in _ARRAYS},
                ) for number, (fps, step, before) in enumerate(header)
            )  # fmt: skip
    except Exception:  # a damaged file can fail in any of zipfile's, zlib's, numpy's and our own ways
        return None
