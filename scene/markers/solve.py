"""From a cloud to a body: the request of a reconstruction, and its result in the scene: body, model text and thrown
ball.

Reconstructions are stored in memory at the recording's own rate, which an action does not have, under names that a
cloud keeps.
"""

from __future__ import annotations

import itertools
import uuid
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np
from mathutils import Matrix

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.motion import quaternion
from ..core import action, channels
from ..core.measure import frames_per_second, units_per_metre
from ..core.properties import property_values
from ..core.settings import absolute
from ..result import bake
from ..rigs import armature
from ..stage import ball as balls
from ..stage import body
from . import cloud as clouds
from . import sets
from .settings import is_alone, is_cloud

if TYPE_CHECKING:
    from ...beyond_mocap.markers.model.model import MarkerModel
    from ...beyond_mocap.markers.reconstruct import Reconstruction, ReconstructSettings
    from ...beyond_mocap.markers.release.release import Release, ReleaseSettings
    from ...beyond_mocap.markers.trial import MarkerTrial
    from ...beyond_mocap.motion.motion import Motion

MADE = "beyond_mocap_reconstructed"  # custom property of actions created here; no property group has this name
THROWN = "beyond_mocap_thrown"  # custom property of balls (their mesh's radius) and actions created here
SKIN = (0.55, 0.55, 0.60)
MOST_KEPT = 30  # reconstructions in memory
_numbers = itertools.count(1)
# Part of every name, so that names of another session are not confused with those of this one.
_session = uuid.uuid4().hex[:8]
_made: dict[str, "Reconstruction"] = {}


@dataclass(frozen=True)
class Order:
    """Everything that a reconstruction needs of a cloud, without bpy.

    Attributes:
        cloud: its name.
        trial: its markers.
        static: its static trial, or None.
        model: its model, or None.
        settings: the options.
        add: path of the clip to write, or None.
        words: labels of that clip.
    """

    cloud: str
    trial: "MarkerTrial"
    static: "MarkerTrial | None"
    model: "MarkerModel | None"
    settings: "ReconstructSettings"
    add: Path | None = None
    words: tuple[str, ...] = ()


def order_of(scene: bpy.types.Scene, cloud: bpy.types.Object) -> Order:
    """Build the request of a cloud from its own settings and the scene's; raise InputError where something is
    missing.
    """
    channels.check_local(cloud, cloud.data)
    kept, chosen = cloud.beyond_mocap_cloud, scene.beyond_mocap_markers
    trial = clouds.read(cloud, scene)
    clouds.played_rate(cloud, scene)
    static = _static_of(cloud, scene)
    words = tuple(chosen.words.split()) if chosen.add else ()
    return Order(cloud.name, trial, static and clouds.read(static, scene),
                 model=model_of(cloud) if kept.use_model else None, settings=settings_of(cloud, chosen, words),
                 add=clip_place(scene, cloud.name) if chosen.add else None, words=words)


