"""Four cameras on all edited paths and their bodies: from above, from the side, from three quarters, and behind a body.

They are ordinary cameras in a collection of their own. Each stores how it was placed; only cameras that the user has
not moved, animated or changed are placed again. The fourth is a child of an empty that moves with the body, so it can
be moved to another place from which it follows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Euler, Matrix

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.base.time_series import gaussian_smooth
from ..core import channels
from ..core.measure import frames_per_second, units_per_metre
from ..path_editing import edited_bodies
from ..path_editing.settings import list_edited_bodies

KINDS = ("ABOVE", "SIDE", "QUARTER", "BEHIND")
NAMES = {"ABOVE": "Path Above", "SIDE": "Path Side", "QUARTER": "Path Quarter", "BEHIND": "Path Behind"}
COLLECTION, FOCUS = "Path Cameras", "Path Focus"
MARK, PLACED_STATE, PREVIOUS_CAMERA = "beyond_mocap_path_camera", "beyond_mocap_laid", "beyond_mocap_before"

LENSES = {"ABOVE": 50.0, "SIDE": 50.0, "QUARTER": 40.0, "BEHIND": 35.0}
TILTS = {"SIDE": 8.0, "QUARTER": 32.0, "BEHIND": 12.0}  # degrees that a camera looks down
QUARTER_ANGLE = 38.0  # degrees between the third and the second camera
BEHIND = (-4.2, 0.0, 1.75)  # metres from the focus, which looks along X
BODY_HEIGHT, BODY_HALF_WIDTH = 1.9, 0.6  # metres of height and half width that a body needs at every place
MARGIN = 1.08
MAX_SIDE_RATIO = 0.75  # ratio of width to length, from which on a path has no side
MAX_PLACES = 400  # places that are used
SMOOTHING_SECONDS = 0.45  # of the Gaussian that smooths the focus
RESTART_DISTANCE = 1.0  # metres between two frames, from which on the motion starts again


@dataclass(frozen=True, eq=False)
class CameraTargets:
    """What the cameras show, and the body that the last one follows.

    Attributes:
        places: (N, 3) metres on the ground, all paths and bodies.
        frames: (T,) scene frames of the followed body.
        origin: (T, 3) metres, its place on the ground.
        heading: (T,) radians.
    """

    places: np.ndarray
    frames: np.ndarray
    origin: np.ndarray
    heading: np.ndarray


def collect_targets(scene: bpy.types.Scene, first: bpy.types.Object | None = None) -> CameraTargets:
    """Collect what the cameras show in a scene.

    Args:
        scene: the scene.
        first: the body to follow, if its path is edited; else another one.
    Returns:
        The targets.
    Raises:
        InputError: if no path is edited.
    """
    edits = {body: edited_bodies.find_computed_edit(body) for body in list_edited_bodies(scene)}
    for body in [body for body, edit in edits.items() if edit is None]:
        edited_bodies.update_motion(scene, body)
        edits[body] = edited_bodies.find_computed_edit(body)
    if not edits:
        raise InputError("path cameras", "no edited path", "an armature with an edited path",
                         "select one and press Edit Path")
    places = np.concatenate([part for edit in edits.values() for part in (edit.line, edit.edited.origin)])
    edit = edits.get(first) or next(iter(edits.values()))
    frames = edit.first + np.arange(len(edit.edited.origin), dtype=float)
    return CameraTargets(places, frames, edit.edited.origin, edit.edited.heading)


def place_cameras(scene: bpy.types.Scene, targets: CameraTargets) -> list[str]:
    """Place all cameras that are missing or unchanged; return the names of those that the user has changed."""
    collection, changed = _get_collection(scene), []
    corners = _build_corners(targets.places)
    for kind in KINDS:
        camera = find_camera(scene, kind)
        if camera is not None and not is_unchanged(camera):
            changed.append(camera.name)
            continue
        camera = camera or _create_camera(collection, kind)
        if kind == "BEHIND":
            _attach_to_focus(scene, collection, camera)
        else:
            _frame_corners(scene, camera, kind, corners, _find_side_yaw(targets.places))
        camera.data.clip_end = max(camera.data.clip_end,
                                   4.0 * float(np.ptp(corners, axis=0).max()) * units_per_metre(scene))
        camera[PLACED_STATE] = _list_state(camera)
    animate_focus(scene, targets)
    return changed


def animate_focus(scene: bpy.types.Scene, targets: CameraTargets) -> None:
    """Animate the focus of the last camera along the body; nothing happens where it is missing or has other keys."""
    focus = _find_marked(scene, FOCUS)
    if focus is None:
        return
    action, _ = channels.find_playing_action(focus)
    if action is not None and not action.get(MARK):
        return
    place, rotation_z = smooth_focus(targets, frames_per_second(scene))
    rotation = np.column_stack([np.zeros((len(rotation_z), 2)), rotation_z])
    curves = {"location": ("Object Transforms", place * units_per_metre(scene)),
              "rotation_euler": ("Object Transforms", rotation)}
    channels.remove_marked_action(focus, MARK)
    channels.create_action(focus, FOCUS, targets.frames, curves)[MARK] = True


def smooth_focus(targets: CameraTargets, fps: float) -> tuple[np.ndarray, np.ndarray]:
    """Smooth place (T, 3) metres and rotation (T,) radians of the focus."""
    step = np.linalg.norm(np.diff(targets.origin, axis=0), axis=1)
    starts = np.flatnonzero(step > RESTART_DISTANCE) + 1
    pieces = [(gaussian_smooth(place, SMOOTHING_SECONDS * fps / 2.0), gaussian_smooth(turn, SMOOTHING_SECONDS * fps))
              for place, turn in zip(np.split(targets.origin, starts), np.split(np.unwrap(targets.heading)[:, None],
                                                                                starts))]
    return np.concatenate([place for place, _ in pieces]), np.concatenate([turn[:, 0] for _, turn in pieces])


def find_camera(scene: bpy.types.Scene, kind: str) -> bpy.types.Object | None:
    """Find the camera of a kind; None where there is none."""
    return _find_marked(scene, kind)


def has_cameras(scene: bpy.types.Scene) -> bool:
    """Return whether the scene has any of these cameras."""
    collection = _find_collection(scene)
    return collection is not None and any(thing.get(MARK) in KINDS for thing in collection.objects)


def activate_camera(scene: bpy.types.Scene, camera: bpy.types.Object) -> None:
    """Make one of these cameras the scene's camera, and store the one that it replaces."""
    collection, before = _find_collection(scene), scene.camera
    if before is not None and not before.get(MARK):
        collection[PREVIOUS_CAMERA] = before
    scene.camera = camera


