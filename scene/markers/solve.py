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
from ...beyond_mocap.base.fixes import Fix
from ...beyond_mocap.motion import quaternion
from ..core import action, channels, frame_range, sample
from ..core.measure import frames_per_second, units_per_metre
from ..core.properties import read_property_values
from ..core.settings import require_library_folder
from ..rigs import armature
from ..stage import ball as balls
from ..stage import body
from . import cloud as clouds
from . import sets
from .settings import has_own_object, is_cloud

if TYPE_CHECKING:
    from ...beyond_mocap.markers.model.model import MarkerModel
    from ...beyond_mocap.markers.reconstruct import Reconstruction, ReconstructSettings
    from ...beyond_mocap.markers.release.release import Release, ReleaseSettings
    from ...beyond_mocap.markers.trial import MarkerTrial
    from ...beyond_mocap.motion.motion import Motion

RECONSTRUCTED = "beyond_mocap_reconstructed"  # custom property of actions created here; no property group has this name
THROWN_BALL = "beyond_mocap_thrown"  # custom property of balls (their mesh's radius) and actions created here
SKIN = (0.55, 0.55, 0.60)
MAX_RECONSTRUCTIONS = 30  # reconstructions in memory
_numbers = itertools.count(1)
# Part of every name, so that names of another session are not confused with those of this one.
_session = uuid.uuid4().hex[:8]
_reconstructions: dict[str, "Reconstruction"] = {}


@dataclass(frozen=True)
class ReconstructionRequest:
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


def build_request(scene: bpy.types.Scene, cloud: bpy.types.Object) -> ReconstructionRequest:
    """Build the request of a cloud from its own settings and the scene's; raise InputError where something is
    missing.
    """
    channels.check_local(cloud, cloud.data)
    properties, scene_settings = cloud.beyond_mocap_cloud, scene.beyond_mocap_markers
    trial = clouds.read_trial(cloud, scene)
    clouds.compute_playback_rate(cloud, scene)
    static = _find_static(cloud, scene)
    words = tuple(scene_settings.words.split()) if scene_settings.add else ()
    return ReconstructionRequest(cloud.name, trial, static and clouds.read_trial(static, scene), model=read_model(cloud)
                                 if properties.use_model else None, settings=build_settings(cloud, scene_settings,
            words), add=find_clip_path(scene, cloud.name) if scene_settings.add else None, words=words)


