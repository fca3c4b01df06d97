"""Cameras of a match: one in the stand that follows the ball, and one in the head of any player.

The stand's camera tracks a target that follows the ball smoothly, and zooms so that it always shows about the same
width of pitch. The player's camera is at their eyes and looks where they look: in the direction of the face, and from
there towards the ball within the range of the eyes.
"""

from __future__ import annotations

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.base.time_series import gaussian_smooth
from ...beyond_mocap.base.vectors import unit_vectors
from ...beyond_mocap.motion import quaternion
from ...beyond_mocap.motion.humanoid import identify_joints
from ...beyond_mocap.motion.motion import Motion, forward_kinematics
from ..core import action, channels
from ..core.measure import frames_per_second, units_per_metre
from . import match_objects as ours

STAND, EYES = "Match Broadcast", "Match Eyes"
STAND_POSITION = (0.0, 26.0, 17.0)  # m: along the pitch, behind the touch line, above the ground
VIEW_WIDTH, MIN_DISTANCE = 33.0, 55.0  # m: width shown by the stand's camera; least distance to the ball used for zoom
AIM_SMOOTHING = 0.9  # s, Gaussian smoothing of its target
SENSOR = 36.0  # mm
EYE_OFFSET = (0.115, 0.04)  # m from the head joint to the middle of the eyes, ahead and up, for 1.80 m
CLIP_START = 0.1  # m from the eyes that are clipped: brows and nose
EYES_LENS = 18.0  # mm, the player's lens: 90 degrees
MAX_EYE_ANGLE = np.radians(35.0)  # rad, how far eyes rotate in the head
GAZE_SMOOTHING = 0.12  # s, Gaussian smoothing of the gaze
MAX_GAZE_SLOPE = np.tan(
    np.radians(18.0))  # steepest rise of a gaze: higher objects are in the upper half of the picture
REST_ANGLE = np.radians(12.0)  # rad, how far a gaze without a ball points below the face's axis


def create_broadcast_camera(scene: bpy.types.Scene, size: tuple[float, float], frames: np.ndarray, targets: np.ndarray):
    """Create the camera in the stand.

    Args:
        scene: the scene.
        size: length and width of the pitch, m.
        frames: (F,) scene frames.
        targets: (F, 2) m, what it follows.
    Returns:
        The camera.
    """
    units, collection = units_per_metre(scene), ours.create_collection(scene, "cameras")
    aim = ours.mark_object(bpy.data.objects.new("Match Broadcast aim", None))
    aim.empty_display_size = 0.5 * units
    collection.objects.link(aim)
    camera = bpy.data.objects.new(STAND, bpy.data.cameras.new(STAND))
    camera[ours.MARK] = STAND
    collection.objects.link(camera)
    stand = np.array([STAND_POSITION[0], -size[1] / 2.0 - STAND_POSITION[1], STAND_POSITION[2]])
    camera.location = stand * units
    camera.data.clip_start, camera.data.clip_end, camera.data.sensor_width = units, 400.0 * units, SENSOR
    look = camera.constraints.new("TRACK_TO")
    look.target, look.track_axis, look.up_axis = aim, "TRACK_NEGATIVE_Z", "UP_Y"
    middle = gaussian_smooth(targets, AIM_SMOOTHING * frames_per_second(scene))
    middle = np.clip(middle, *(np.outer([-1.0, 1.0], np.array(size) / 2.0 - [14.0, 14.0])))
    places = np.column_stack([middle, np.full(len(middle), 0.6)])
    distance = np.linalg.norm(places - stand, axis=1)
    lens = (SENSOR * np.maximum(distance, MIN_DISTANCE) / VIEW_WIDTH)[:, None]
    group = "Object Transforms"
    ours.mark_object(channels.create_action(aim, aim.name, frames, {"location": (group, places * units)}))
    ours.mark_object(channels.create_action(camera.data, f"{STAND} lens", frames, {"lens": ("Lens", lens)}))
    return camera