def restore_camera(scene: bpy.types.Scene) -> None:
    """Restore the scene's camera from before `activate_camera`."""
    before = _find_collection(scene).pop(PREVIOUS_CAMERA, None)
    if before is not None and before.name in scene.objects:
        scene.camera = before


def is_unchanged(camera: bpy.types.Object) -> bool:
    """Return whether a camera is as it was placed: not moved, animated or changed."""
    stored, current = camera.get(PLACED_STATE), _list_state(camera)
    if stored is None or len(stored) != len(current) or camera.animation_data or camera.data.animation_data:
        return False
    has_own_parent = camera.parent.get(MARK) == FOCUS if camera.parent else camera.get(MARK) != "BEHIND"
    return has_own_parent and not len(camera.constraints) and bool(np.allclose(stored, current, rtol=1e-5, atol=1e-5))


def _list_state(camera: bpy.types.Object) -> list[float]:
    """List place, lens and type of a camera as numbers."""
    data = camera.data
    own = [number for row in camera.matrix_basis for number in row]
    return [*own, data.lens, data.ortho_scale, float(data.type == "ORTHO"), data.shift_x, data.shift_y]


def _find_marked(scene: bpy.types.Scene, mark: str) -> bpy.types.Object | None:
    collection = _find_collection(scene)
    return next((thing for thing in collection.objects if thing.get(MARK) == mark), None) if collection else None


def _find_collection(scene: bpy.types.Scene) -> bpy.types.Collection | None:
    return next((own for own in scene.collection.children_recursive if own.get(MARK)), None)


def _get_collection(scene: bpy.types.Scene) -> bpy.types.Collection:
    collection = _find_collection(scene)
    if collection is None:
        collection = bpy.data.collections.new(COLLECTION)
        collection[MARK] = True
        scene.collection.children.link(collection)
    return collection


def _create_camera(collection: bpy.types.Collection, kind: str) -> bpy.types.Object:
    data = bpy.data.cameras.new(NAMES[kind])
    camera = bpy.data.objects.new(NAMES[kind], data)
    camera[MARK] = kind
    data.lens = LENSES[kind]
    data.type = "ORTHO" if kind == "ABOVE" else "PERSP"
    collection.objects.link(camera)
    return camera


