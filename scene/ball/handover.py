"""Let Blender's rigid bodies move an animated ball from a frame on, with its velocity and spin there, and revert that.

Blender takes a body's first velocity from its last keyed step, the mean over that frame: for a flying ball, half a
frame of gravity is missing. So the key before the handover is moved by that amount (some millimetres), and restored
afterwards.
"""

from __future__ import annotations

import json

import bmesh
import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ..core import channels
from ..core.measure import frames_per_second, units_per_metre

GROUND = "Ball Ground"
SIZE, THICKNESS = 300.0, 2.0  # m, side and thickness of the slab under the ball
PHYSICS_MARK = "beyond_mocap_physics"  # custom property of objects created by a handover
ANGULAR_DAMPING = 0.4  # angular damping; without it Blender's balls roll for ever
SELECTION = ("selected_objects", "selected_editable_objects")
CACHE_RANGE = ("frame_start", "frame_end")
MAX_GRAVITY_WEIGHT = 200.0  # limit of the gravity weight; Blender's gravity is in units/s^2, whatever a unit is
WORLD_QUALITY = {"substeps_per_frame": 20, "solver_iterations": 20}


def start_physics(
    scene: bpy.types.Scene, ball: bpy.types.Object, frame: int, kind: str, solid: list[bpy.types.Object]
) -> None:
    """Let Blender's rigid bodies move the ball from a frame on, over a slab whose top is the ground.

    Args:
        scene: the scene.
        ball: the animated ball.
        frame: of the handover.
        kind: one of `physics.BALLS`.
        solid: objects the ball collides with.
    Raises:
        InputError: if that is not possible; nothing is changed then.
    """
    from ...beyond_mocap.ball.physics import BALLS

    _check_ball(ball, frame)
    curves = channels.collect_curves(*channels.find_playing_action(ball))
    fps = frames_per_second(scene)
    velocity = _measure_velocity(curves, frame, fps)
    old_keys = _shift_keys(curves, frame, velocity, fps)
    others = any(thing.beyond_mocap_aim.handed for thing in scene.objects)
    stored = {"world": scene.rigidbody_world is not None, "others": others, "solid": [], "keys": old_keys}
    _create_world(scene, frame, stored)
    _create_solids(scene, solid, stored)
    _add_ball_body(scene, ball, frame, BALLS[kind], np.linalg.norm(velocity) / units_per_metre(scene))
    aim = ball.beyond_mocap_aim
    aim.handed, aim.handover, aim.handed_before = True, frame, json.dumps(stored)


def stop_physics(scene: bpy.types.Scene, ball: bpy.types.Object) -> None:
    """Return the ball to its keys and remove what the handover created, unless another ball needs it.

    Args:
        scene: the scene.
        ball: the ball.
    """
    channels.check_local(ball)
    _check_visible(ball)
    aim = ball.beyond_mocap_aim
    stored = json.loads(aim.handed_before or "{}")
    if ball.rigid_body is not None:
        _remove_rigid_body(ball)
    action, slot = channels.find_playing_action(ball)
    if action is not None:
        curves = channels.collect_curves(action, slot)
        for path, index, at, value in stored.get("keys", ()):
            _set_key(curves.get((path, index)), at, value)
        kinematic = curves.get(("rigid_body.kinematic", 0))
        if kinematic is not None:
            channels.remove_curve(action, slot, kinematic)
    for name in ("handed", "handed_before"):
        aim.property_unset(name)
    other_ball = next((thing for thing in scene.objects if thing.beyond_mocap_aim.handed), None)
    if other_ball is not None:
        _transfer_stored(other_ball, stored)
        return
    _remove_solids(scene, stored)
    _restore_world(scene, stored)


def _transfer_stored(other_ball: bpy.types.Object, stored: dict) -> None:
    """Transfer the stored values to another ball that is handed over, which restores them when it is the last one."""
    other_stored = json.loads(other_ball.beyond_mocap_aim.handed_before or "{}")
    if not stored.get("others"):
        other_stored.update({name: stored[name] for name in ("world", "gravity", *WORLD_QUALITY, *CACHE_RANGE)
                             if name in stored}, others=False)
    other_stored["solid"] = [*stored.get("solid", ()), *other_stored.get("solid", ())]
    other_ball.beyond_mocap_aim.handed_before = json.dumps(other_stored)


