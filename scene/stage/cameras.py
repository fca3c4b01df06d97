"""Cameras of the stage that follow the bodies: broadcast, tactical, behind the goal, and one that moves along.

All are ordinary cameras with keys. The first three stand still, look at an empty and zoom; the last is the child of an
empty whose scale is its distance. An empty's path is smoothed by a Gaussian, forwards and backwards alike, so that a
camera neither jerks nor lags. Empties and lenses that play an action of the user's are left alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ...beyond_mocap.base.time_series import gaussian_smooth
from ..core import channels
from ..core.measure import frames_per_second, units_per_metre
from .cast import Cast, read_cast
from .meshes import create_object
from .stage_collection import FOCUS, STAGE_MARK, find_pitch_size, find_stage, get_stage, list_own_objects

VIEW_MARK = "beyond_mocap_view"
"""Custom property of a camera, and of the empty that it looks at: its view, one of `settings.VIEWS`."""

MARK = "beyond_mocap_focus"  # of an action of these cameras
NAMES = {"FOLLOW": "Camera", "BROADCAST": "Broadcast", "TACTICAL": "Tactical", "GOAL": "Behind Goal"}
SENSOR = 36.0  # mm
AIM_HEIGHT, FOCUS_HEIGHT = 1.0, 0.9  # m above the ground
CLOSE_UP = 3  # bodies up to which a camera shows them all; of more it shows the play around the ball
PLAY_REACH = 14.0  # m around the ball that belong to the play
HALF_WIDTH = 0.36  # m to either side that the following camera shows with some margin, for each metre of distance
FOLLOW_FROM, FOLLOW_LENS = (-1.5, -8.5, 1.3), 40.0  # m from the focus; mm
NEAREST, FARTHEST = 0.75, 4.0  # distance of the following camera, as a multiple of that
FOLLOW_SMOOTHING = 0.6  # s
BODY_REACH = 1.4  # m around a body's root that belong to the picture
EMPTY_REACH = 12.0  # m around the centre spot that are shown of an empty stage
PLACED = "beyond_mocap_placed"


@dataclass(frozen=True)
class Station:
    """Where a standing camera is, and how it follows.

    Attributes:
        behind: m behind the touch line, or behind the goal line.
        height: m above the ground.
        smoothing: s, of the Gaussian on its aim; its zoom takes twice that.
        width: m of the pitch in the picture, least and most.
        shows_all: whether all bodies are in the picture, however far from the ball.
    """

    behind: float
    height: float
    smoothing: float
    width: tuple[float, float]
    shows_all: bool = False


@dataclass(frozen=True, eq=False)
class Play:
    """What a camera follows: scene frames (F,), its middle on the ground (F, 2) m, and m from there to its edge (F,).
    """

    frames: np.ndarray
    middle: np.ndarray
    reach: np.ndarray


STATIONS = {"BROADCAST": Station(26.0, 17.0, 0.9, (15.0, 36.0)),
            "TACTICAL": Station(34.0, 23.0, 1.5, (30.0, 105.0), shows_all=True),
            "GOAL": Station(12.0, 6.0, 0.7, (11.0, 34.0))}


def find_camera(scene: bpy.types.Scene, view: str) -> bpy.types.Object | None:
    """Find the camera of a view; None if there is none."""
    stage = find_stage(scene)
    own = [thing for thing in list_own_objects(stage) if thing.type == "CAMERA"] if stage is not None else []
    old = own if view == "FOLLOW" else []  # of version 0.1, without that property
    return next((thing for thing in (*own, *old) if thing.get(VIEW_MARK, "FOLLOW") == view), None)


def get_camera(scene: bpy.types.Scene, view: str) -> bpy.types.Object:
    """Find the camera of a view, or create it, and let it follow the bodies that the scene has now."""
    camera = find_camera(scene, view)
    if camera is None:
        camera = _create_following(scene) if view == "FOLLOW" else _create_standing(scene, view)
    update_cameras(scene)
    return camera


def update_cameras(scene: bpy.types.Scene) -> None:
    """Let all existing cameras of the stage follow the bodies that the scene has now."""
    stage = find_stage(scene)
    if stage is None:
        return
    cast = read_cast(scene)
    for view in NAMES:
        camera = find_camera(scene, view)
        empty = _find_empty(camera)
        if empty is not None and _is_free(empty):
            (_animate_following if view == "FOLLOW" else _animate_standing)(scene, camera, empty, cast)


def is_own(scene: bpy.types.Scene, camera: bpy.types.Object) -> bool:
    """Return whether a camera is one of the stage's."""
    stage = find_stage(scene)
    return stage is not None and camera in list_own_objects(stage)


