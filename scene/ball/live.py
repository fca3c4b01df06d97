"""Aimed balls follow while their target is dragged and their settings or bodies are edited.

Blender says after every change that something has changed; a timer, which runs during modal operators too, then
compares what each ball's way was made of with what there is now. Our own writes are such changes too, and find nothing
to do. What cannot be hit just now is told at the ball, which keeps its last way.
"""

from __future__ import annotations

import bpy

from ..core import channels, window
from ..core.live import Watcher, attempt
from . import shots
from .settings import MARK, aimed


def follow(scene: bpy.types.Scene) -> int:
    """Bring all live balls of a scene up to date; of how many there is anything new."""
    count = 0
    for ball in aimed(scene):
        aim = ball.beyond_mocap_aim
        if aim.live and not aim.handed and ball.library is None:
            failed = f"{ball.name}: could not be aimed here"
            count += attempt(lambda: renew(scene, ball), lambda text: tell(ball, text), failed)
    if count:
        window.redraw()
    return count


def renew(scene: bpy.types.Scene, ball: bpy.types.Object) -> bool:
    """Aim a ball again where what its way was made of is another than it was; whether it was."""
    wish, known = shots.wish_of(scene, ball), shots.solved_of(ball)
    made_of = shots.digest(wish, shots.strikes_of(scene, wish))
    played = channels.playing(ball)[0]
    written = played.get(MARK) if played is not None else None
    if known is not None and known.digest == made_of == written:
        return tell(ball, "")
    solved = shots.solve(scene, wish, ball.name)
    if made_of == written:  # another session has written it: only what is drawn is lacking
        shots.remember(ball, solved)
        return False
    shots.write(scene, ball, solved)
    return True


def tell(ball: bpy.types.Object, text: str) -> bool:
    """Say at the ball what is wrong; whether that is new."""
    new = ball.beyond_mocap_aim.told != text
    if new:
        ball.beyond_mocap_aim.told = text
    return new


def look_at(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Note which keys may be others, and whether a ball may have to be aimed again."""
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
