"""A rally that starts: planned in a thread, before Play Live shows it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..core import session
from ..passes import generate as make

if TYPE_CHECKING:
    from ...beyond_mocap.library.library import Library
    from ...beyond_mocap.passes.live_passes import Rally
    from ...beyond_mocap.passes.strike_means import StrikeMeans


@dataclass(frozen=True, eq=False)
class NewRally:
    """A rally that is ready to start.

    Attributes:
        order: as `generate.build_order` builds it.
        library: the library.
        means: what the players can strike with.
        rally: the rally.
    """

    order: make.Order
    library: Library
    means: StrikeMeans
    rally: Rally


def start_rally(order: make.Order, holder: str, clock: tuple[float, float], part: str, progress,
                cancelled) -> NewRally:
    """Build the library if it is not loaded, find its strikes with `part`, and start a rally with all players standing,
    on a `clock` of seconds now and frames per second. Does not use bpy.
    """
    from ...beyond_mocap.passes import live_passes

    library = session.open_library(order, progress, cancelled)
    rally = live_passes.start_rally(library, order.scene, holder, *clock, progress=progress, cancelled=cancelled)
    means = live_passes.collect_means(library, order.scene)
    means.list_likely(holder, part, "", None)
    return NewRally(order, library, means, rally)
