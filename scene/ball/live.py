"""Update aimed balls while their target is dragged and their settings or bodies are edited.

Blender reports every change. A timer, which also runs during modal operators, then compares what each ball's trajectory
was computed from with the present state. Our own writes are such changes too, and cause no update. If the target is
unreachable, the ball shows the error and keeps its last trajectory.
"""

from __future__ import annotations

import bpy

from ..core import channels, window
from ..core.live import Watcher, call_or_describe
from . import shots
from .settings import MARK, list_aimed_balls


def update_balls(scene: bpy.types.Scene) -> int:
    """Update all live balls of a scene; return how many changed."""
    count = 0
    for ball in list_aimed_balls(scene):
        aim = ball.beyond_mocap_aim
        if aim.live and not aim.handed and ball.library is None:
            message = f"{ball.name}: aiming failed"
            count += call_or_describe(lambda: update_ball(scene, ball), lambda text: report_problem(ball, text),
                                      message)
    if count:
        window.redraw_editors()
    return count


def update_ball(scene: bpy.types.Scene, ball: bpy.types.Object) -> bool:
    """Update a ball if what its trajectory was computed from has changed; return whether it had."""
    request, stored = shots.build_request(scene, ball), shots.find_solved(ball)
    digest = shots.compute_digest(request, shots.find_strikes(scene, request))
    played = channels.find_playing_action(ball)[0]
    written = played.get(MARK) if played is not None else None
    if stored is not None and stored.digest == digest == written:
        return report_problem(ball, "")
    solved = shots.solve_request(scene, request, ball.name)
    if digest == written:  # written by another session: only the overlay is missing
        shots.store_solved(ball, solved)
        return False
    shots.write_shot(scene, ball, solved)
    return True


def report_problem(ball: bpy.types.Object, text: str) -> bool:
    """Show a problem at the ball; return whether it is new."""
    is_new = ball.beyond_mocap_aim.messages != text
    if is_new:
        ball.beyond_mocap_aim.messages = text
    return is_new


def detect_changes(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Detect which keys may have changed, and whether a ball may need an update."""
    if not shots.has_solved_shots():
        return
    bodies = {ball.beyond_mocap_aim.body for ball in list_aimed_balls(scene)}
    for update in depsgraph.updates:
        thing = update.id.original
        if isinstance(thing, bpy.types.Action):
            if not thing.get(MARK):
                shots.clear_strikes()
                WATCHER.mark_dirty()
        elif isinstance(thing, bpy.types.Object):
            if thing in bodies:
                shots.clear_strikes(thing)
            WATCHER.mark_dirty()
        elif isinstance(thing, (bpy.types.Armature, bpy.types.Scene)):
            WATCHER.mark_dirty()


WATCHER = Watcher(name="Aimed balls", changed=detect_changes, follow=update_balls,
                  restored=lambda: shots.clear_strikes(), loaded=lambda: shots.clear_all(),
                  ends=lambda: shots.clear_all())
