"""Update aimed balls while their target is dragged and their settings or bodies are edited.

Blender reports every change. A timer, which also runs during modal operators, then compares what each ball's trajectory
was computed from with the present state. Our own writes are such changes too, and cause no update. If the target is
unreachable, the ball shows the error and keeps its last trajectory.
"""

from __future__ import annotations

import bpy

from ..core import channels, window
from ..core.live import Watcher, attempt
from . import shots
from .settings import MARK, aimed


def follow(scene: bpy.types.Scene) -> int:
    """Update all live balls of a scene; return how many changed."""
    count = 0
    for ball in aimed(scene):
        aim = ball.beyond_mocap_aim
        if aim.live and not aim.handed and ball.library is None:
            failed = f"{ball.name}: aiming failed"
            count += attempt(lambda: renew(scene, ball), lambda text: tell(ball, text), failed)
    if count:
        window.redraw()
    return count


def renew(scene: bpy.types.Scene, ball: bpy.types.Object) -> bool:
    """Update a ball if what its trajectory was computed from has changed; return whether it had."""
    wish, known = shots.wish_of(scene, ball), shots.solved_of(ball)
    made_of = shots.digest(wish, shots.strikes_of(scene, wish))
    played = channels.playing(ball)[0]
    written = played.get(MARK) if played is not None else None
    if known is not None and known.digest == made_of == written:
        return tell(ball, "")
    solved = shots.solve(scene, wish, ball.name)
    if made_of == written:  # written by another session: only the overlay is missing
        shots.remember(ball, solved)
        return False
    shots.write(scene, ball, solved)
    return True


def tell(ball: bpy.types.Object, text: str) -> bool:
    """Show a problem at the ball; return whether it is new."""
    new = ball.beyond_mocap_aim.told != text
    if new:
        ball.beyond_mocap_aim.told = text
    return new


def look_at(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Detect which keys may have changed, and whether a ball may need an update."""
    if not shots.anything():
        return
    bodies = {ball.beyond_mocap_aim.body for ball in aimed(scene)}
    for update in depsgraph.updates:
        thing = update.id.original
        if isinstance(thing, bpy.types.Action):
            if not thing.get(MARK):
                shots.unsure()
                WATCHER.mark()
        elif isinstance(thing, bpy.types.Object):
            if thing in bodies:
                shots.unsure(thing)
            WATCHER.mark()
        elif isinstance(thing, (bpy.types.Armature, bpy.types.Scene)):
            WATCHER.mark()


WATCHER = Watcher(name="Aimed balls", changed=look_at, follow=follow, restored=shots.unsure, loaded=shots.forget,
                  ends=shots.forget)