def find_broadcast_camera(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Find the camera in the stand; None if there is none."""
    return next((thing for thing in ours.find_objects(scene, "cameras") if thing.get(ours.MARK) == STAND), None)


def create_eyes_camera(scene: bpy.types.Scene, body: bpy.types.Object, ball: bpy.types.Object
                       | None) -> bpy.types.Object:
    """Create the camera in a player's head, or move the existing one there.

    Args:
        scene: the scene.
        body: the player's armature.
        ball: the ball the player looks at, None: none.
    Returns:
        The camera.
    Raises:
        InputError: if the armature plays no action, or has no head.
    """
    first = action.find_first_frame(body)
    if first is None:
        raise InputError(body.name, "it plays no action", "a player of a shown match", "press Show Match")
    motion = action.read_motion(body, scene)
    frames = first + np.arange(len(motion))
    target = _sample_ball_keys(scene, ball, frames)
    place, turn = compute_eye_view(motion, target)
    units, camera = units_per_metre(scene), _find_eyes_camera(scene)
    channels.remove_marked_action(camera, ours.MARK)
    group = "Object Transforms"
    curves = {"location": (group, place * units), "rotation_quaternion": (group, turn)}
    ours.mark_object(channels.create_action(camera, f"{EYES} of {body.name}", frames, curves))
    camera["beyond_mocap_eyes_of"] = body
    return camera


def compute_eye_view(motion: Motion, target: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Compute a camera at a body's eyes.

    Args:
        motion: T frames.
        target: (T, 3) m of what the player looks at, NaN where there is nothing; None: nothing.
    Returns:
        Positions (T, 3) m and rotations (T, 4).
    """
    from ...beyond_mocap.motion.retargeting.neutral import build_neutral_stance  # imports scipy, which is slow

    skeleton = motion.skeleton
    head, neutral = identify_joints(skeleton).head_or_neck, build_neutral_stance(skeleton, motion)
    places, world = forward_kinematics(motion)
    face = quaternion.multiply(world[:, head], quaternion.inverse(neutral.rotations[head]))
    scale = neutral.leg / 0.88  # m, the leg of a body of 1.80 m
    eye = places[:, head] + quaternion.rotate(face, np.array([EYE_OFFSET[0], 0.0, EYE_OFFSET[1]]) * scale)
    ahead = unit_vectors(quaternion.rotate(face, np.array([1.0, 0.0, 0.0])))
    gaze = gaussian_smooth(_compute_gaze(ahead, eye, target), GAZE_SMOOTHING * motion.fps)
    gaze[:, 2] = np.minimum(gaze[:, 2], MAX_GAZE_SLOPE * np.linalg.norm(gaze[:, :2], axis=1))
    return eye, _build_rotations(unit_vectors(gaze))


def _compute_gaze(ahead: np.ndarray, eye: np.ndarray, target: np.ndarray | None) -> np.ndarray:
    """Compute gaze directions (T, 3): `ahead`, rotated towards the target within the range of the eyes; slightly
    down without a target.
    """
    down = unit_vectors(ahead - [0.0, 0.0, np.tan(REST_ANGLE)])
    if target is None:
        return down
    known = np.isfinite(target).all(axis=1)
    target_direction = np.where(known[:, None], unit_vectors(np.where(known[:, None], target, eye + ahead) - eye), down)
    cosine = np.clip(np.sum(ahead * target_direction, axis=1), -1.0, 1.0)
    angle = np.arccos(cosine)
    share = np.minimum(1.0, MAX_EYE_ANGLE / np.maximum(angle, 1e-6))
    visible_share = gaussian_smooth(np.clip((np.radians(150.0) - angle) / np.radians(40.0), 0.0, 1.0)[:, None], 5.0)
    rotated = _interpolate_directions(ahead, target_direction, angle, share)
    return unit_vectors(visible_share * rotated + (1.0 - visible_share) * down)


def _interpolate_directions(first: np.ndarray, second: np.ndarray, angle: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Interpolate unit vectors along the arc between two rows of unit vectors (T, 3) that are `angle` apart."""
    sine = np.maximum(np.sin(angle), 1e-6)
    a, b = np.sin((1.0 - share) * angle) / sine, np.sin(share * angle) / sine
    near = angle < 1e-4
    return np.where(near[:, None], second, a[:, None] * first + b[:, None] * second)


def _build_rotations(gaze: np.ndarray) -> np.ndarray:
    """Build rotations (T, 4) of upright cameras that look along `gaze` (T, 3)."""
    right = unit_vectors(np.cross(gaze, [0.0, 0.0, 1.0]))
    up = np.cross(right, gaze)
    return quaternion.unify_signs(quaternion.from_matrix(np.stack([right, up, -gaze], axis=-1)))


def _sample_ball_keys(scene: bpy.types.Scene, ball: bpy.types.Object | None, frames: np.ndarray) -> np.ndarray | None:
    """Sample the ball's keys, (F, 3) m; None if there is no ball with keys."""
    found = channels.collect_curves(
        *channels.find_playing_action(ball)) if ball is not None and channels.find_playing_action(ball)[0] else {}
    if not all(("location", axis) in found for axis in range(3)):
        return None
    places = [channels.sample_curve(found["location", axis], frames) for axis in range(3)]
    return np.stack(places, axis=1) / units_per_metre(scene)


def _find_eyes_camera(scene: bpy.types.Scene) -> bpy.types.Object:
    """Find the camera in the player's head, or create it."""
    home = ours.create_collection(scene, "cameras")
    found = next((thing for thing in ours.find_objects(scene, "cameras") if thing.get(ours.MARK) == EYES), None)
    if found is None:
        found = bpy.data.objects.new(EYES, bpy.data.cameras.new(EYES))
        found[ours.MARK] = EYES
        found.rotation_mode = "QUATERNION"
        home.objects.link(found)
        units = units_per_metre(scene)
        found.data.lens, found.data.sensor_width = EYES_LENS, SENSOR
        found.data.clip_start, found.data.clip_end = CLIP_START * units, 400.0 * units
    return found
