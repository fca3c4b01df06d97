"""A throw on its armature and ball; what they did before is put aside and comes back, or the throw is kept."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import numpy as np

from ..core import action, channels, session
from ..core.measure import frames_per_second
from ..core.set_aside import bring_back, drop, put_aside
from ..result import bake
from ..rigs.bake_record import BEFORE, KEYS
from ..rigs.bake_record import MARK as BAKE_MARK
from . import flown, order, rigged
from .settings import MARK

if TYPE_CHECKING:
    from .made import Result

MOST_LINES = 12
BAKED = (BAKE_MARK, BEFORE, KEYS)
"""What tells a bake that is taken away again."""
RESULTS = ("made", "made_of", "asked", "rigged", "release", "figures", "told")


def show(scene: bpy.types.Scene, body: bpy.types.Object, result: "Result") -> None:
    """Lay a throw on its armature and its ball."""
    wish, joined, fps = body.beyond_mocap_throw, result.joined, frames_per_second(scene)
    order.check(scene, body)
    flown.check(wish, result)
    if result.library is not None:
        session.keep_library(result.library, result.order.unit)
    name, start, more = f"{body.name} {result.order.act}s", joined.start * fps, []
    if result.order.table:
        more = rigged.lay(scene, body, result.order.table, motion=joined.motion, start=int(round(start)),
                          name=result.order.act)
        wish.rigged = True
    else:
        if not wish.before.kept:
            put_aside(wish.before, body)
        channels.discard(body, MARK)
        action.write(body, joined.motion, scene, start, name, generated=True)[MARK] = True
    more = [*more, *flown.show(scene, body, result)]
    last = joined.start + (len(joined.motion) - 1) / fps
    bake.lengthen(scene, fps * max(joined.release + result.seconds, last))
    wish.made, wish.release = result.order.act, joined.release * fps
    wish.made_of, wish.asked = result.order.digest, round(result.order.at * fps)
    wish.figures = "\n".join(figures(result))
    told = [*result.thrown.warnings, *joined.warnings, *more]
    wish.told = "\n".join(list(dict.fromkeys(str(line) for line in told))[:MOST_LINES])


def leave(scene: bpy.types.Scene, body: bpy.types.Object) -> None:
    """The armature plays what it did before, and so does its ball; what was made for the throw goes."""
    wish = body.beyond_mocap_throw
    channels.check_local(body, wish.flown)
    channels.check_free(body)
    flown.give_back(scene, body)
    played = channels.playing(body)[0]
    if wish.rigged and played is not None and played.get(MARK):
        rigged.take_away(body)
    elif wish.before.kept:
        bring_back(wish.before, body, MARK)
    _settle(wish)


def keep(body: bpy.types.Object) -> None:
    """The throw stays as the armature's own motion, its ball as an object of the user's."""
    wish = body.beyond_mocap_throw
    channels.check_local(body, wish.flown)
    played = channels.playing(body)[0]
    if played is not None and played.get(MARK):
        for name in (MARK, *BAKED):
            played.pop(name, None)
    drop(wish.before, MARK)
    flown.keep(body)
    _settle(wish)


def figures(result: "Result") -> list[str]:
    """Lines "name: value" about a throw."""
    thrown, joined, fps = result.thrown, result.joined, result.order.fps
    velocity = thrown.launch.velocity
    speed, level = float(np.linalg.norm(velocity)), float(np.linalg.norm(velocity[:2]))
    up = np.degrees(np.arctan2(velocity[2], level))
    limb = "Wrist" if result.order.act == "throw" else "Ankle"
    lines = [
        f"Leaves on frame: {joined.release * fps:.2f}", f"Leaves with: {speed:.1f} m/s",
        f"Launch angle: {up:.0f}\N{DEGREE SIGN}",
        f"Passes the target by: {100.0 * thrown.impact_error:.1f} cm",
        f"Flight to the target: {result.seconds:.2f} s",
        f"{limb} moved to hit: {100.0 * thrown.moved:.1f} cm", f"Slowest that gets there: {thrown.slowest:.1f} m/s",
    ]
    if np.isfinite(result.usual_jerk):
        lines.append(f"Seam jerk, of p99: {100.0 * result.jerk / result.usual_jerk:.0f} %")
    return lines


def _settle(wish) -> None:
    for name in RESULTS:
        wish.property_unset(name)
