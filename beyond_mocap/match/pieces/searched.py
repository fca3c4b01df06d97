"""What the search finds for one window: no motion yet, only which clip is shown when; kept in a file until it is needed
again (never pickled)."""

from __future__ import annotations

import io
import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from ...base.errors import TimedLine, spans_of
from ...files.whole import atomic_write
from ...library.chosen import with_chosen_gaits
from ...library.library import Library
from ...synthesis.plan import Plan
from ...synthesis.resolve_plan import resolve_plan
from ...synthesis.search.balance import balanced
from ...synthesis.search.distance import exact_keys
from ...synthesis.search.path_search import PathSearch
from ...synthesis.search.wanted import build_order
from .named_edit import NamedEdit, NamedKey, named
from .units import Unit

_ARRAYS = ("clip", "first", "rate", "length", "cut")
_PLAIN = ("player", "stretch", "number", "first", "own", "seconds", "hurried")


@dataclass(frozen=True, eq=False, kw_only=True)
class Piece:
    """What was found for a window. player, stretch, number, first, own: the unit's (`units.Unit`). edit: at the
    library's rate, from the unit's first frame on. seconds: of processor time that it took. warnings: what the library
    lacks of what is asked. hurried: frame of `edit` from which on it was searched in a hurry, or None."""

    player: str
    stretch: int
    number: int
    first: int
    own: tuple[int, int]
    edit: NamedEdit
    seconds: float = 0.0
    warnings: tuple[str, ...] = ()
    hurried: int | None = None


def searched(library: Library, unit: Unit, cancelled: Callable[[], bool] | None = None,
             hurry: Callable[[], bool] | None = None) -> Piece:  # fmt: skip
    """The edit list of one window of a player.

    library: the recordings; where the plan allows made clips, all windows are offered them, so that neighbours choose
    from the same. Raises what `synthesize` raises. The same library, unit and numpy give the same bits.
    """
    from threadpoolctl import threadpool_limits

    begun = time.process_time()
    with threadpool_limits(limits=1):
        library = searched_library(library, unit.plan)
        plan = resolve_plan(unit.plan, library, touches_solved=True)
        order = build_order(library, plan)
        search = PathSearch(library, order, balanced(unit.plan.alpha), cancelled=cancelled, hurry=hurry, on_grid=True)
        edit = exact_keys(library, search.run(), order)
    return Piece(player=unit.player, stretch=unit.stretch, number=unit.number, first=unit.first, own=unit.own,
                 edit=named(library, edit, plan.timeline.keys), seconds=time.process_time() - begun,
                 warnings=order.warnings, hurried=search.hurried)  # fmt: skip


def searched_library(library: Library, plan: Plan) -> Library:
    """The library that all windows of a plan are searched in."""
    return with_chosen_gaits(library.extended if plan.made else library, dict(plan.gaits))


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