def _static_of(cloud: bpy.types.Object, scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Find the static trial of a cloud; raise InputError where it was deleted, since the pointer keeps deleted
    objects.
    """
    kept = cloud.beyond_mocap_cloud
    if kept.use_model or not is_cloud(kept.static) or kept.static == cloud:
        return None
    if scene.objects.get(kept.static.name) != kept.static:
        raise InputError(cloud.name, f"its static trial {kept.static.name} is not in the scene",
                         "a cloud of this scene", "choose another, or clear the field")
    return kept.static


def settings_of(cloud: bpy.types.Object, chosen, words: tuple[str, ...] = ()) -> "ReconstructSettings":
    """Build the options of a reconstruction; the marker set is the cloud's own where its markers have segments."""
    from ...beyond_mocap.markers.reconstruct import ReconstructSettings

    assigned = any(row.segment for row in cloud.beyond_mocap_cloud.labels)
    throw = any(word.startswith("throw") for word in words)
    return ReconstructSettings(marker_set=sets.of_cloud(cloud) if assigned else None,
                               release="yes" if throw else "auto",
                               **property_values(ReconstructSettings, chosen, "markers"))


def clip_place(scene: bpy.types.Scene, name: str) -> Path:
    """Find a free path for the clip in the library folder; raise InputError without a folder, or where the name is
    taken.
    """
    from ...beyond_mocap.library.keep_words import free_place

    folder = scene.beyond_mocap.library_folder
    if not folder:
        raise InputError("library", "no folder", "a library folder", "choose it in the panel Library")
    return free_place(Path(absolute(folder)), bpy.path.clean_name(name))


def show(context: bpy.types.Context, cloud: bpy.types.Object, made: "Reconstruction") -> bpy.types.Object:
    """Show the result beside the cloud: an armature that moves with it, and messages in the panel; return the
    armature.
    """
    scene, kept = context.scene, cloud.beyond_mocap_cloud
    thing = kept.body
    if thing is None or not is_alone(cloud, scene, "body") or not fits(thing, made, scene):
        room = cloud.users_collection[0] if cloud.users_collection else context.collection
        thing = kept.body = armature.create(context, made.motion.skeleton, f"{cloud.name} body", room)
    if scene.beyond_mocap_markers.dressed and not any(child.type == "MESH" for child in thing.children):
        body.create(thing, thing.name, SKIN, collection=thing.users_collection[0], scene=scene, example=made.motion)
    thing.matrix_world = Matrix()
    context.view_layer.update()
    slowed = clouds.played_rate(cloud, scene) / kept.fps
    played = replace(made.motion, fps=made.motion.fps * slowed)
    channels.discard(thing, MADE)
    action.write(thing, played, scene, clouds.start_frame(cloud), cloud.name, generated=True)[MADE] = True
    thing.matrix_world = cloud.matrix_world
    bake.lengthen(scene, clouds.start_frame(cloud) + played.duration * frames_per_second(scene))
    kept.made, kept.figures, kept.told = keep_reconstruction(made), "\n".join(figures(made)), "\n".join(made.warnings)
    keep_model(cloud, made.model)
    kept.release = ""
    if made.release is not None:
        show_release(context, cloud, made.release)
    return thing


def fits(thing: bpy.types.Object, made: "Reconstruction", scene: bpy.types.Scene) -> bool:
    """Return whether an earlier body has the same bones and may be overwritten."""
    if thing.type != "ARMATURE" or thing.library is not None or thing.name not in scene.objects:
        return False
    return armature.skeleton_of(thing, scene).same_bones(made.motion.skeleton, 1e-4)


def figures(made: "Reconstruction") -> list[str]:
    """List lines "name: value" for the panel."""
    residual = made.solved.residual
    away = 1000.0 * residual[np.isfinite(residual)]
    lines = [f"Frames: {len(made.motion)} at {made.motion.fps:g}/s", f"Joints: {len(made.motion.skeleton)}"]
    lines.append(f"Markers: {len(made.model.markers)}")
    if len(away):
        lines += [f"Mean residual: {away.mean():.1f} mm", f"95 % below: {np.percentile(away, 95.0):.1f} mm"]
    spent = sum(value for name, value in made.seconds.items() if name != "total")
    lines.append(f"Time: {spent:.1f} s")
    return lines


def add(order: Order, made: "Reconstruction") -> list[str]:
    """Write the clip and its labels to the library, if requested; return messages."""
    if order.add is None:
        return []
    from ...beyond_mocap.library.keep_words import add_clip

    throw = made.release is not None and any(word.startswith("throw") for word in order.words)
    key = made.release.time if throw else None
    return add_clip(order.add.parent, order.add.stem, made.on_floor(), order.words, key)


def keep_model(cloud: bpy.types.Object, model: "MarkerModel") -> None:
    """Store a model with a cloud; a text that other clouds use stays unchanged."""
    from ...beyond_mocap.markers.files.model_json import model_text

    kept = cloud.beyond_mocap_cloud
    if kept.model is None or kept.model.users > 1 or kept.model.library is not None:
        kept.model = bpy.data.texts.new(f"{cloud.name} model")
        kept.model.use_fake_user = False
    kept.model.clear()
    kept.model.write(model_text(model))


def model_of(cloud: bpy.types.Object) -> "MarkerModel":
    """Read the model of a cloud; raise InputError where there is none, or it cannot be read."""
    from ...beyond_mocap.markers.files.model_json import parse_model

    text = cloud.beyond_mocap_cloud.model
    if text is None:
        raise InputError(cloud.name, "no model", "a model", "press Reconstruct without Use Model, or load a model")
    return parse_model(text.as_string(), text.name)


def release_order(
    scene: bpy.types.Scene, cloud: bpy.types.Object
) -> tuple[str, "MarkerTrial", "Motion", "ReleaseSettings"]:
    """Build the request of a release: the cloud's name, its markers on the motion's floor, the motion, the settings.

    Raises:
        InputError: if the body was not reconstructed in this session.
    """
    from ...beyond_mocap.markers.release.release import ReleaseSettings

    channels.check_local(cloud, cloud.data)
    clouds.played_rate(cloud, scene)
    kept, chosen = cloud.beyond_mocap_cloud, scene.beyond_mocap_markers
    made = reconstruction_of(kept.made)
    if made is None:
        raise InputError(cloud.name, "not reconstructed in this session", "a body", "press Reconstruct first")
    marked = [row.name for row in kept.labels if row.role == "BALL" and row.name in made.raw.labels]
    hand = None if chosen.hand == "AUTO" else chosen.hand
    asked = ReleaseSettings(marked[0] if marked else None, chosen.radius or None, hand, chosen.thrown)
    trial = made.raw.with_positions(made.raw.positions - [0.0, 0.0, made.lowered])
    return cloud.name, trial, made.motion, asked


def show_release(context: bpy.types.Context, cloud: bpy.types.Object, found: "Release") -> bpy.types.Object:
    """Show the ball on its trajectory, the release on the timeline, and figures in the panel; return the ball."""
    scene, kept, thing = context.scene, cloud.beyond_mocap_cloud, cloud.beyond_mocap_cloud.ball
    lost = thing is None or thing.library is not None or thing.name not in scene.objects
    if lost or not is_alone(cloud, scene, "ball"):
        room = cloud.users_collection[0] if cloud.users_collection else context.collection
        thing = kept.ball = balls.create(context, f"{cloud.name} ball", room, found.radius)
        thing[THROWN] = found.radius
    elif thing.get(THROWN):
        thing.scale = (found.radius / thing[THROWN],) * 3
    channels.discard(thing, THROWN)
    slowed = clouds.played_rate(cloud, scene) / kept.fps
    world = kept.body.matrix_world if kept.body is not None else cloud.matrix_world
    matrix, units = np.array(world), units_per_metre(scene)
    places = found.path.positions @ matrix[:3, :3].T + matrix[:3, 3] / units
    turned = quaternion.from_rotation_vector(np.maximum(found.path.times - found.time, 0.0)[:, None] * found.spin)
    path = replace(found.path, times=found.path.times / slowed, positions=places, rotations=turned)
    balls.write(thing, path, scene, clouds.start_frame(cloud))[THROWN] = True
    name, frame = f"{cloud.name} release", clouds.start_frame(cloud) + found.time / slowed * frames_per_second(scene)
    for older in [marker for marker in scene.timeline_markers if marker.name == name]:
        scene.timeline_markers.remove(older)
    scene.timeline_markers.new(name, frame=round(frame))
    kept.release = "\n".join(release_lines(found))
    return thing


def release_lines(found: "Release") -> list[str]:
    """List lines "name: value" for the panel."""
    told = [f"Speed: {found.speed:.1f} ± {found.speed_sigma:.1f} m/s", f"In km/h: {3.6 * found.speed:.0f} km/h",
            f"Release: {found.time:.3f} s ± {1000.0 * found.time_sigma:.0f} ms", f"Hand: {found.side}",
            f"Estimated from: {found.how}"]
    if found.radar is not None:
        told.append(f"Radar: {found.radar:.1f} m/s, {100.0 * (found.speed / found.radar - 1.0):+.1f} %")
    return [*told, *found.notes]


def keep_reconstruction(made: "Reconstruction") -> str:
    """Store a reconstruction; return its name."""
    name = f"markers-{_session}-{next(_numbers)}"
    _made[name] = made
    while len(_made) > MOST_KEPT:
        _made.pop(next(iter(_made)))
    return name


def reconstruction_of(name: str) -> "Reconstruction | None":
    """Return the reconstruction of that name; None if it is not of this session."""
    return _made.get(name)


def forget_reconstructions() -> None:
    """Clear all stored reconstructions."""
    _made.clear()
