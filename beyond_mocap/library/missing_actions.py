"""Actions that are asked for and that no recording shows: a synthetic clip of each, built on first use.

A recording that carries all requested labels is always preferred. Where there is none, `synthetic.actions` may have a
row that answers to them; its clip is built for the player's speed and the ball's height at the key moment, in steps, so
that few clips serve many moments. The clip's path says all of it, so that an edit list is enough to build it again:

    made-gait/action_diving_header_v3.0_z0.8.bvh
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np

from ..annotation import ClipAnnotation, sort_labels
from ..annotation.ball_contact import build_surfaces, takes_with_foot
from ..annotation.labels import find_label, list_gaits
from ..annotation.vocabulary import SIDES
from ..base.errors import InputError
from ..base.time_series import find_equal_runs
from ..motion import contacts
from ..motion.motion import compute_pose, forward_kinematics, sample_frames
from ..motion.track import smooth_zero_phase_hann
from .actions.clip_file import load_clip, save_clip
from .cache import write_synthetic_clips
from .clip import KICK_PREFIX, SYNTHETIC_FOLDER, SYNTHETIC_FPS, Clip
from .features import SMOOTH_SECONDS
from .keys import Key, select_keys
from .library import Library

if TYPE_CHECKING:
    from ..synthetic.actions.action import Action, ActionSetting

ACTION_PREFIX = "action_"
_FOLDER = SYNTHETIC_FOLDER + ACTION_PREFIX
_NAME = re.compile(r"(?P<name>\w+?)(_v(?P<speed>\d+\.\d))?(_z(?P<height>\d+\.\d))?(_b(?P<exit_speed>\d+\.\d))?"
                   r"(_d(?P<direction>[+-]\d+))?(_t(?P<seconds>\d+\.\d))?(?P<side>_side)?\.bvh")
_HEIGHT_SLACK = 0.15  # m by which the ball may be lower or higher than an action is built for
_HEIGHT_STEP = 0.1  # m between the heights of the ball for which an action is built
_FADE_SECONDS = 0.7  # s behind an action that can last: its fading shows neither it nor a gait, and has no labels
_SECONDS_STEP, _LONGEST = 0.5, 20.0  # s between the times for which an action is built that can last; more is repeated
# factor on a recorded reception's speed, and m/s, up to which a player may be as fast: beyond, feet slide
_RECEPTION_ROOM, _SLOW_RECEPTION = 1.4, 1.7
_SPEED_ROOM, _SPEED_SLACK = 1.2, 0.3  # factor and m/s by which a player may be slower or faster than a variant
_OWN_KICK_SPEED = 2.0  # m/s of players from which on a library's own kicker has kicks of any strength
_GAITS = frozenset(list_gaits())
_SIDE = "right"  # of clips that are not mirrored
_KEPT, _KEPT_CLIPS = 2, 400  # extended libraries, some 40 MB each, and clips, some 0.3 MB, kept for each library

_clips: WeakKeyDictionary[Library, dict[str, tuple[Clip, Clip]]] = WeakKeyDictionary()
_settings: WeakKeyDictionary[Library, ActionSetting] = WeakKeyDictionary()
_extended: WeakKeyDictionary[Library, dict[tuple[str, ...], Library]] = WeakKeyDictionary()


@dataclass(frozen=True, kw_only=True)
class ActionMoment:
    """A requested action.

    Attributes:
        labels: the requested labels.
        avoid: labels that it must not show.
        speed: m/s of the player.
        height: m of the ball's centre, None where it is unknown.
        ball_speed: m/s of the ball before, 0 where it is unknown.
        exit_speed: m/s with which the ball leaves, None where it is unknown.
        lead: m/s by which it leaves faster than the player, along their way; 0 where it is unknown.
        is_span: whether the labels are a span's.
        seconds: s that the span lasts.
    """

    labels: frozenset[str]
    avoid: frozenset[str] = frozenset()
    speed: float = 0.0
    height: float | None = None
    ball_speed: float = 0.0
    exit_speed: float | None = None
    lead: float = 0.0
    is_span: bool = False
    seconds: float = 0.0


def list_actions() -> tuple[Action, ...]:
    """List all actions with a synthetic clip; their tables are loaded on first use, since most takes need none."""
    from ..synthetic.actions.table import ACTIONS

    return ACTIONS


def find_action(moment: ActionMoment) -> Action | None:
    """Find the synthetic action that answers to a requested one.

    Args:
        moment: the requested action.
    Returns:
        The first of the table that suits the player's speed and the ball's height; None where no action answers, or
        where the labels name none.
    """
    requested = moment.labels - frozenset(SIDES)
    serving = [action for action in list_actions()
               if action.is_span == moment.is_span and _answers(action, moment) and moment.lead >= action.least_lead]
    names = {action.name for action in serving}

    def rate_misfit(action: Action) -> tuple:
        low, high = action.heights or action.meets
        off = 0.0 if moment.height is None else max(low - moment.height, moment.height - high)
        return action.varies in names, not action.suits_speed(moment.speed), off > _HEIGHT_SLACK, -action.least_lead

    is_named = any(names_action(word) for word in requested)
    return min(serving, key=rate_misfit, default=None) if is_named else None


def find_missing_actions(library: Library, moments: Iterable[ActionMoment], mirror: bool = True) -> tuple[str, ...]:
    """Find the synthetic clips for the requested actions that no recording shows.

    A recorded reception with the foot shows only one whose ball is about as high, and whose player about as fast.

    Args:
        library: the clips.
        moments: the requested actions.
        mirror: whether mirrored twins may be shown.
    Returns:
        Paths of clips, sorted, each once; for `add_actions`. They are those of the library's own kicker where there is
        such a kick.
    """
    asked = [moment for moment in moments if find_action(moment) and not _is_recorded(library, moment, mirror)]
    return tuple(sorted({path for moment in asked
                         for path in _list_own_kicks(library, moment, mirror) or find_action_paths(moment)}))


def _list_own_kicks(library: Library, moment: ActionMoment, mirror: bool) -> list[str]:
    """List the paths of the clips of `select_own_kicks`; without building any for players that are too slow."""
    if moment.is_span or moment.speed < _OWN_KICK_SPEED:
        return []
    library = library.with_synthetic_clips
    return [library.clips[key.clip].path for key in select_own_kicks(library, moment, mirror)]


def select_own_kicks(library: Library, moment: ActionMoment, mirror: bool = True) -> tuple[Key, ...]:
    """Select the kicks on the run of a library's own kicker that answer to a requested action.

    Args:
        library: the clips, with synthetic ones.
        moment: the requested action.
        mirror: whether mirrored twins may be shown.
    Returns:
        Their key moments; empty where no swing is recorded, or the player is too slow for them.
    """
    if moment.is_span or moment.speed < _OWN_KICK_SPEED:
        return ()
    kicks = [key for key in library.keys if library.clips[key.clip].path.startswith(SYNTHETIC_FOLDER + KICK_PREFIX)
             and (mirror or not library.clips[key.clip].mirrored) and not key.labels & moment.avoid]
    return select_keys(kicks, moment.labels)


def find_action_paths(moment: ActionMoment) -> tuple[str, ...]:
    """Find the paths of the synthetic clips that answer to a requested action; none where no action does."""
    return tuple(path for action in _list_actions(moment) for path in _name_clips(action, moment))


def _list_actions(moment: ActionMoment) -> list[Action]:
    """List the action that answers best to a requested one, and those that vary it and fit the player and the ball."""
    best = find_action(moment)
    if best is None:
        return []
    return [best, *(one for one in list_actions() if one.varies == best.name and _answers(one, moment)
                    and _is_speed_near(one, moment.speed) and moment.ball_speed <= one.most_ball_speed)]


def _answers(action: Action, moment: ActionMoment) -> bool:
    """Return whether an action has the requested labels and none of the avoided ones."""
    requested = moment.labels - frozenset(SIDES)
    return action.needs <= requested <= action.labels and not action.distinct_labels & moment.avoid


def _is_speed_near(action: Action, speed: float) -> bool:
    """Return whether a player at `speed` m/s is near the speeds for which an action is built."""
    slowest, fastest = (action.speeds[0], action.speeds[-1]) if action.speeds else action.suited_speeds
    return slowest <= _SPEED_ROOM * speed + _SPEED_SLACK and speed <= _SPEED_ROOM * fastest + _SPEED_SLACK


def add_actions(library: Library, paths: Iterable[str]) -> Library:
    """Add the synthetic clips of actions to a library, each with its mirrored twin.

    They are built once for each library object and are not part of its cache.

    Args:
        library: the clips.
        paths: of clips; those that are no synthetic actions, or that it has, are left out.
    Returns:
        The library, itself if nothing is added.
    Raises:
        InputError: for an action that is not in the table.
    """
    known = {clip.path for clip in library.clips if clip.path.startswith(_FOLDER)}
    added = tuple(sorted({path for path in paths if path.startswith(_FOLDER)} - known))
    if not added:
        return library
    extended = _extended.setdefault(library, {})
    if added not in extended:
        _make_room(extended, _KEPT)
        clips = [clip for path in added for clip in _find_clips(library, path)]
        extended[added] = library.append_synthetic_clips(clips)
    return extended[added]


def find_action_clip(library: Library, path: str) -> Clip | None:
    """Find the synthetic clip of an action, not its mirrored twin.

    Args:
        library: the clips.
        path: of the clip.
    Returns:
        The clip; None where no request is answered by a clip of that path.
    """
    if not path.startswith(_FOLDER):
        return None
    try:
        action, numbers, sides = _parse_path(path)
    except InputError:
        return None
    moment = ActionMoment(labels=sides, speed=numbers.get("speed", 0.0), height=numbers.get("height"),
                          exit_speed=numbers.get("exit_speed"), seconds=numbers.get("seconds", 0.0))
    return _find_clips(library.with_synthetic_clips, path)[0] if path in _name_clips(action, moment) else None


def describe_action(path: str) -> str | None:
    """Describe the action that a clip shows.

    Args:
        path: of the clip.
    Returns:
        Its name as reports call it; None if it is no synthetic action.
    """
    return _parse_path(path)[0].name if path.startswith(_FOLDER) else None


def list_action_labels(is_span: bool = False) -> tuple[frozenset[str], ...]:
    """List the labels that every synthetic action can serve, with either side.

    Args:
        is_span: those of spans instead of key moments.
    """
    return tuple(action.labels | {side} for action in list_actions() if action.is_span == is_span for side in SIDES)


def is_action_clip(clip: Clip) -> bool:
    """Return whether a clip shows a synthetic action."""
    return clip.path.startswith(_FOLDER)


def names_action(word: str) -> bool:
    """Return whether a label names an action, not how or at which pace it is done.

    Args:
        word: the label.
    """
    label = find_label(word)
    return word not in _GAITS and bool(label.is_root or label.parts or label.ball or label.in_flight)


def _is_recorded(library: Library, moment: ActionMoment, mirror: bool) -> bool:
    """Return whether a recording carries all labels of a requested action."""
    shown = np.array([(mirror or not clip.mirrored) and not clip.is_synthetic for clip in library.clips])
    if not moment.is_span:
        found = select_keys([key for key in library.keys if shown[key.clip] and not key.labels & moment.avoid],
                            moment.labels)
        return bool(found) if not takes_with_foot(moment.labels) else any(
            _suits_reception(library, key, moment) for key in found)
    frames = library.frames
    columns = [frames.vocabulary.index(word) for word in moment.labels - _GAITS if word in frames.vocabulary]
    avoided = [frames.vocabulary.index(word) for word in moment.avoid if word in frames.vocabulary]
    carries = frames.words[:, columns].all(axis=1) & ~frames.words[:, avoided].any(axis=1) & shown[frames.clip]
    return len(columns) == len(moment.labels - _GAITS) and bool(carries.any())


def _suits_reception(library: Library, key: Key, moment: ActionMoment) -> bool:
    """Return whether a recorded reception is played about as fast as the player moves, and as high as the ball is."""
    motion = library.clips[key.clip].motion
    frame = library.frames.find_nearest(key.clip, key.frame, motion.fps)
    if moment.speed > max(_RECEPTION_ROOM * library.frames.speed[frame], _SLOW_RECEPTION):
        return False
    if moment.height is None:
        return True
    places, world = compute_pose(motion.skeleton, *sample_frames(motion, np.array([key.frame])))
    lines = [part.compute_line(places[0], world[0]) for part in build_surfaces(motion.skeleton, key.labels)]
    return min((abs(np.mean(line, axis=0)[2] - moment.height) for line in lines), default=0.0) <= _HEIGHT_SLACK


def _name_clips(action: Action, moment: ActionMoment) -> list[str]:
    """Name the clips of an action that answers to a requested one, one for each direction."""
    text = action.name.replace(" ", "_").replace("-", "_")
    if action.speeds:
        text += f"_v{min(action.speeds, key=lambda speed: abs(speed - moment.speed)):.1f}"
    if action.heights and moment.height is not None:
        height = min(max(moment.height, action.heights[0]), action.heights[1])
        text += f"_z{round(height / _HEIGHT_STEP) * _HEIGHT_STEP:.1f}"
    if action.exit_speeds and moment.exit_speed is not None:
        text += f"_b{min(action.exit_speeds, key=lambda speed: abs(speed - moment.exit_speed)):.1f}"
    seconds = max(round(moment.seconds / _SECONDS_STEP), 1) * _SECONDS_STEP
    end = f"_t{min(seconds, _LONGEST):.1f}" if action.can_last else ""
    end += "_side.bvh" if moment.labels & frozenset(SIDES) and not action.has_side else ".bvh"
    ways = [f"_d{degrees:+.0f}" for degrees in action.directions] or [""]
    return [f"{_FOLDER}{text}{way}{end}" for way in ways]


def _parse_path(path: str) -> tuple[Action, dict[str, Any], frozenset[str]]:
    """Parse a clip's path: its action, what of the situation it is built for, and the sides that it carries."""
    found = _NAME.fullmatch(path.removeprefix(_FOLDER))
    named = {action.name.replace(" ", "_").replace("-", "_"): action for action in list_actions()}
    if found is None or found["name"] not in named:
        raise InputError(path, "an unknown synthetic action", "one of this version's", "synthesize the take again")
    action = named[found["name"]]
    numbers = {name: float(found[name]) for name in ("speed", "height", "exit_speed", "direction", "seconds")
               if found[name]}
    return action, numbers, frozenset({_SIDE} if action.has_side or found["side"] else ())


