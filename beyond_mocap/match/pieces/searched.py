"""What the search finds for one window: no motion yet, only which clip is shown when."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from ...library.automatic import with_chosen_gaits
from ...library.library import Library
from ...synthesis.plan import Plan
from ...synthesis.resolve_plan import resolve_plan
from ...synthesis.search.balance import balanced
from ...synthesis.search.distance import exact_keys
from ...synthesis.search.path_search import PathSearch
from ...synthesis.search.wanted import build_order
from .library_clips import named
from .named_edit import NamedEdit
from .units import Unit


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
