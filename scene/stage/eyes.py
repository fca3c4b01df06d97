"""The camera in a player's head: it looks where they look, in the direction of the face, and from there towards the
ball within the range of the eyes.
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
from ..core.measure import units_per_metre
from .meshes import create_object
from .stage_collection import STAGE_MARK, find_stage, get_stage, list_own_objects

VIEW_MARK, EYES, NAME = "beyond_mocap_view", "EYES", "Player's Eye"
OWNER = "beyond_mocap_eyes_of"
SENSOR = 36.0  # mm
EYE_OFFSET = (0.115, 0.04)  # m from the head joint to the middle of the eyes, ahead and up, for 1.80 m
CLIP_START = 0.1  # m from the eyes that are clipped: brows and nose
EYES_LENS = 18.0  # mm, the player's lens: 90 degrees
MAX_EYE_ANGLE = np.radians(35.0)  # rad, how far eyes rotate in the head
GAZE_SMOOTHING = 0.12  # s, Gaussian smoothing of the gaze
MAX_GAZE_SLOPE = np.tan(
    np.radians(18.0))  # steepest rise of a gaze: higher objects are in the upper half of the picture
REST_ANGLE = np.radians(12.0)  # rad, how far a gaze without a ball points below the face's axis


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
        raise InputError(body.name, "it plays no action", "a body with a motion", "synthesize it first")
    motion = action.read_motion(body, scene)
    frames = first + np.arange(len(motion))
    target = _sample_ball_keys(scene, ball, frames)
    place, turn = compute_eye_view(motion, target)
    units, camera = units_per_metre(scene), _get_eyes_camera(scene)
    channels.remove_marked_action(camera, STAGE_MARK)
    group = "Object Transforms"
    curves = {"location": (group, place * units), "rotation_quaternion": (group, turn)}
    channels.create_action(camera, f"{NAME} of {body.name}", frames, curves)[STAGE_MARK] = True
    camera[OWNER] = body
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


def _get_eyes_camera(scene: bpy.types.Scene) -> bpy.types.Object:
    """Find the camera in a player's head, or create it."""
    camera = find_eyes_camera(scene)
    if camera is None:
        camera = create_object(get_stage(scene), NAME, bpy.data.cameras.new(NAME))
        camera[VIEW_MARK], camera[STAGE_MARK] = EYES, True
        camera.rotation_mode = "QUATERNION"
        units = units_per_metre(scene)
        camera.data.lens, camera.data.sensor_width = EYES_LENS, SENSOR
        camera.data.clip_start, camera.data.clip_end = CLIP_START * units, 400.0 * units
    return camera


def find_eyes_camera(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Find the camera in a player's head; None if there is none."""
    stage = find_stage(scene)
    own = list_own_objects(stage) if stage is not None else []
    return next((thing for thing in own if thing.get(VIEW_MARK) == EYES), None)