def _remove_solids(scene: bpy.types.Scene, stored: dict) -> None:
    """Remove the rigid bodies of objects that were made solid, and the added ground."""
    for name in stored.get("solid", ()):
        thing = scene.objects.get(name)
        if thing is not None and thing.rigid_body is not None and thing.visible_get():
            _remove_rigid_body(thing)
    slab = scene.objects.get(GROUND)
    if slab is not None and slab.get(PHYSICS_MARK):
        mesh = slab.data
        bpy.data.objects.remove(slab)
        bpy.data.meshes.remove(mesh)


def _restore_world(scene: bpy.types.Scene, stored: dict) -> None:
    """Restore the rigid-body world, or remove it if there was none."""
    world = scene.rigidbody_world
    if world is not None and not stored.get("world", True):
        with bpy.context.temp_override(scene=scene):
            bpy.ops.rigidbody.world_remove()
    elif world is not None:
        for name in WORLD_QUALITY:
            setattr(world, name, stored.get(name, getattr(world, name)))
        world.effector_weights.gravity = stored.get("gravity", world.effector_weights.gravity)
        for name in CACHE_RANGE if not world.point_cache.is_baked else ():
            setattr(world.point_cache, name, stored.get(name, getattr(world.point_cache, name)))


def _check_ball(ball: bpy.types.Object, frame: int) -> None:
    """Check that a ball can be handed over on a frame; InputError otherwise."""
    channels.check_local(ball)
    channels.check_editable(ball)
    if ball.type != "MESH":
        raise InputError(f"object {ball.name}", f"of type {ball.type.lower()}", "a mesh", "select the ball")
    _check_visible(ball)
    if ball.beyond_mocap_aim.handed or ball.rigid_body is not None:
        step = "press Ball from Physics first"
        raise InputError(f"ball {ball.name}", "already a rigid body", "a ball with keys only", step)
    if ball.parent is not None or any(constraint.influence for constraint in ball.constraints):
        found = "it has a parent or a constraint"
        raise InputError(f"ball {ball.name}", found, "a ball moved by its keys only", "free the ball first")
    action, slot = channels.find_playing_action(ball)
    ends = channels.find_key_range(channels.collect_curves(action, slot)) if action is not None else None
    if ends is None or not ends[0] + 2 <= frame <= ends[1]:
        found = "no keys" if ends is None else f"keys on frames {ends[0]} to {ends[1]}"
        expected = f"keys from two frames before the handover on frame {frame} up to it"
        raise InputError(f"ball {ball.name}", found, expected, "choose another frame")
    if any(("location", axis) not in channels.collect_curves(action, slot) for axis in range(3)):
        raise InputError(f"ball {ball.name}", "a coordinate without keys", "keys of all three", "key its location")
    channels.check_local(action)


def _check_visible(ball: bpy.types.Object) -> None:
    """Check that a ball is visible, because Blender does not change hidden rigid bodies; InputError otherwise."""
    if not ball.visible_get():
        step = "show it with Alt-H, or its collection"
        raise InputError(f"ball {ball.name}", "it is hidden", "a visible ball", step)


def _measure_velocity(curves: dict, frame: int, fps: float) -> np.ndarray:
    """Measure the ball's velocity (3,) on a frame, units per second, from the keys on either side; at a bounce from
    those before.
    """
    at = np.array([frame - 2, frame - 1, frame, frame + 1], float)
    places = np.stack([channels.sample_curve(curves["location", axis], at) for axis in range(3)], axis=1)
    before, last = places[2] - places[1], 1.5 * places[2] - 2.0 * places[1] + 0.5 * places[0]
    ahead = places[3] - places[2]
    smooth = np.linalg.norm(ahead - before) < 0.2 * np.linalg.norm(before) + 1e-6
    return (0.5 * (ahead + before) if smooth else last) * fps


def _shift_keys(curves: dict, frame: int, velocity: np.ndarray, fps: float) -> list:
    """Move the key before the handover so that the last step has the ball's velocity; return (path, index, frame,
    old value).
    """
    old_keys = []
    for axis in range(3):
        curve = curves["location", axis]
        now, old = (float(value) for value in channels.sample_curve(curve, np.array([frame, frame - 1.0])))
        if _set_key(curve, frame - 1.0, now - float(velocity[axis]) / fps):
            old_keys.append(("location", axis, frame - 1.0, old))
    return old_keys