def _find_clips(library: Library, path: str) -> tuple[Clip, Clip]:
    """Find a clip and its twin among those built for a library, or build them."""
    known = _clips.setdefault(library, {})
    if path not in known:
        _make_room(known, _KEPT_CLIPS)
        _parse_path(path)  # no file is opened for a name that is no action's
        clip = _find_clip(library, path)
        known[path] = clip, clip.build_twin()
    return known[path]


def _find_clip(library: Library, path: str) -> Clip:
    """Load a clip that an earlier process has built, or build it, for later ones where the library has a cache."""
    if not library.cache_location:
        return _build_clip(library, path)
    place, key = library.cache_location
    known = load_clip(place, key, library.skeleton, path)
    clip = known or _build_clip(library, path)
    write_synthetic_clips(place, [clip], missing_only=known is not None)  # over a file of another version
    if known is None:
        save_clip(place, key, clip)
    return clip


def _make_room(kept: dict, most: int) -> None:
    """Remove the oldest entries so that one more makes `most` of them."""
    while len(kept) >= most:
        del kept[next(iter(kept))]


def _build_clip(library: Library, path: str) -> Clip:
    """Build the clip of a path."""
    from ..synthetic.lying import detect_lying_legs
    from .synthetic_clips import detect_still_points

    action, numbers, sides = _parse_path(path)
    gesture = action.build(replace(_find_setting(library), **numbers))
    motion, first, last = gesture.motion, np.ceil(gesture.start * SYNTHETIC_FPS), np.floor(gesture.end * SYNTHETIC_FPS)
    last = min(last, len(motion) - 1)
    key = None if action.is_span else gesture.key * SYNTHETIC_FPS
    row = ClipAnnotation(first, last, key, sort_labels(action.labels | sides))
    touched = contacts.detect_heel_toe_contacts(motion) & detect_still_points(motion) & ~detect_lying_legs(motion)
    fades = int(_FADE_SECONDS * SYNTHETIC_FPS) if action.can_last else 0
    rows = (row, *_build_gait_rows(library, motion, before=int(first), after=int(last) + 1 + fades))
    return Clip(path=path, mirrored=False, motion=motion, annotations=rows, heel_toe_contacts=touched)


def _find_setting(library: Library) -> ActionSetting:
    """Find the setting of a library's actions: its skeleton and how people stand on it."""
    from ..synthetic.actions.action import ActionSetting
    from .synthetic_clips import sample_upright_example

    if library not in _settings:
        recordings = [clip for clip in library.clips if not clip.is_synthetic]
        _settings[library] = ActionSetting(skeleton=library.skeleton, example=sample_upright_example(recordings),
                                           fps=SYNTHETIC_FPS)
    return _settings[library]


def _build_gait_rows(library: Library, motion, before: int, after: int) -> list[ClipAnnotation]:
    """Build rows with the gait before a frame and from another one on, by speed."""
    gaits = library.gaits
    path = smooth_zero_phase_hann(forward_kinematics(motion)[0][:, 0, :2], motion.fps, SMOOTH_SECONDS)
    speed = np.linalg.norm(np.gradient(path, axis=0), axis=1) * motion.fps
    band = np.searchsorted(library.gait_thresholds, speed, side="right")
    parts = ((0, before), (after, len(motion)))
    return [ClipAnnotation(low + a, low + b - 1, None, gaits[band[low + a]].labels)
            for low, high in parts if high - low > 1 for a, b in find_equal_runs(band[low:high])]
