"""The ball that left the hand: an object on its way, and a marker on the timeline."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.motion import quaternion
from ..core import channels
from ..core.measure import frames_per_second, units_per_metre
from ..stage import ball as balls
from . import cloud as clouds
from . import kept as store
from .settings import is_alone

if TYPE_CHECKING:
    from ...beyond_mocap.markers.release.release import Release, ReleaseSettings
    from ...beyond_mocap.markers.trial import MarkerTrial
    from ...beyond_mocap.motion.motion import Motion

MADE = "beyond_mocap_thrown"  # custom property of balls (their mesh's radius) and actions made here; no group's name


def order_of(scene: bpy.types.Scene, cloud: bpy.types.Object) -> tuple[str, "MarkerTrial", "Motion", "ReleaseSettings"]:
    """What is asked of a cloud: its name, its markers as recorded, on the motion's floor, the motion, the settings.
    InputError where its body has not been reconstructed in this session."""
    from ...beyond_mocap.markers.release.release import ReleaseSettings

    channels.check_local(cloud, cloud.data)
    clouds.played_rate(cloud, scene)
    kept, chosen = cloud.beyond_mocap_cloud, scene.beyond_mocap_markers
    made = store.made(kept.made)
    if made is None:
        raise InputError(cloud.name, "not reconstructed in this session", "a body", "press Reconstruct first")
    marked = [row.name for row in kept.labels if row.role == "BALL" and row.name in made.raw.labels]
    hand = None if chosen.hand == "AUTO" else chosen.hand
    asked = ReleaseSettings(marked[0] if marked else None, chosen.radius or None, hand, chosen.thrown)
    trial = made.raw.with_positions(made.raw.positions - [0.0, 0.0, made.lowered])
    return cloud.name, trial, made.motion, asked


def show(context: bpy.types.Context, cloud: bpy.types.Object, found: "Release") -> bpy.types.Object:
    """The ball on its way, the release on the timeline, and figures in the panel; returns the ball."""
    scene, kept, thing = context.scene, cloud.beyond_mocap_cloud, cloud.beyond_mocap_cloud.ball
    lost = thing is None or thing.library is not None or thing.name not in scene.objects
    if lost or not is_alone(cloud, scene, "ball"):
        room = cloud.users_collection[0] if cloud.users_collection else context.collection
        thing = kept.ball = balls.create(context, f"{cloud.name} ball", room, found.radius)
        thing[MADE] = found.radius
    elif thing.get(MADE):
        thing.scale = (found.radius / thing[MADE],) * 3
    channels.discard(thing, MADE)
    slowed = clouds.played_rate(cloud, scene) / kept.fps
    world = kept.body.matrix_world if kept.body is not None else cloud.matrix_world
    matrix, units = np.array(world), units_per_metre(scene)
    places = found.path.positions @ matrix[:3, :3].T + matrix[:3, 3] / units
    turned = quaternion.from_rotation_vector(np.maximum(found.path.times - found.time, 0.0)[:, None] * found.spin)
    path = replace(found.path, times=found.path.times / slowed, positions=places, rotations=turned)
    balls.write(thing, path, scene, clouds.start_frame(cloud))[MADE] = True
    mark(scene, f"{cloud.name} release", clouds.start_frame(cloud) + found.time / slowed * frames_per_second(scene))
    kept.release = "\n".join(lines(found))
    return thing


def mark(scene: bpy.types.Scene, name: str, frame: float) -> None:
    """A marker of that name on the timeline, in place of an older one."""
    for older in [marker for marker in scene.timeline_markers if marker.name == name]:
        scene.timeline_markers.remove(older)
    scene.timeline_markers.new(name, frame=round(frame))


def lines(found: "Release") -> list[str]:
    """Lines "name: value" for the panel."""
    told = [
        f"Speed: {found.speed:.1f} ± {found.speed_sigma:.1f} m/s",
        f"That is: {3.6 * found.speed:.0f} km/h",
        f"Released: {found.time:.3f} s ± {1000.0 * found.time_sigma:.0f} ms",
        f"Hand: {found.side}",
        f"Told by: {found.how}",
    ]
    if found.radar is not None:
        told.append(f"Radar: {found.radar:.1f} m/s, {100.0 * (found.speed / found.radar - 1.0):+.1f} %")
    return [*told, *found.notes]
