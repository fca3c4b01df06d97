"""Strikes of armatures of the scene as examples: a pass is to be struck as an armature's action shows it (eq. 2)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy

from ...beyond_mocap.ball.contact import Tool
from ...beyond_mocap.base.errors import InputError
from ..path_editing.carrier import MARK
from ..path_editing.rigs import carrier_of
from . import hits_shown
from .settings import BeyondMocapPass, BeyondMocapPasses

if TYPE_CHECKING:
    from ...beyond_mocap.passes.hits import HitMotion

_MOST_KEPT = 32
_found: dict[tuple, "HitMotion"] = {}  # by all that it was read from; asked for again and again during a drag


def is_wanted(row: BeyondMocapPass) -> bool:
    """Whether an armature shows how the pass is struck; also where that armature is gone."""
    return row.actor is not None or bool(row.actor_known)


def hit_of(
    scene: bpy.types.Scene, row: BeyondMocapPass, number: int, part: str, side: str, tool: Tool | None
) -> "HitMotion":
    """The strongest strike by `part` in the stretch that a pass names of its armature's motion.

    number: of the pass, from 1, for errors. part, side ("": the stronger one), tool: of who strikes. InputError: the
    armature is gone, is one of the scene's own bodies, does not move, or does not strike there.
    """
    body, where = row.actor, f"pass {number}: Like Armature"
    if body is None or body.name not in scene.objects:
        raise InputError(
            where, f"{row.actor_known or body.name} is not in the scene any more", "an armature that strikes",
            "choose another one, or empty the field",
        )
    if any(body in (player.body, player.shown) for player in scene.beyond_mocap_passes.players):
        raise InputError(
            where, f"{body.name}, which plays this scene itself", "another armature", "duplicate it before"
        )
    if row.actor_cut and row.actor_last <= row.actor_first:
        raise InputError(where, f"frames {row.actor_first} to {row.actor_last}", "the later frame last")
    carrier, action = carrier_of(body), body.animation_data and body.animation_data.action
    key = (body.session_uid, carrier.stamp(scene), carrier.keys_digest(), action and str(action.get(MARK)),
           row.actor_cut and (row.actor_first, row.actor_last), part, side, tool)
    if key not in _found:
        try:
            found = _look(scene, row, part, side, tool)
        except InputError as error:
            raise InputError(where, str(error)) from None
        if len(_found) >= _MOST_KEPT:
            _found.pop(next(iter(_found)))
        _found[key] = found
    return _found[key]


def left_out(settings: BeyondMocapPasses) -> str:
    """A line about examples that a SCENE.json cannot hold, which names recordings of a library only; "" without any."""
    numbers = [str(number) for number, row in enumerate(settings.passes, start=1) if is_wanted(row)]
    if not numbers:
        return ""
    passes = f"{'passes' if len(numbers) > 1 else 'pass'} {', '.join(numbers)}"
    return f"without the example of {passes}, an armature: a file can name recordings of the library only"


def forget() -> None:
    """Read armatures anew: what constraints of one follow may have changed unseen."""
    _found.clear()


def _look(scene, row: BeyondMocapPass, part: str, side: str, tool: Tool | None) -> "HitMotion":
    from ...beyond_mocap.passes.hits import strongest

    body = row.actor
    motion, start = hits_shown.motion_of(scene, body)
    first, last = (row.actor_first, row.actor_last) if row.actor_cut else (start, start + len(motion) - 1)
    stretch = motion.frames(max(0, first - start), max(0, last - start + 1))
    span = f"frames {first} to {last}"
    if len(stretch) < 3:
        end = start + len(motion) - 1
        raise InputError(f"armature {body.name}", f"no motion on {span}", f"a stretch of its frames {start} to {end}")
    hit = strongest(stretch, part, side, tool)
    if hit is None:
        raise InputError(f"armature {body.name}", f"no strike by {' '.join(filter(None, (side, part)))} on {span}",
                         "a stretch with a whole strike", "see Hit Analysis for what it has")
    return hit
