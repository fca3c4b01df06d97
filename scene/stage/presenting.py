"""Show what an operator has made: the 3D view moves to it, and the stage's cameras follow it."""

from __future__ import annotations

from contextlib import contextmanager

import bpy
import numpy as np

from ..core import window
from . import cameras
from .ball import is_ball
from .cast import find_ball
from .stage_collection import STAGE_MARK

MOST = 6  # bodies that are framed; of more, those nearest to the ball
DOT_HEIGHT = 6.0  # m that are shown around dots, which have no size
KINDS = {"ARMATURE", "EMPTY", "MESH"}


@contextmanager
def present_new_objects(context: bpy.types.Context):
    """Frame the bodies, dots and marker clouds that are new at the end of a `with`, and update the stage's cameras.

    What is only made again moves no view.
    """
    scene = context.scene
    before = {thing.session_uid for thing in scene.objects}
    yield
    cameras.update_cameras(scene)
    new = [thing for thing in scene.objects if thing.session_uid not in before]
    chosen = choose_objects(scene, new)
    window.frame_objects(bpy.context, chosen, DOT_HEIGHT if all(thing.type == "EMPTY" for thing in chosen) else 1.8)


def choose_objects(scene: bpy.types.Scene, new: list[bpy.types.Object]) -> list[bpy.types.Object]:
    """Choose which of the new objects of a scene to frame: bodies if there are any, else what else can be seen.

    A new ball is framed with the selected body, which throws or kicks it.
    """
    shown = [thing for thing in new if thing.type in KINDS and thing.parent is None and not thing.get(STAGE_MARK)]
    bodies = [thing for thing in shown if thing.type == "ARMATURE"]
    if bodies:
        return _find_nearest(scene, bodies)
    throwers = [thing for thing in bpy.context.selected_objects if thing.type == "ARMATURE"]
    return shown + throwers if any(map(is_ball, shown)) else shown


def _find_nearest(scene: bpy.types.Scene, bodies: list[bpy.types.Object]) -> list[bpy.types.Object]:
    """Find the bodies nearest to the ball, or to their own middle; of few all."""
    if len(bodies) <= MOST:
        return bodies
    depsgraph, ball = bpy.context.evaluated_depsgraph_get(), find_ball(scene)
    places = np.array([window.find_middle(body.evaluated_get(depsgraph)) for body in bodies])
    middle = np.array(ball.evaluated_get(depsgraph).matrix_world.translation) if ball is not None else np.median(places,
                                                                                                                axis=0)
    return [bodies[i] for i in np.argsort(np.linalg.norm(places - middle, axis=1), kind="stable")[:MOST]]
