"""Four cameras on riders and their paths: from above, from the side, from three quarters, and following behind a body.

They are ordinary cameras in a collection of their own. Each remembers how it was laid; laid again are only those that
nobody has moved, animated or changed since. The fourth hangs on an empty that runs along with the body, so that it can
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
ASIDE = 38.0  # degrees that the third camera stands round from the second
BEHIND = (-4.2, 0.0, 1.75)  # metres from the focus, which looks along X
TALL, WIDE = 1.9, 0.6  # metres round every place that a body needs
MARGIN = 1.08
ROUND = 0.75  # a way as wide as this share of its length has no side
MOST = 400  # places that are looked at
SECONDS = 0.45  # of the bell by which the focus is smoothed
JUMP = 1.0  # metres from one frame to the next: no way, but a motion that starts again


@dataclass(frozen=True, eq=False)
class Route:
    """What is to be seen: places (N, 3) m on the ground, all paths and bodies. Whom the last camera follows: at scene
    frames (T,) he is at origin (T, 3) m on the ground with heading (T,) radians."""

    places: np.ndarray
    frames: np.ndarray
    origin: np.ndarray
    heading: np.ndarray


def route(scene: bpy.types.Scene, first: bpy.types.Object | None = None) -> Route:
    """Of all riders of a scene; `first` is followed, where he rides. InputError where nobody does."""
    known = {body: rides.shown(body) for body in riders(scene)}
    for body in [body for body, shown in known.items() if shown is None]:
        rides.renew(scene, body)
        known[body] = rides.shown(body)
    if not known:
        raise InputError("path cameras", "nobody rides a path", "an armature that does",
                         "select one and press Edit Path")
    places = np.concatenate([part for shown in known.values() for part in (shown.line, shown.ridden.origin)])
    shown = known.get(first) or next(iter(known.values()))
    frames = shown.first + np.arange(len(shown.ridden.origin), dtype=float)
    return Route(places, frames, shown.ridden.origin, shown.ridden.heading)


def set_up(scene: bpy.types.Scene, route: Route) -> list[str]:
    """Lay all cameras that are missing or as they were laid last; the names of those that are kept as somebody has
    moved them."""
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
    """Let the focus of the last camera run along with the body; nothing happens where it is gone or has keys of
    others."""
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
    """Place (T, 3) m and turn (T,) of the focus: the body's, smooth enough to look at."""
    step = np.linalg.norm(np.diff(route.origin, axis=0), axis=1)
    starts = np.flatnonzero(step > JUMP) + 1
    pieces = [(gaussian_smooth(place, SECONDS * fps / 2.0), gaussian_smooth(turn, SECONDS * fps)) for place,
              turn in zip(np.split(route.origin, starts), np.split(np.unwrap(route.heading)[:, None], starts))]
    return np.concatenate([place for place, _ in pieces]), np.concatenate([turn[:, 0] for _, turn in pieces])


def found(scene: bpy.types.Scene, kind: str) -> bpy.types.Object | None:
    """The camera of a kind; None where there is none."""
    return _marked(scene, kind)


def any_in(scene: bpy.types.Scene) -> bool:
    """Whether there is one of them at all."""
    collection = _kept(scene)
    return collection is not None and any(thing.get(MARK) in KINDS for thing in collection.objects)


def take(scene: bpy.types.Scene, camera: bpy.types.Object) -> None:
    """Make one of them the scene's camera, and remember whose place it took."""
    collection, before = _kept(scene), scene.camera
    if before is not None and not before.get(MARK):
        collection[BEFORE] = before
    scene.camera = camera


def give_back(scene: bpy.types.Scene) -> None:
    """The scene has the camera again that it had before `take`, which is remembered no more."""
    before = _kept(scene).pop(BEFORE, None)
    if before is not None and before.name in scene.objects:
        scene.camera = before


def untouched(camera: bpy.types.Object) -> bool:
    """Whether a camera is as it was laid: nobody has moved, animated or changed it."""
    laid, now = camera.get(LAID), _laid(camera)
    if laid is None or len(laid) != len(now) or camera.animation_data or camera.data.animation_data:
        return False
    hangs = camera.parent.get(MARK) == FOCUS if camera.parent else camera.get(MARK) != "BEHIND"
    return hangs and not len(camera.constraints) and bool(np.allclose(laid, now, rtol=1e-5, atol=1e-5))


def _laid(camera: bpy.types.Object) -> list[float]:
    """Where a camera is and what it sees, as numbers."""
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
    """Place a camera so that all corners (N, 3) m are in its frame; side: the yaw at which the way lies across."""
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
    """The nearest place (3,) from which a camera sees all corners (N, 3), the nearest ones being at its frame's edge.

    axes: (3, 3) the camera's own, in columns: right, up, back. half: (2,) half its frame's width and height at 1 m.
    With f the depth of a corner, it is inside where |x - X| <= (f - F) half, four half-spaces whose tips are the
    solution."""
    seen = corners @ axes * [1.0, 1.0, -1.0]
    right, left = (np.max(sign * seen[:, :2] - seen[:, 2:] * half, axis=0) for sign in (1.0, -1.0))
    depth = float(np.min(-(right + left) / (2.0 * half)))
    return axes @ np.array([*(right - left) / 2.0, -depth])


def _half_frame(scene: bpy.types.Scene, camera: bpy.types.Object) -> np.ndarray:
    """(2,) half the width and height of what a camera sees: 1 unit before it, or at a scale of 1 where it is
    orthographic."""
    frame = np.array(camera.data.view_frame(scene=scene))
    size = np.abs(frame[:, :2]).max(axis=0)
    return size if camera.data.type == "ORTHO" else size / np.abs(frame[0, 2])


def _side(places: np.ndarray) -> float:
    """The yaw in which a way's length lies across the picture, from left to right where it goes along X; 0 where it is
    round."""
    level = places[:, :2] - places[:, :2].mean(axis=0)
    spread, axes = np.linalg.eigh(level.T @ level)
    if spread[1] <= 0.0 or math.sqrt(max(spread[0], 0.0) / spread[1]) > ROUND:
        return 0.0
    x, y = axes[:, 1] * (1.0 if axes[0, 1] >= 0.0 else -1.0)
    return math.atan2(y, x)


def _corners(places: np.ndarray) -> np.ndarray:
    """The places with the room that a body takes there."""
    some = places[np.linspace(0, len(places) - 1, min(len(places), MOST)).astype(int)]
    room = np.array([(x, y, z) for x in (-WIDE, WIDE) for y in (-WIDE, WIDE) for z in (0.0, TALL)])
    return (some[:, None] + room).reshape(-1, 3)


def _hang(scene: bpy.types.Scene, collection: bpy.types.Collection, camera: bpy.types.Object) -> None:
    """Hang the camera behind its focus, which is made where it is missing."""
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