def _find_static(cloud: bpy.types.Object, scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Find the static trial of a cloud; raise InputError where it was deleted, since the pointer keeps deleted
    objects.
    """
    properties = cloud.beyond_mocap_cloud
    if properties.use_model or not is_cloud(properties.static) or properties.static == cloud:
        return None
    if scene.objects.get(properties.static.name) != properties.static:
        raise InputError(cloud.name, f"its static trial {properties.static.name} is not in the scene",
                         "a cloud of this scene", "choose another, or clear the field")
    return properties.static


def build_settings(cloud: bpy.types.Object, scene_settings, words: tuple[str, ...] = ()) -> "ReconstructSettings":
    """Build the options of a reconstruction; the marker set is the cloud's own where its markers have segments."""
    from ...beyond_mocap.markers.reconstruct import ReconstructSettings

    assigned = any(row.segment for row in cloud.beyond_mocap_cloud.labels)
    throw = any(word.startswith("throw") for word in words)
    return ReconstructSettings(marker_set=sets.build_marker_set(cloud) if assigned else None,
                               release="yes" if throw else "auto",
                               **read_property_values(ReconstructSettings, scene_settings, "markers"))


def find_clip_path(scene: bpy.types.Scene, name: str) -> Path:
    """Find a free path for the clip in the library folder; raise InputError without a folder, or where the name is
    taken.
    """
    from ...beyond_mocap.library.folder.label_files import find_free_file

    folder = require_library_folder(scene.beyond_mocap)
    sample.check_not_sample(folder)
    return find_free_file(Path(folder), bpy.path.clean_name(name))


def show_reconstruction(context: bpy.types.Context, cloud: bpy.types.Object,
                        reconstruction: "Reconstruction") -> bpy.types.Object:
    """Show the result beside the cloud: an armature that moves with it, and messages in the panel; return the
    armature.
    """
    scene, properties = context.scene, cloud.beyond_mocap_cloud
    thing = properties.body
    if thing is None or not has_own_object(cloud, scene, "body") or not can_reuse_body(thing, reconstruction, scene):
        collection = cloud.users_collection[0] if cloud.users_collection else context.collection
        thing = properties.body = armature.create_armature(context, reconstruction.motion.skeleton,
                                                           f"{cloud.name} body", collection)
    if scene.beyond_mocap_markers.dressed and not any(child.type == "MESH" for child in thing.children):
        body.create_character(thing, thing.name, SKIN, collection=thing.users_collection[0], scene=scene,
                              example=reconstruction.motion)
    thing.matrix_world = Matrix()
    context.view_layer.update()
    speed = clouds.compute_playback_rate(cloud, scene) / properties.fps
    played = replace(reconstruction.motion, fps=reconstruction.motion.fps * speed)
    channels.remove_marked_action(thing, RECONSTRUCTED)
    action.write_motion(thing, played, scene, clouds.find_start_frame(cloud), cloud.name,
                        generated=True)[RECONSTRUCTED] = True
    thing.matrix_world = cloud.matrix_world
    frame_range.extend_range(scene, clouds.find_start_frame(cloud) + played.duration * frames_per_second(scene))
    properties.made, properties.figures, properties.messages = store_reconstruction(reconstruction), "\n".join(
        list_figures(reconstruction)), "\n".join(reconstruction.warnings)
    store_model(cloud, reconstruction.model)
    properties.release = ""
    if reconstruction.release is not None:
        show_release(context, cloud, reconstruction.release)
    return thing


def can_reuse_body(thing: bpy.types.Object, reconstruction: "Reconstruction", scene: bpy.types.Scene) -> bool:
    """Return whether an earlier body has the same bones and may be overwritten."""
    if thing.type != "ARMATURE" or thing.library is not None or thing.name not in scene.objects:
        return False
    return armature.build_skeleton(thing, scene).has_same_bones(reconstruction.motion.skeleton, 1e-4)


def list_figures(reconstruction: "Reconstruction") -> list[str]:
    """List lines "name: value" for the panel."""
    residual = reconstruction.solved.residual
    away = 1000.0 * residual[np.isfinite(residual)]
    lines = [f"Frames: {len(reconstruction.motion)} at {reconstruction.motion.fps:g}/s",
             f"Joints: {len(reconstruction.motion.skeleton)}"]
    lines.append(f"Markers: {len(reconstruction.model.markers)}")
    if len(away):
        lines += [f"Mean residual: {away.mean():.1f} mm", f"95 % below: {np.percentile(away, 95.0):.1f} mm"]
    duration = sum(value for name, value in reconstruction.seconds.items() if name != "total")
    lines.append(f"Time: {duration:.1f} s")
    return lines


def add_to_library(request: ReconstructionRequest, reconstruction: "Reconstruction") -> list[str]:
    """Write the clip and its labels to the library, if requested; return messages."""
    if request.add is None:
        return []
    from ...beyond_mocap.library.folder.label_files import add_clip
    from ...beyond_mocap.markers.recorded_ball import trace_recorded_ball

    throw = reconstruction.release is not None and any(word.startswith("throw") for word in request.words)
    key = reconstruction.release.time if throw else None
    ball, notes = trace_recorded_ball(reconstruction, on_floor=True)
    lines = add_clip(request.add.parent, request.add.stem, reconstruction.place_on_floor(), request.words, key,
                     ball=ball)
    return [*lines, *notes]


def store_model(cloud: bpy.types.Object, model: "MarkerModel") -> None:
    """Store a model with a cloud; a text that other clouds use stays unchanged."""
    from ...beyond_mocap.markers.files.model_json import format_model

    properties = cloud.beyond_mocap_cloud
    if properties.model is None or properties.model.users > 1 or properties.model.library is not None:
        properties.model = bpy.data.texts.new(f"{cloud.name} model")
        properties.model.use_fake_user = False
    properties.model.clear()
    properties.model.write(format_model(model))


def read_model(cloud: bpy.types.Object) -> "MarkerModel":
    """Read the model of a cloud; raise InputError where there is none, or it cannot be read."""
    from ...beyond_mocap.markers.files.model_json import parse_model

    text = cloud.beyond_mocap_cloud.model
    if text is None:
        raise InputError(cloud.name, "no model", "a model", "press Reconstruct without Use Model, or load a model")
    return parse_model(text.as_string(), text.name)


def build_release_request(
    scene: bpy.types.Scene, cloud: bpy.types.Object
) -> tuple[str, "MarkerTrial", "Motion", "ReleaseSettings"]:
    """Build the request of a release: the cloud's name, its markers on the motion's floor, the motion, the settings.

    Raises:
        InputError: if the body was not reconstructed in this session.
    """
    from ...beyond_mocap.markers.release.release import ReleaseSettings

    channels.check_local(cloud, cloud.data)
    clouds.compute_playback_rate(cloud, scene)
    properties, scene_settings = cloud.beyond_mocap_cloud, scene.beyond_mocap_markers
    reconstruction = find_reconstruction(properties.made)
    if reconstruction is None:
        raise InputError(cloud.name, "not reconstructed in this session", "a body", "press Reconstruct first",
                         fixes=(Fix("press", "beyond_mocap.reconstruct_markers"),))
    ball_labels = [row.name for row in properties.labels if row.role == "BALL"
                   and row.name in reconstruction.raw.labels]
    hand = None if scene_settings.hand == "AUTO" else scene_settings.hand
    release_settings = ReleaseSettings(ball_labels[0] if ball_labels else None, scene_settings.radius or None, hand,
                                       scene_settings.thrown)
    trial = reconstruction.raw.with_positions(reconstruction.raw.positions - [0.0, 0.0, reconstruction.lowered_by])
    return cloud.name, trial, reconstruction.motion, release_settings


def show_release(context: bpy.types.Context, cloud: bpy.types.Object, release: "Release") -> bpy.types.Object:
    """Show the ball on its trajectory, the release on the timeline, and figures in the panel; return the ball."""
    scene, properties, thing = context.scene, cloud.beyond_mocap_cloud, cloud.beyond_mocap_cloud.ball
    is_missing = thing is None or thing.library is not None or thing.name not in scene.objects
    if is_missing or not has_own_object(cloud, scene, "ball"):
        collection = cloud.users_collection[0] if cloud.users_collection else context.collection
        thing = properties.ball = balls.create_ball(context, f"{cloud.name} ball", collection, release.radius)
        thing[THROWN_BALL] = release.radius
    elif thing.get(THROWN_BALL):
        thing.scale = (release.radius / thing[THROWN_BALL],) * 3
    channels.remove_marked_action(thing, THROWN_BALL)
    speed = clouds.compute_playback_rate(cloud, scene) / properties.fps
    world = properties.body.matrix_world if properties.body is not None else cloud.matrix_world
    matrix, units = np.array(world), units_per_metre(scene)
    places = release.path.positions @ matrix[:3, :3].T + matrix[:3, 3] / units
    rotations = quaternion.from_rotation_vector(np.maximum(release.path.times - release.time, 0.0)[:, None]
                                                * release.spin)
    path = replace(release.path, times=release.path.times / speed, positions=places, rotations=rotations)
    balls.write_trajectory(thing, path, scene, clouds.find_start_frame(cloud))[THROWN_BALL] = True
    name, frame = f"{cloud.name} release", clouds.find_start_frame(cloud) + release.time / speed * frames_per_second(
        scene)
    for old_marker in [marker for marker in scene.timeline_markers if marker.name == name]:
        scene.timeline_markers.remove(old_marker)
    scene.timeline_markers.new(name, frame=round(frame))
    properties.release = "\n".join(list_release_figures(release))
    return thing


def list_release_figures(release: "Release") -> list[str]:
    """List lines "name: value" for the panel."""
    lines = [f"Speed: {release.speed:.1f} ± {release.speed_margin:.1f} m/s", f"In km/h: {3.6 * release.speed:.0f} km/h",
             f"Direction: ± {np.degrees(release.direction_margin):.0f}°",
             f"Release: {release.time:.3f} s ± {1000.0 * release.time_margin:.0f} ms", f"Hand: {release.side}",
             f"Estimated from: {release.method}"]
    if release.radar is not None:
        lines.append(f"Radar: {release.radar:.1f} m/s, {100.0 * (release.speed / release.radar - 1.0):+.1f} %")
    return [*lines, *release.notes]


def store_reconstruction(reconstruction: "Reconstruction") -> str:
    """Store a reconstruction; return its name."""
    name = f"markers-{_session}-{next(_numbers)}"
    _reconstructions[name] = reconstruction
    while len(_reconstructions) > MAX_RECONSTRUCTIONS:
        _reconstructions.pop(next(iter(_reconstructions)))
    return name


def find_reconstruction(name: str) -> "Reconstruction | None":
    """Return the reconstruction of that name; None if it is not of this session."""
    return _reconstructions.get(name)


def clear_reconstructions() -> None:
    """Clear all stored reconstructions."""
    _reconstructions.clear()