def _frame_corners(scene: bpy.types.Scene, camera: bpy.types.Object, kind: str, corners: np.ndarray,
                   side: float) -> None:
    """Place a camera so that all corners (N, 3) metres are in its frame; `side` is the yaw of the side view."""
    units = units_per_metre(scene)
    if kind == "ABOVE":
        turn = Euler((0.0, 0.0, 0.0))
        camera.data.ortho_scale = 1.0
        half = _measure_half_frame(scene, camera)
        low, high = corners.min(axis=0), corners.max(axis=0)
        camera.data.ortho_scale = float(np.max((high - low)[:2] / 2.0 / half)) * MARGIN * units
        place = np.array([*(low + high)[:2] / 2.0, high[2] + 10.0])
    else:
        yaw = side + math.radians(QUARTER_ANGLE if kind == "QUARTER" else 0.0)
        turn = Euler((math.pi / 2.0 - math.radians(TILTS[kind]), 0.0, yaw))
        place = fit_camera(corners, np.array(turn.to_matrix()), _measure_half_frame(scene, camera) / MARGIN)
    camera.matrix_basis = Matrix.LocRotScale(place * units, turn, None)


def fit_camera(corners: np.ndarray, axes: np.ndarray, half: np.ndarray) -> np.ndarray:
    """Fit the nearest place from which a camera sees all corners, the nearest ones at its frame's edge.

    With f the depth of a corner, it is inside where |x - X| <= (f - F) half: four half-spaces whose apexes are the
    solution.

    Args:
        corners: (N, 3) metres.
        axes: (3, 3) the camera's axes in columns: right, up, back.
        half: (2,) half its frame's width and height at 1 m.
    Returns:
        (3,) metres.
    """
    projected = corners @ axes * [1.0, 1.0, -1.0]
    right, left = (np.max(sign * projected[:, :2] - projected[:, 2:] * half, axis=0) for sign in (1.0, -1.0))
    depth = float(np.min(-(right + left) / (2.0 * half)))
    return axes @ np.array([*(right - left) / 2.0, -depth])


def _measure_half_frame(scene: bpy.types.Scene, camera: bpy.types.Object) -> np.ndarray:
    """Measure half the width and height of a camera's frame (2,): at 1 unit, or at a scale of 1 if orthographic."""
    frame = np.array(camera.data.view_frame(scene=scene))
    size = np.abs(frame[:, :2]).max(axis=0)
    return size if camera.data.type == "ORTHO" else size / np.abs(frame[0, 2])


def _find_side_yaw(places: np.ndarray) -> float:
    """Find the yaw in which the path's length lies across the picture; 0 where it is round.

    It runs from left to right where it runs along X.
    """
    level = places[:, :2] - places[:, :2].mean(axis=0)
    spread, axes = np.linalg.eigh(level.T @ level)
    if spread[1] <= 0.0 or math.sqrt(max(spread[0], 0.0) / spread[1]) > MAX_SIDE_RATIO:
        return 0.0
    x, y = axes[:, 1] * (1.0 if axes[0, 1] >= 0.0 else -1.0)
    return math.atan2(y, x)


def _build_corners(places: np.ndarray) -> np.ndarray:
    """Return the corners of the boxes that a body needs at the places."""
    some = places[np.linspace(0, len(places) - 1, min(len(places), MAX_PLACES)).astype(int)]
    box = np.array([(x, y, z) for x in (-BODY_HALF_WIDTH, BODY_HALF_WIDTH) for y in (-BODY_HALF_WIDTH, BODY_HALF_WIDTH)
                    for z in (0.0, BODY_HEIGHT)])
    return (some[:, None] + box).reshape(-1, 3)


def _attach_to_focus(scene: bpy.types.Scene, collection: bpy.types.Collection, camera: bpy.types.Object) -> None:
    """Make the camera a child of its focus, which is created where it is missing."""
    units = units_per_metre(scene)
    focus = _find_marked(scene, FOCUS)
    if focus is None:
        focus = bpy.data.objects.new(FOCUS, None)
        focus[MARK] = FOCUS
        focus.empty_display_size, focus.empty_display_type = 0.3 * units, "ARROWS"
        collection.objects.link(focus)
    camera.parent = focus
    camera.matrix_parent_inverse.identity()
    turn = Euler((math.pi / 2.0 - math.radians(TILTS["BEHIND"]), 0.0, -math.pi / 2.0))
    camera.matrix_basis = Matrix.LocRotScale([units * part for part in BEHIND], turn, None)
