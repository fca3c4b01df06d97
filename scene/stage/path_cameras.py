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
from ..path_editing import riders as rides
from ..path_editing.settings import riders

KINDS = ("ABOVE", "SIDE", "QUARTER", "BEHIND")
NAMES = {"ABOVE": "Path Above", "SIDE": "Path Side", "QUARTER": "Path Quarter", "BEHIND": "Path Behind"}
COLLECTION, FOCUS = "Path Cameras", "Path Focus"
MARK, LAID, BEFORE = "beyond_mocap_path_camera", "beyond_mocap_laid", "beyond_mocap_before"

LENSES = {"ABOVE": 50.0, "SIDE": 50.0, "QUARTER": 40.0, "BEHIND": 35.0}
TILTS = {"SIDE": 8.0, "QUARTER": 32.0, "BEHIND": 12.0}  # degrees that a camera looks down
ASIDE = 38.0  # degrees between the third and the second camera
BEHIND = (-4.2, 0.0, 1.75)  # metres from the focus, which looks along X
TALL, WIDE = 1.9, 0.6  # metres of height and half width that a body needs at every place
MARGIN = 1.08
ROUND = 0.75  # ratio of width to length, from which on a path has no side
MOST = 400  # places that are used
SECONDS = 0.45  # of the Gaussian that smooths the focus
JUMP = 1.0  # metres between two frames, from which on the motion starts again


@dataclass(frozen=True, eq=False)
class Route:
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


def route(scene: bpy.types.Scene, first: bpy.types.Object | None = None) -> Route:
    """Collect what the cameras show in a scene.

    Args:
        scene: the scene.
        first: the body to follow, if its path is edited; else another one.
    Returns:
        The targets.
    Raises:
        InputError: if no path is edited.
    """
    known = {body: rides.shown(body) for body in riders(scene)}
    for body in [body for body, shown in known.items() if shown is None]:
        rides.renew(scene, body)
        known[body] = rides.shown(body)
    if not known:
        raise InputError("path cameras", "no edited path", "an armature with an edited path",
                         "select one and press Edit Path")
    places = np.concatenate([part for shown in known.values() for part in (shown.line, shown.ridden.origin)])
    shown = known.get(first) or next(iter(known.values()))
    frames = shown.first + np.arange(len(shown.ridden.origin), dtype=float)
    return Route(places, frames, shown.ridden.origin, shown.ridden.heading)


def set_up(scene: bpy.types.Scene, route: Route) -> list[str]:
    """Place all cameras that are missing or unchanged; return the names of those that the user has changed."""
    collection, kept = _collection(scene), []
    corners = _corners(route.places)
    for kind in KINDS:
        camera = found(scene, kind)
        if camera is not None and not untouched(camera):
            kept.append(camera.name)
            continue
        camera = camera or _made(collection, kind)
        if kind == "BEHIND":
            _hang(scene, collection, camera)
        else:
            _frame(scene, camera, kind, corners, _side(route.places))
        camera.data.clip_end = max(camera.data.clip_end,
                                   4.0 * float(np.ptp(corners, axis=0).max()) * units_per_metre(scene))
        camera[LAID] = _laid(camera)
    follow(scene, route)
    return kept


def follow(scene: bpy.types.Scene, route: Route) -> None:
    """Animate the focus of the last camera along the body; nothing happens where it is missing or has other keys."""
    focus = _marked(scene, FOCUS)
    if focus is None:
        return
    action, _ = channels.playing(focus)
    if action is not None and not action.get(MARK):
        return
    place, turn = followed(route, frames_per_second(scene))
    rotation = np.column_stack([np.zeros((len(turn), 2)), turn])
    curves = {"location": ("Object Transforms", place * units_per_metre(scene)),
              "rotation_euler": ("Object Transforms", rotation)}
    channels.discard(focus, MARK)
    channels.animate(focus, FOCUS, route.frames, curves)[MARK] = True


def followed(route: Route, fps: float) -> tuple[np.ndarray, np.ndarray]:
    """Smooth place (T, 3) metres and rotation (T,) radians of the focus."""
    step = np.linalg.norm(np.diff(route.origin, axis=0), axis=1)
    starts = np.flatnonzero(step > JUMP) + 1
    pieces = [(gaussian_smooth(place, SECONDS * fps / 2.0), gaussian_smooth(turn, SECONDS * fps)) for place,
              turn in zip(np.split(route.origin, starts), np.split(np.unwrap(route.heading)[:, None], starts))]
    return np.concatenate([place for place, _ in pieces]), np.concatenate([turn[:, 0] for _, turn in pieces])


def found(scene: bpy.types.Scene, kind: str) -> bpy.types.Object | None:
    """Find the camera of a kind; None where there is none."""
    return _marked(scene, kind)


def any_in(scene: bpy.types.Scene) -> bool:
    """Return whether the scene has any of these cameras."""
    collection = _kept(scene)
    return collection is not None and any(thing.get(MARK) in KINDS for thing in collection.objects)


def take(scene: bpy.types.Scene, camera: bpy.types.Object) -> None:
    """Make one of these cameras the scene's camera, and store the one that it replaces."""
    collection, before = _kept(scene), scene.camera
    if before is not None and not before.get(MARK):
        collection[BEFORE] = before
    scene.camera = camera


def give_back(scene: bpy.types.Scene) -> None:
    """Restore the scene's camera from before `activate_camera`."""
    before = _kept(scene).pop(BEFORE, None)
    if before is not None and before.name in scene.objects:
        scene.camera = before