def is_part_of_view(thing: bpy.types.Object) -> bool:
    """Return whether an object of the stage is one of its cameras, or the empty that one follows."""
    return thing.type in {"CAMERA", "EMPTY"}


def _create_standing(scene: bpy.types.Scene, view: str) -> bpy.types.Object:
    """Create a camera that stands still, with the empty that it looks at."""
    camera, aim = _create_pair(scene, view, f"{NAMES[view]} aim")
    data, units = camera.data, units_per_metre(scene)
    data.sensor_width, data.clip_start, data.clip_end = SENSOR, units, 500.0 * units
    return camera


def _create_following(scene: bpy.types.Scene) -> bpy.types.Object:
    """Create the camera that moves along, with the empty that it looks at and moves with."""
    camera, focus = _create_pair(scene, "FOLLOW", FOCUS)
    units = units_per_metre(scene)
    focus.location = (0.0, 0.0, FOCUS_HEIGHT * units)
    camera.parent = focus
    camera.location = [distance * units for distance in FOLLOW_FROM]
    camera.data.lens, camera.data.clip_end = FOLLOW_LENS, 1000.0 * units
    return camera


def _create_pair(scene: bpy.types.Scene, view: str, target_name: str) -> tuple[bpy.types.Object, bpy.types.Object]:
    """Create a camera and the empty that it looks at."""
    stage = get_stage(scene)
    target = create_object(stage, target_name, None)
    target.empty_display_size = 0.5 * units_per_metre(scene)
    camera = create_object(stage, NAMES[view], bpy.data.cameras.new(NAMES[view]))
    look = camera.constraints.new("TRACK_TO")
    look.target, look.track_axis, look.up_axis = target, "TRACK_NEGATIVE_Z", "UP_Y"
    for thing in (camera, target):
        thing[STAGE_MARK], thing[VIEW_MARK] = True, view
    return camera, target


def _find_empty(camera: bpy.types.Object | None) -> bpy.types.Object | None:
    """Find the empty that a camera looks at."""
    looks = camera.constraints if camera is not None else ()
    return next((look.target for look in looks if look.type == "TRACK_TO" and look.target is not None), None)


def _is_free(thing: bpy.types.ID) -> bool:
    """Return whether an empty or a camera's lens plays nothing, or what these cameras have written."""
    action, _ = channels.find_playing_action(thing)
    data = thing.animation_data
    return action.get(MARK, False) if action is not None else data is None or not len(data.nla_tracks)


def _animate_standing(scene: bpy.types.Scene, camera: bpy.types.Object, aim: bpy.types.Object,
                      cast: Cast | None) -> None:
    """Let a standing camera pan and zoom with the play."""
    view, units, size = camera[VIEW_MARK], units_per_metre(scene), find_pitch_size(scene)
    station = STATIONS[view]
    play = _follow_play(scene, cast, station.smoothing, station.shows_all)
    _place_camera(camera, _compute_place(view, size, play.middle), units)
    width = np.clip(2.3 * play.reach + 7.0, *station.width)
    target = np.column_stack([play.middle, np.full(len(width), AIM_HEIGHT)])
    distance = np.linalg.norm(target - np.array(camera.location) / units, axis=1)
    _write_keys(aim, play.frames, "Object Transforms", {"location": target * units})
    if _is_free(camera.data):
        lens = np.clip(SENSOR * distance / width, 15.0, 400.0)
        _write_keys(camera.data, play.frames, "Lens", {"lens": lens[:, None]})