def _set_key(curve, frame: float, value: float) -> bool:
    """Set a curve's key on a frame to another value; return whether there is one."""
    for key in curve.keyframe_points if curve is not None else ():
        if abs(key.co.x - frame) < 0.005:
            key.co.y = value
            curve.update()
            return True
    return False


def _create_world(scene, frame: int, stored: dict) -> None:
    """Create or adapt the rigid-body world, and store its values."""
    if scene.rigidbody_world is None:
        with bpy.context.temp_override(scene=scene):
            bpy.ops.rigidbody.world_add()
    world = scene.rigidbody_world
    for name, value in WORLD_QUALITY.items():
        stored[name] = getattr(world, name)
        setattr(world, name, max(value, getattr(world, name)))
    stored["gravity"] = world.effector_weights.gravity
    if not stored["others"]:
        world.effector_weights.gravity = min(stored["gravity"] * units_per_metre(scene), MAX_GRAVITY_WEIGHT)
    cache = world.point_cache
    stored.update({name: getattr(cache, name) for name in CACHE_RANGE})
    if not cache.is_baked:
        cache.frame_start = min(cache.frame_start, frame - 2) if stored["world"] else frame - 2
        cache.frame_end = max(cache.frame_end, scene.frame_end, frame + int(5 * frames_per_second(scene)))


def _create_solids(scene, solid: list, stored: dict) -> None:
    """Create the ground, and make it and the given objects solid."""
    slab = scene.objects.get(GROUND)
    if slab is None:
        units = units_per_metre(scene)
        mesh, shape = bpy.data.meshes.new(GROUND), bmesh.new()
        bmesh.ops.create_cube(shape, size=1.0)
        for corner in shape.verts:
            corner.co.x, corner.co.y = corner.co.x * SIZE * units, corner.co.y * SIZE * units
            corner.co.z = (corner.co.z - 0.5) * THICKNESS * units
        shape.to_mesh(mesh)
        shape.free()
        slab = bpy.data.objects.new(GROUND, mesh)
        slab[PHYSICS_MARK] = True
        slab.hide_render = slab.hide_select = True
        slab.display_type = "BOUNDS"
        scene.collection.objects.link(slab)
    for thing in (slab, *solid):
        if thing.rigid_body is None:
            _add_rigid_body(thing, "PASSIVE")
            thing.rigid_body.collision_shape = "BOX" if thing is slab else "MESH"
            thing.rigid_body.restitution = thing.rigid_body.friction = 1.0  # Blender multiplies those of both
            thing.rigid_body.use_margin, thing.rigid_body.collision_margin = True, 0.0
            if thing is slab:
                thing.hide_set(True)
            else:
                stored["solid"].append(thing.name)


def _add_ball_body(scene, ball: bpy.types.Object, frame: int, kind, speed: float) -> None:
    """Add the ball's rigid body with its physical values, and key when it takes over."""
    _add_rigid_body(ball, "ACTIVE")
    body = ball.rigid_body
    body.collision_shape, body.mass = "SPHERE", kind.mass
    body.restitution, body.friction = kind.restitution, kind.friction or 0.2
    body.linear_damping = float(-np.expm1(-(kind.linear_drag + kind.drag * speed)))
    body.angular_damping = ANGULAR_DAMPING
    body.use_margin, body.collision_margin, body.use_deactivation = True, 0.0, True
    for at, keyed in ((frame, True), (frame + 1, False)):
        body.kinematic = keyed
        ball.keyframe_insert("rigid_body.kinematic", frame=at)


def _add_rigid_body(thing: bpy.types.Object, kind: str) -> None:
    with bpy.context.temp_override(object=thing, active_object=thing, **dict.fromkeys(SELECTION, [thing])):
        bpy.ops.rigidbody.object_add(type=kind)


def _remove_rigid_body(thing: bpy.types.Object) -> None:
    with bpy.context.temp_override(object=thing, active_object=thing, **dict.fromkeys(SELECTION, [thing])):
        bpy.ops.rigidbody.object_remove()
