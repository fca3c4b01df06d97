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
from ...beyond_mocap.motion.humanoid import identify
from ...beyond_mocap.motion.motion import Motion, forward_kinematics
from ..core import action, channels
from ..core.measure import frames_per_second, units_per_metre
from . import ours

STAND, EYES = "Match Broadcast", "Match Eyes"
FROM = (0.0, 26.0, 17.0)  # m: along the pitch, behind the touch line, above the ground
SEEN, NEAREST = 33.0, 55.0  # m: width shown by the stand's camera; least distance to the ball used for zoom
GLIDE = 0.9  # s, Gaussian smoothing of its target
SENSOR = 36.0  # mm
EYE = (0.115, 0.04)  # m from the head joint to the middle of the eyes, ahead and up, for 1.80 m
NEAR = 0.1  # m from the eyes that are clipped: brows and nose
WIDE = 18.0  # mm, the player's lens: 90 degrees
EYES_TURN = np.radians(35.0)  # rad, how far eyes rotate in the head
STEADY = 0.12  # s, Gaussian smoothing of the gaze
UP = np.tan(np.radians(18.0))  # steepest rise of a gaze: higher objects are in the upper half of the picture
RESTS = np.radians(12.0)  # rad, how far a gaze without a ball points below the face's axis


def broadcast(scene: bpy.types.Scene, size: tuple[float, float], frames: np.ndarray, seen: np.ndarray):
    """Create the camera in the stand.

    Args:
        scene: the scene.
        size: length and width of the pitch, m.
        frames: (F,) scene frames.
        targets: (F, 2) m, what it follows.
    Returns:
        The camera.
    """
    units, home = units_per_metre(scene), ours.part(scene, "cameras")
    aim = ours.mark(bpy.data.objects.new("Match Broadcast aim", None))
    aim.empty_display_size = 0.5 * units
    home.objects.link(aim)
    camera = bpy.data.objects.new(STAND, bpy.data.cameras.new(STAND))
    camera[ours.MARK] = STAND
    home.objects.link(camera)
    stand = np.array([FROM[0], -size[1] / 2.0 - FROM[1], FROM[2]])
    camera.location = stand * units
    camera.data.clip_start, camera.data.clip_end, camera.data.sensor_width = units, 400.0 * units, SENSOR
    look = camera.constraints.new("TRACK_TO")
    look.target, look.track_axis, look.up_axis = aim, "TRACK_NEGATIVE_Z", "UP_Y"
    middle = gaussian_smooth(seen, GLIDE * frames_per_second(scene))
    middle = np.clip(middle, *(np.outer([-1.0, 1.0], np.array(size) / 2.0 - [14.0, 14.0])))
    places = np.column_stack([middle, np.full(len(middle), 0.6)])
    away = np.linalg.norm(places - stand, axis=1)
    lens = (SENSOR * np.maximum(away, NEAREST) / SEEN)[:, None]
    group = "Object Transforms"
    ours.mark(channels.animate(aim, aim.name, frames, {"location": (group, places * units)}))
    ours.mark(channels.animate(camera.data, f"{STAND} lens", frames, {"lens": ("Lens", lens)}))
    return camera


