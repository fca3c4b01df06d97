"""Where the players stand: a pitch with its lines, daylight, and a camera that keeps them in view."""

from __future__ import annotations

import bpy
import numpy as np

from ..core import channels
from ..core.measure import units_per_metre
from . import pitch

NAME = "Stage"
FOCUS = "Stage focus"
MARK = "beyond_mocap_focus"
OURS = "beyond_mocap_stage"
"""Custom property of the collection and of all that `create` puts into it."""

EARLIER = {"Grass", "Lines", "Sun", "Camera", FOCUS}  # what stages of files from before that property hold
HALF_WIDTH = 0.36  # metres to either side that the camera shows with some margin, per metre of its distance
CAMERA_FROM = (-1.5, -8.5, 1.3)  # metres from the focus: from the touchline, a little above the players' heads


def create(context: bpy.types.Context, camera: bool = True) -> bpy.types.Collection:
    """A collection "Stage" with pitch, sun and, if wanted, a camera; an older one is taken away first."""
    scene = context.scene
    remove(scene)
    stage = bpy.data.collections.new(NAME)
    scene.collection.children.link(stage)
    units = units_per_metre(scene)
    pitch.grass(stage, units)
    pitch.lines(stage, units)
    sun(stage)
    if camera:
        scene.camera = _camera(stage, units)
    for thing in (stage, *stage.objects):
        thing[OURS] = True
    if scene.world is None:
        scene.world = sky()
    return stage


def remove(scene: bpy.types.Scene) -> None:
    """Take the stage away, with the meshes, lights and cameras that only it used; what the user has put into its
    collection stays, and so does a collection of his own that has its name."""
    stage = _stage(scene)
    if stage is None:
        return
    for thing in _own(stage):
        data = thing.data
        bpy.data.objects.remove(thing)
        if data is not None and not data.users:
            bpy.data.batch_remove([data])
    if not stage.objects and not stage.children:
        bpy.data.collections.remove(stage)


def focus(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """The empty that the stage's camera hangs on; None where there is no such camera."""
    stage = _stage(scene)
    return stage.objects.get(FOCUS) if stage else None


def _stage(scene: bpy.types.Scene) -> bpy.types.Collection | None:
    """The collection that `create` has made, by now or in an earlier version."""
    found = next((one for one in scene.collection.children if one.get(OURS) and one.library is None), None)
    if found is not None:
        return found
    named = scene.collection.children.get(NAME)
    return named if named is not None and _own(named) else None


def _own(stage: bpy.types.Collection) -> list[bpy.types.Object]:
    """What `create` has put into a collection."""
    if stage.get(OURS):
        return [thing for thing in stage.objects if thing.get(OURS)]
    named = {thing: thing.name.split(".")[0] for thing in stage.objects}
    whole = {"Grass", "Lines"} <= set(named.values())
    return [thing for thing, name in named.items() if whole and name in EARLIER]


def follow(scene: bpy.types.Scene, frames: np.ndarray, places: np.ndarray, reach: np.ndarray) -> None:
    """Let the stage's camera follow and stand back as far as it takes; nothing happens where there is no such camera.

    frames: (F,) scene frames. places: (F, 2) metres, the middle of what is to be seen. reach: (F,) metres from there to
    the farthest player. The camera hangs on an empty, whose size is its distance.
    """
    target = focus(scene)
    if target is None:
        return
    path = np.column_stack([places * units_per_metre(scene), np.full(len(frames), target.location.z)])
    distance = np.maximum(1.0, reach / (HALF_WIDTH * np.linalg.norm(CAMERA_FROM)))
    group = "Object Transforms"
    curves = {"location": (group, path), "scale": (group, np.repeat(distance[:, None], 3, axis=1))}
    channels.discard(target, MARK)
    channels.animate(target, FOCUS, frames, curves)[MARK] = True


def sun(collection) -> bpy.types.Object:
    """Daylight from above, a little aside."""
    light = bpy.data.lights.new("Sun", "SUN")
    light.energy, light.angle = 2.8, 0.03
    thing = pitch.place(collection, "Sun", light)
    thing.rotation_euler = (0.75, 0.25, 0.5)
    return thing


def _camera(stage, units: float) -> bpy.types.Object:
    focus = pitch.place(stage, FOCUS, None)
    focus.empty_display_size = 0.5 * units
    focus.location = (0.0, 0.0, 0.9 * units)
    data = bpy.data.cameras.new("Camera")
    data.lens, data.clip_end = 40.0, 1000.0 * units
    camera = pitch.place(stage, "Camera", data)
    camera.parent = focus
    camera.location = [distance * units for distance in CAMERA_FROM]
    look = camera.constraints.new("TRACK_TO")
    look.target = focus
    look.track_axis, look.up_axis = "TRACK_NEGATIVE_Z", "UP_Y"
    return camera


def sky() -> bpy.types.World:
    """A world of pale blue."""
    world = bpy.data.worlds.new("Sky")
    if world.node_tree is None:
        world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.55, 0.68, 0.85, 1.0)
    background.inputs["Strength"].default_value = 1.1
    return world