def untouched(camera: bpy.types.Object) -> bool:
    """Return whether a camera is as it was placed: not moved, animated or changed."""
    laid, now = camera.get(LAID), _laid(camera)
    if laid is None or len(laid) != len(now) or camera.animation_data or camera.data.animation_data:
        return False
    hangs = camera.parent.get(MARK) == FOCUS if camera.parent else camera.get(MARK) != "BEHIND"
    return hangs and not len(camera.constraints) and bool(np.allclose(laid, now, rtol=1e-5, atol=1e-5))


def _laid(camera: bpy.types.Object) -> list[float]:
    """List place, lens and type of a camera as numbers."""
    data = camera.data
    own = [number for row in camera.matrix_basis for number in row]
    return [*own, data.lens, data.ortho_scale, float(data.type == "ORTHO"), data.shift_x, data.shift_y]


def _marked(scene: bpy.types.Scene, mark: str) -> bpy.types.Object | None:
    collection = _kept(scene)
    return next((thing for thing in collection.objects if thing.get(MARK) == mark), None) if collection else None


def _kept(scene: bpy.types.Scene) -> bpy.types.Collection | None:
    return next((own for own in scene.collection.children_recursive if own.get(MARK)), None)


def _collection(scene: bpy.types.Scene) -> bpy.types.Collection:
    collection = _kept(scene)
    if collection is None:
        collection = bpy.data.collections.new(COLLECTION)
        collection[MARK] = True
        scene.collection.children.link(collection)
    return collection


def _made(collection: bpy.types.Collection, kind: str) -> bpy.types.Object:
    data = bpy.data.cameras.new(NAMES[kind])
    camera = bpy.data.objects.new(NAMES[kind], data)
    camera[MARK] = kind
    data.lens = LENSES[kind]
    data.type = "ORTHO" if kind == "ABOVE" else "PERSP"
    collection.objects.link(camera)
    return camera


def _frame(scene: bpy.types.Scene, camera: bpy.types.Object, kind: str, corners: np.ndarray, side: float) -> None:
    """Place a camera so that all corners (N, 3) metres are in its frame; `side` is the yaw of the side view."""
    units = units_per_metre(scene)
    if kind == "ABOVE":
        turn = Euler((0.0, 0.0, 0.0))
        camera.data.ortho_scale = 1.0
        half = _half_frame(scene, camera)
        low, high = corners.min(axis=0), corners.max(axis=0)
        camera.data.ortho_scale = float(np.max((high - low)[:2] / 2.0 / half)) * MARGIN * units
        place = np.array([*(low + high)[:2] / 2.0, high[2] + 10.0])
    else:
        yaw = side + math.radians(ASIDE if kind == "QUARTER" else 0.0)
        turn = Euler((math.pi / 2.0 - math.radians(TILTS[kind]), 0.0, yaw))
        place = fitted(corners, np.array(turn.to_matrix()), _half_frame(scene, camera) / MARGIN)
    camera.matrix_basis = Matrix.LocRotScale(place * units, turn, None)


def fitted(corners: np.ndarray, axes: np.ndarray, half: np.ndarray) -> np.ndarray:
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
    seen = corners @ axes * [1.0, 1.0, -1.0]
    right, left = (np.max(sign * seen[:, :2] - seen[:, 2:] * half, axis=0) for sign in (1.0, -1.0))
    depth = float(np.min(-(right + left) / (2.0 * half)))
    return axes @ np.array([*(right - left) / 2.0, -depth])


def _half_frame(scene: bpy.types.Scene, camera: bpy.types.Object) -> np.ndarray:
    """Measure half the width and height of a camera's frame (2,): at 1 unit, or at a scale of 1 if orthographic."""
    frame = np.array(camera.data.view_frame(scene=scene))
    size = np.abs(frame[:, :2]).max(axis=0)
    return size if camera.data.type == "ORTHO" else size / np.abs(frame[0, 2])


def _side(places: np.ndarray) -> float:
    """Find the yaw in which the path's length lies across the picture; 0 where it is round.

    It runs from left to right where it runs along X.
    """
    level = places[:, :2] - places[:, :2].mean(axis=0)
    spread, axes = np.linalg.eigh(level.T @ level)
    if spread[1] <= 0.0 or math.sqrt(max(spread[0], 0.0) / spread[1]) > ROUND:
        return 0.0
    x, y = axes[:, 1] * (1.0 if axes[0, 1] >= 0.0 else -1.0)
    return math.atan2(y, x)


def _corners(places: np.ndarray) -> np.ndarray:
    """Return the corners of the boxes that a body needs at the places."""
    some = places[np.linspace(0, len(places) - 1, min(len(places), MOST)).astype(int)]
    room = np.array([(x, y, z) for x in (-WIDE, WIDE) for y in (-WIDE, WIDE) for z in (0.0, TALL)])
    return (some[:, None] + room).reshape(-1, 3)


def _hang(scene: bpy.types.Scene, collection: bpy.types.Collection, camera: bpy.types.Object) -> None:
    """Make the camera a child of its focus, which is created where it is missing."""
    units = units_per_metre(scene)
    focus = _marked(scene, FOCUS)
    if focus is None:
        focus = bpy.data.objects.new(FOCUS, None)
        focus[MARK] = FOCUS
        focus.empty_display_size, focus.empty_display_type = 0.3 * units, "ARROWS"
        collection.objects.link(focus)
    camera.parent = focus
    camera.matrix_parent_inverse.identity()
    turn = Euler((math.pi / 2.0 - math.radians(TILTS["BEHIND"]), 0.0, -math.pi / 2.0))
    camera.matrix_basis = Matrix.LocRotScale([units * part for part in BEHIND], turn, None)