def _animate_following(scene: bpy.types.Scene, _camera: bpy.types.Object, focus: bpy.types.Object,
                       cast: Cast | None) -> None:
    """Let the following camera move with the play, at a distance at which it shows all of it."""
    play = _follow_play(scene, cast, FOLLOW_SMOOTHING, shows_all=False)
    path = np.column_stack([play.middle, np.full(len(play.frames), FOCUS_HEIGHT)]) * units_per_metre(scene)
    distance = np.clip((play.reach + BODY_REACH) / (HALF_WIDTH * np.linalg.norm(FOLLOW_FROM)), NEAREST, FARTHEST)
    _write_keys(focus, play.frames, "Object Transforms", {"location": path,
                                                          "scale": np.repeat(distance[:, None], 3, axis=1)})


def _follow_play(scene: bpy.types.Scene, cast: Cast | None, smoothing: float, shows_all: bool) -> Play:
    """Compute what a camera follows: the middle of all bodies, or of many bodies the ball and who is near it.

    Args:
        scene: the scene.
        cast: who moves; None for an empty stage, whose centre is shown.
        smoothing: s, of the Gaussian.
        shows_all: whether all bodies are followed, however many.
    Returns:
        The play.
    """
    if cast is None:
        return Play(np.array([scene.frame_start]), np.zeros((1, 2)), np.full(1, EMPTY_REACH))
    sigma = smoothing * frames_per_second(scene)
    ground = cast.places[:, :, :2]
    near_ball = len(cast.bodies) > CLOSE_UP and not shows_all
    followed = _find_ball(cast) if near_ball else 0.5 * (ground.min(axis=0) + ground.max(axis=0))
    middle = gaussian_smooth(followed, sigma)
    away = np.linalg.norm(np.concatenate([ground, followed[None]]) - middle, axis=-1)
    reach = np.where(away < PLAY_REACH, away, 0.0).max(axis=0) if near_ball else away.max(axis=0)
    return Play(cast.frames, middle, gaussian_smooth(reach[:, None], 2.0 * sigma)[:, 0])


def _find_ball(cast: Cast) -> np.ndarray:
    """Find where the ball is on the ground (F, 2) m, between and beyond its keys too; without one, the bodies' middle.
    """
    if cast.ball is None:
        return np.median(cast.places[:, :, :2], axis=0)
    known = np.isfinite(cast.ball[:, 0])
    columns = [np.interp(cast.frames, cast.frames[known], column[known]) for column in cast.ball[:, :2].T]
    return np.stack(columns, axis=1)


def _compute_place(view: str, size: tuple[float, float], middle: np.ndarray) -> np.ndarray:
    """Compute where a standing camera is (3,) m: behind the touch line, or behind the goal nearer to the play."""
    station = STATIONS[view]
    if view == "GOAL":
        return np.array([(size[0] / 2.0 + station.behind) * (1.0 if middle[:, 0].mean() >= 0.0 else -1.0), 0.0,
                         station.height])
    return np.array([0.0, -size[1] / 2.0 - station.behind, station.height])


def _place_camera(camera: bpy.types.Object, place: np.ndarray, units: float) -> None:
    """Place a camera, unless the user has moved it from where it was placed before."""
    if np.allclose(camera.get(PLACED, (0.0, 0.0, 0.0)), camera.location, atol=1e-4):
        camera.location = place * units
        camera[PLACED] = tuple(camera.location)


def _write_keys(thing: bpy.types.ID, frames: np.ndarray, group: str, curves: dict[str, np.ndarray]) -> None:
    """Replace the keys of an object or camera; a single frame sets the values without keys."""
    channels.remove_marked_action(thing, MARK)
    for path, values in curves.items():
        setattr(thing, path, values[0] if values.shape[1] > 1 else float(values[0, 0]))
    if len(frames) > 1:
        done = channels.create_action(thing, thing.name, frames, {path: (group, values)
                                                                  for path, values in curves.items()})
        done[MARK] = done[STAGE_MARK] = True
