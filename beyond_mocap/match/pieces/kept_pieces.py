"""What a search has found for one window, kept in a file until it is needed again (never pickled)."""

from __future__ import annotations

import io
import json
from dataclasses import asdict
from pathlib import Path

import numpy as np

from ...base.errors import TimedLine, spans_of
from ...files.whole import atomic_write
from .named_edit import NamedEdit, NamedKey
from .searched import Piece

_ARRAYS = ("clip", "first", "rate", "length", "cut")
_PLAIN = ("player", "stretch", "number", "first", "own", "seconds", "hurried")


def keep_piece(path: Path, piece: Piece) -> None:
    """Writes a piece; InputError where that cannot be done."""
    header = {name: getattr(piece, name) for name in _PLAIN}
    header |= {"warnings": [[str(line), spans_of(line)] for line in piece.warnings]}
    header |= {"clips": piece.edit.clips, "keys": [asdict(key) for key in piece.edit.keys]}
    out = io.BytesIO()
    arrays = {name: getattr(piece.edit, name) for name in _ARRAYS}
    np.savez_compressed(out, header=np.frombuffer(json.dumps(header).encode(), np.uint8), **arrays)
    atomic_write(path, out.getvalue())


def kept_piece(path: Path) -> Piece | None:
    """The piece that `keep_piece` wrote; None where there is none, or none that can be read whole."""
    try:
        with np.load(path, allow_pickle=False) as kept:
            header = json.loads(kept["header"].tobytes())
            arrays = {name: kept[name] for name in _ARRAYS}
        keys = tuple(NamedKey(**{**key, "words": tuple(key["words"])}) for key in header.pop("keys"))
        clips = tuple((path, mirrored) for path, mirrored in header.pop("clips"))
        told = tuple(TimedLine(text, *spans) for text, spans in header["warnings"])
        header |= {"own": tuple(header["own"]), "warnings": told}
        return Piece(edit=NamedEdit(clips=clips, **arrays, keys=keys), **header)
    except Exception:  # a damaged file can fail in any of zipfile's, zlib's, numpy's and our own ways
        return None