def stand_of(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Find the camera in the stand; None if there is none."""
    return next((thing for thing in ours.things(scene, "cameras") if thing.get(ours.MARK) == STAND), None)


def eyes(scene: bpy.types.Scene, who: bpy.types.Object, ball: bpy.types.Object | None) -> bpy.types.Object:
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
    first = action.first_frame(who)
    if first is None:
        raise InputError(who.name, "it plays no action", "a player of a shown match", "press Show Match")
    motion = action.read(who, scene)
    frames = first + np.arange(len(motion))
    target = _ball_places(scene, ball, frames)
    place, turn = view_of(motion, target)
    units, camera = units_per_metre(scene), _eyes_camera(scene)
    channels.discard(camera, ours.MARK)
    group = "Object Transforms"
    curves = {"location": (group, place * units), "rotation_quaternion": (group, turn)}
    ours.mark(channels.animate(camera, f"{EYES} of {who.name}", frames, curves))
    camera["beyond_mocap_eyes_of"] = who
    return camera


def view_of(motion: Motion, target: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Compute a camera at a body's eyes.

    Args:
        motion: T frames.
        target: (T, 3) m of what the player looks at, NaN where there is nothing; None: nothing.
    Returns:
        Positions (T, 3) m and rotations (T, 4).
    """
    from ...beyond_mocap.motion.retargeting.neutral import neutral_stance  # imports scipy, which is slow

    skeleton = motion.skeleton
    head, neutral = identify(skeleton).head_or_neck, neutral_stance(skeleton, motion)
    places, world = forward_kinematics(motion)
    face = quaternion.multiply(world[:, head], quaternion.inverse(neutral.rotations[head]))
    scale = neutral.leg / 0.88  # m, the leg of a body of 1.80 m
    eye = places[:, head] + quaternion.rotate(face, np.array([EYE[0], 0.0, EYE[1]]) * scale)
    ahead = unit_vectors(quaternion.rotate(face, np.array([1.0, 0.0, 0.0])))
    gaze = gaussian_smooth(_towards(ahead, eye, target), STEADY * motion.fps)
    gaze[:, 2] = np.minimum(gaze[:, 2], UP * np.linalg.norm(gaze[:, :2], axis=1))
    return eye, _looking(unit_vectors(gaze))


def _towards(ahead: np.ndarray, eye: np.ndarray, target: np.ndarray | None) -> np.ndarray:
    """Compute gaze directions (T, 3): `ahead`, rotated towards the target within the range of the eyes; slightly
    down without a target.
    """
    down = unit_vectors(ahead - [0.0, 0.0, np.tan(RESTS)])
    if target is None:
        return down
    known = np.isfinite(target).all(axis=1)
    wanted = np.where(known[:, None], unit_vectors(np.where(known[:, None], target, eye + ahead) - eye), down)
    cosine = np.clip(np.sum(ahead * wanted, axis=1), -1.0, 1.0)
    angle = np.arccos(cosine)
    share = np.minimum(1.0, EYES_TURN / np.maximum(angle, 1e-6))
    behind = gaussian_smooth(np.clip((np.radians(150.0) - angle) / np.radians(40.0), 0.0, 1.0)[:, None], 5.0)
    turned = _between(ahead, wanted, angle, share)
    return unit_vectors(behind * turned + (1.0 - behind) * down)


def _between(first: np.ndarray, second: np.ndarray, angle: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Interpolate unit vectors along the arc between two rows of unit vectors (T, 3) that are `angle` apart."""
    sine = np.maximum(np.sin(angle), 1e-6)
    a, b = np.sin((1.0 - share) * angle) / sine, np.sin(share * angle) / sine
    near = angle < 1e-4
    return np.where(near[:, None], second, a[:, None] * first + b[:, None] * second)


def _looking(gaze: np.ndarray) -> np.ndarray:
    """Build rotations (T, 4) of upright cameras that look along `gaze` (T, 3)."""
    right = unit_vectors(np.cross(gaze, [0.0, 0.0, 1.0]))
    up = np.cross(right, gaze)
    return quaternion.continuous(quaternion.from_matrix(np.stack([right, up, -gaze], axis=-1)))


def _ball_places(scene: bpy.types.Scene, ball: bpy.types.Object | None, frames: np.ndarray) -> np.ndarray | None:
    """Sample the ball's keys, (F, 3) m; None if there is no ball with keys."""
    found = channels.curves(*channels.playing(ball)) if ball is not None and channels.playing(ball)[0] else {}
    if not all(("location", axis) in found for axis in range(3)):
        return None
    places = [channels.sample(found["location", axis], frames) for axis in range(3)]
    return np.stack(places, axis=1) / units_per_metre(scene)


def _eyes_camera(scene: bpy.types.Scene) -> bpy.types.Object:
    """Find the camera in the player's head, or create it."""
    home = ours.part(scene, "cameras")
    found = next((thing for thing in ours.things(scene, "cameras") if thing.get(ours.MARK) == EYES), None)
    if found is None:
        found = bpy.data.objects.new(EYES, bpy.data.cameras.new(EYES))
        found[ours.MARK] = EYES
        found.rotation_mode = "QUATERNION"
        home.objects.link(found)
        units = units_per_metre(scene)
        found.data.lens, found.data.sensor_width = WIDE, SENSOR
        found.data.clip_start, found.data.clip_end = NEAR * units, 400.0 * units
    return found
