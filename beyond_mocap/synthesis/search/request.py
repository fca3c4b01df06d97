"""The request at the library's rate: what every frame has to show, and which clips can serve each key moment."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from ...annotation import (
    AVOID_PREFIX,
    CONTINUOUS,
    DISCRETE,
    LOCOMOTION,
    STANDING_SPEED,
    TRANSITION,
    KeyMoment,
    Timeline,
    avoided_labels_per_frame,
    choose_gaits,
    compute_gait_thresholds,
    fill_timeline,
    labels_per_frame,
    sort_labels,
)
from ...annotation.ball_contact import takes_with_foot
from ...annotation.labels import list_gaits, read_labels
from ...annotation.vocabulary import DIRECTIONS, SIDES, find_nearest_labels
from ...base.errors import NotInLibraryError, TimedMessage, format_count, format_seconds
from ...base.fixes import Fix
from ...library.automatic_locomotion import build_automatic_labels
from ...library.keys import Key, list_nearest_labels, select_keys, select_nearest_keys, select_substitutes
from ...library.library import Library
from ...library.missing_actions import (
    ActionMoment,
    find_action_paths,
    is_action_clip,
    list_action_labels,
    names_action,
    select_own_kicks,
)
from ...motion.track import SampledTrack
from ..plan import Plan, ResolvedPlan
from ..requested_actions import read_moment_action
from .preferences import LagPreference, build_lag_preference, compute_manner_cost, compute_style_cost

PAPERS_OMEGA = 4.0  # Faustino 2016, §3.1.1
RECEPTION_RATES = (0.7, 0.85, 1.0, 1.1)
"""Playback rates at which the clip of a reception may be played: a foot that gives faster is a kick to the eye."""

USE_NEAREST = "turn on Nearest Labels"
"""Last words of the error for missing labels; the command line names its option instead."""

Labels = frozenset[str] | None


@dataclass(frozen=True, kw_only=True)
class RequestedKey:
    """A key moment of a request.

    Attributes:
        requested: the key moment of the timeline.
        frame: fractional frame at the library's rate.
        choices: key moments of clips that may serve it; empty: locomotion is shown instead.
        used_instead: the labels used where the library lacks the requested ones, else None.
        is_ball_height_known: whether the feed measured the ball's height then.
        rates: playback rates of its clip; none: `slots.KEY_PLAYBACK_RATES`.
    """

    requested: KeyMoment
    frame: float
    choices: tuple[Key, ...]
    used_instead: tuple[str, ...] | None
    is_ball_height_known: bool = False
    rates: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False, kw_only=True)
class SearchRequest:
    """A request of T frames at the library's rate.

    Attributes:
        plan: the plan, with the settings of the costs.
        track: the player at the library's rate.
        requested_labels: requested labels per frame, None where continuity alone counts.
        is_asked: (T,) bool, frames whose labels come from the user, not from the speed.
        gait: (T,) index into the library's gaits.
        timeline: the timeline, filled.
        keys: the key moments, in order of time.
        allowed: (C,) bool, clips to use.
        warnings: what the library lacks of the request.
        avoided: per frame the labels that must not be shown; empty where all may be shown throughout.
        style_cost: (N,) float32, cost per slot of library frames without the requested style, None where none is
            requested.
        manner_cost: (N,) float32, cost per slot of library frames that move unlike the player, None for no manner.
        weak_foot: side of the foot that key moments without a side avoid, or "".
        lag_preference: the player's preference for a lag, None for none.
        size: how many times as tall as the library's skeleton the player is; the track is in the library's size.
    """

    plan: Plan
    track: SampledTrack
    requested_labels: tuple[Labels, ...]
    is_asked: np.ndarray
    gait: np.ndarray
    timeline: Timeline
    keys: tuple[RequestedKey, ...]
    allowed: np.ndarray
    warnings: tuple[str, ...]
    avoided: tuple[frozenset[str], ...] = ()
    style_cost: np.ndarray | None = None
    manner_cost: np.ndarray | None = None
    weak_foot: str = ""
    lag_preference: LagPreference | None = None
    size: float = 1.0

    def __len__(self) -> int:
        return len(self.track.times)

    def list_avoided(self, first: int, end: int) -> frozenset[str]:
        """Return all labels that are avoided in any of the frames first .. end."""
        return frozenset().union(*self.avoided[max(first, 0) : end])


def build_request(library: Library, plan: ResolvedPlan, has_costs: bool = True) -> SearchRequest:
    """Convert a plan to frames at the library's rate.

    Args:
        library: the clips.
        plan: the resolved plan.
        has_costs: whether it is searched; False: an edit list is there, so no costs of style and manner are needed.
    Raises:
        NotInLibrary: for a key moment whose labels no clip carries, unless the plan continues with the nearest.
    """
    settings = plan.requested
    track = plan.sample_track(library.fps)
    gaits = library.gaits
    speeds = np.array([gait.speed for gait in gaits])
    labelled = plan.method == "path" and not settings.omega
    thresholds = library.gait_thresholds if labelled else compute_gait_thresholds(speeds, settings.omega
                                                                                  or PAPERS_OMEGA)
    gait = choose_gaits(track.speed, library.fps, speeds, thresholds)
    avoided = avoided_labels_per_frame(plan.timeline, track.times)
    gait = _replace_avoided_gaits(library, gait, track.speed, avoided)
    automatic = build_automatic_labels(library, gait, track)
    if any(avoided):
        automatic = [tuple(word for word in words if word not in avoid) for words, avoid in zip(automatic, avoided)]
    timeline = fill_timeline(plan.timeline, track.times, automatic)
    allowed = find_allowed_clips(library, settings)
    warnings: list[str] = []
    actions = [read_moment_action(moment, plan.track, track) for moment in timeline.keys]
    keys = _ignore_keys(library, timeline, track, gait, warnings) if plan.method == "baseline" else tuple(_build_key(
        library, moment, track, asked=asked, gait=gait, allowed=allowed, use_nearest=settings.nearest,
        has_synthetic=plan.method == "path" and settings.made, warnings=warnings,
    ) for moment, asked in zip(timeline.keys, actions))
    keys = tuple(replace(key, is_ball_height_known=asked.height is not None, rates=_choose_rates(key.requested))
                 for key, asked in zip(keys, actions))
    requested_labels = _clear_around_keys(labels_per_frame(timeline, track.times), keys, library)
    warnings += _report_missing_labels(library, plan.timeline)
    avoided = tuple(avoided) if any(avoided) else ()
    off_style = compute_style_cost(library, settings.style, settings.style_weight) if has_costs else None
    off_manner = compute_manner_cost(library, settings.manner) if has_costs else None
    weak_foot = {"left": "right", "right": "left"}.get(settings.strong_foot, "")
    lag_preference = build_lag_preference(library, settings.lag, settings.variety, float(track.times[0]))
    return SearchRequest(plan=settings, track=track, requested_labels=tuple(requested_labels),
                         is_asked=_find_asked(plan.timeline, track.times, requested_labels),
                         gait=gait,
                         timeline=timeline, keys=keys, allowed=allowed, warnings=tuple(warnings), avoided=avoided,
                         style_cost=off_style, manner_cost=off_manner,
                         weak_foot=weak_foot, lag_preference=lag_preference, size=plan.size)


def find_allowed_clips(library: Library, plan: Plan) -> np.ndarray:
    """Find the clips (C,) bool that a plan may show."""
    return np.array([plan.mirror or not clip.mirrored for clip in library.clips])


def _find_asked(timeline: Timeline, times: np.ndarray, requested_labels: list[Labels]) -> np.ndarray:
    """Find the frames (T,) bool whose labels come from the user or from the ball, not from speed and heading alone."""
    own = labels_per_frame(timeline, times)
    plain = {*LOCOMOTION, *DIRECTIONS}
    return np.array([bool(labels) or bool((wanted or frozenset()) - plain)
                     for labels, wanted in zip(own, requested_labels)])


def _replace_avoided_gaits(library: Library, gait: np.ndarray, speed: np.ndarray,
                           avoided: list[frozenset[str]]) -> np.ndarray:
    """Replace gaits (T,) with an avoided label by the gait nearest in speed, if there is one.

    Near by ratio, since a walking player rather jogs than stands still; speed (T,) m/s.
    """
    out = gait.copy()
    for frame in [frame for frame, avoid in enumerate(avoided) if library.gaits[gait[frame]].label in avoid]:
        others = [n for n, other in enumerate(library.gaits) if other.label not in avoided[frame]]
        away = [
            abs(np.log((library.gaits[n].speed + STANDING_SPEED) / (speed[frame] + STANDING_SPEED))) for n in others
        ]
        out[frame] = others[int(np.argmin(away))] if others else gait[frame]
    return out


def _build_key(library, moment: KeyMoment, track, asked: ActionMoment, gait, allowed, use_nearest: bool,
               has_synthetic: bool, warnings: list[str]) -> RequestedKey:
    """Build one key moment: its frame and the clips that may serve it.

    Recordings that carry the labels come first, with synthetic clips beside them; then receptions that are cut out of
    dribbles, swings of the library's own kicker, synthetic actions; then the nearest labels.
    """
    warnings += _report_no_action(moment)
    frame = _find_key_frame(library, moment, track)
    may_show = [key for key in library.keys if allowed[key.clip]]
    usable = tuple(key for key in may_show if not library.clips[key.clip].is_synthetic)
    actions = _select_action_keys(library, may_show, asked)
    synthetic = tuple(key for key in may_show if library.clips[key.clip].is_synthetic
                      and not is_action_clip(library.clips[key.clip]))
    if moment.avoid:
        usable, synthetic = _remove_avoided(moment, usable, synthetic, actions, warnings)
    choices = _choose_recorded(moment, asked, usable, synthetic, actions)
    if not choices:
        own = tuple(key for key in select_own_kicks(library, asked) if key in synthetic)
        cut = [key for key in library.cut_receptions if allowed[key.clip] and not key.labels & asked.avoid]
        choices = _choose_synthetic(moment, asked, own, actions, cut)
    if choices:
        return RequestedKey(requested=moment, frame=frame, choices=choices, used_instead=None)
    gait_words = library.gaits[int(gait[int(round(frame))])].labels
    return _build_nearest_key(moment, frame, usable, synthetic, gait_words=gait_words, use_nearest=use_nearest,
                              has_synthetic=has_synthetic, warnings=warnings)


def _find_key_frame(library: Library, moment: KeyMoment, track: SampledTrack) -> float:
    """Find the fractional frame of a key moment at the library's rate."""
    return float(np.clip((moment.resolved_time - track.times[0]) * library.fps, 0, len(track.times) - 1))


def _ignore_keys(library: Library, timeline: Timeline, track: SampledTrack, gait: np.ndarray,
                 warnings: list[str]) -> tuple[RequestedKey, ...]:
    """Build the key moments of a method that shows no actions: the gait continues there, which a warning says."""
    frames = [_find_key_frame(library, moment, track) for moment in timeline.keys]
    if frames:
        warnings.append(f"{format_count(len(frames), 'key moment')} ignored: this method shows gaits and no actions")
    return tuple(RequestedKey(requested=moment, frame=frame, choices=(),
                              used_instead=library.gaits[int(gait[int(round(frame))])].labels)
                 for moment, frame in zip(timeline.keys, frames))


def _choose_recorded(moment: KeyMoment, asked: ActionMoment, usable: tuple[Key, ...], synthetic: tuple[Key, ...],
                     actions: tuple[Key, ...]) -> tuple[Key, ...]:
    """Choose recordings that carry the labels, with the part that the ball's height asks for before any part, and
    synthetic clips that may stand beside them; none where no recording does.
    """
    fitting = select_keys(actions, asked.labels)
    choices = select_keys(usable, asked.labels) or (() if fitting else select_keys(usable, moment.words))
    if not choices:
        return ()
    beside = fitting if takes_with_foot(moment.words) else select_substitutes(choices, synthetic, moment.words)
    return (*choices, *beside)


def _choose_synthetic(moment: KeyMoment, asked: ActionMoment, own: tuple[Key, ...], actions: tuple[Key, ...],
                      cut: list[Key]) -> tuple[Key, ...]:
    """Choose the `own` kicker's swings, else synthetic actions; for a reception also those that are `cut` out."""
    choices = own or select_keys(actions, asked.labels) or select_keys(actions, moment.words)
    return (*select_keys(cut, asked.labels), *choices) if takes_with_foot(moment.words) else choices


def _build_nearest_key(moment: KeyMoment, frame: float, usable: tuple[Key, ...], synthetic: tuple[Key, ...],
                       gait_words: tuple[str, ...], use_nearest: bool, has_synthetic: bool,
                       warnings: list[str]) -> RequestedKey:
    """Build a key moment that the nearest labels serve, or the gait, with a warning; or raise where that is not wanted.
    """
    nearest = list_nearest_labels(usable, moment.words)
    problem = f"the library has no clip for '{' '.join(moment.words)}'{_describe_lasting(moment.words)}"
    text = (f"{format_seconds(moment.time)} s: {problem}; nearest: {_format_labels(nearest)}"
            f"{_describe_synthetic(moment.words) if has_synthetic else ''}")
    if not use_nearest:
        way_out = ("use one of these, " if nearest else "") + f"add such a clip, or {USE_NEAREST}"
        fixes = (Fix("use_nearest"), *([Fix("show_clips", nearest[0].split()[0])] if nearest else []),
                 Fix("show_label", repr(moment.time)))
        raise NotInLibraryError(f"{text}; {way_out}", nearest, moment.line, fixes)
    choices = select_nearest_keys(usable, moment.words)
    used = sort_labels(choices[0].labels) if choices else gait_words
    instead = " ".join(used) if choices else "locomotion continues there"
    warnings.append(TimedMessage(f"{text}; used instead: {instead}", (moment.time, moment.time)))
    return RequestedKey(requested=moment, frame=frame,
                        choices=(*choices, *select_substitutes(choices, synthetic, moment.words)), used_instead=used)


def _describe_lasting(words: Iterable[str]) -> str:
    """Describe which label of a key moment is that of a span; "" if none is."""
    lasting = [word for word in words if word in CONTINUOUS - DISCRETE - frozenset(list_gaits())]
    return f" as a key moment ('{lasting[0]}' lasts: give it a start and an end)" if lasting else ""


def _describe_synthetic(words: Iterable[str]) -> str:
    """Describe the synthetic actions nearest to a key moment's labels; "" where none is of their kind."""
    requested = set(words) & DISCRETE
    choices = {sort_labels(labels - {*SIDES, *list_gaits()}) for labels in list_action_labels() if labels & requested}
    nearest = find_nearest_labels(words, sorted(choices))
    return f"; synthetic: {' | '.join(map(' '.join, nearest))}" if nearest else ""


def _report_no_action(moment: KeyMoment) -> list[TimedMessage]:
    """Report a key moment whose labels say how, but not what: any action with them may be shown."""
    if any(names_action(word) or word not in read_labels() for word in moment.words):
        return []
    found = f"'{' '.join(moment.words)}' names no action, so any key moment with it may be shown"
    return [TimedMessage(f"{format_seconds(moment.time)} s: {found}; add one, such as kick or receive",
                         (moment.time, moment.time))]


def _select_action_keys(library: Library, keys: list[Key], asked: ActionMoment) -> tuple[Key, ...]:
    """Select the synthetic actions that were built for a requested one; any that are not avoided where none was."""
    actions = tuple(key for key in keys if is_action_clip(library.clips[key.clip]))
    paths, sides = find_action_paths(asked), asked.avoid & frozenset(SIDES)
    built = tuple(key for key in actions if library.clips[key.clip].path in paths and not key.labels & sides)
    return built or tuple(key for key in actions if not key.labels & asked.avoid)


def _choose_rates(moment: KeyMoment) -> tuple[float, ...]:
    """Choose the playback rates of a key moment's clip: one that takes the ball is not hurried."""
    return RECEPTION_RATES if takes_with_foot(moment.words) else ()


def _remove_avoided(moment: KeyMoment, usable: tuple[Key, ...], synthetic: tuple[Key, ...], actions: tuple[Key, ...],
                    warnings: list[str]):
    """Remove recorded and synthetic keys with labels that the moment avoids.

    Where no recorded one with its labels would be left, and no action has them, all stay and a warning is added.
    """
    remaining = tuple(tuple(key for key in keys if not key.labels.intersection(moment.avoid))
                      for keys in (usable, synthetic))
    left = (*remaining[0], *actions)
    if select_keys(usable, moment.words) and not select_keys(left, moment.words):
        avoided = " ".join(AVOID_PREFIX + word for word in moment.avoid)
        problem = f"no clip for '{' '.join(moment.words)}' is {avoided}"
        text = f"{format_seconds(moment.time)} s: {problem}; a clip with an avoided label is used"
        warnings.append(TimedMessage(text, (moment.time, moment.time)))
        return usable, synthetic
    return remaining


def _format_labels(labels: tuple[str, ...]) -> str:
    """Join labels for a message."""
    return " | ".join(labels) if labels else "the library has no key moments"


def _report_missing_labels(library: Library, timeline: Timeline) -> list[str]:
    """Report each label of a span that no clip carries."""
    requested = {word for span in timeline.spans for word in span.words} - {TRANSITION}
    lacking = sorted(requested - library.labels)
    return [f"no clip carries the label '{word}': spans with it follow their other labels" for word in lacking]


def _clear_around_keys(requested_labels: list[Labels], keys: tuple[RequestedKey, ...],
                       library: Library) -> list[Labels]:
    """Clear the requested labels around each key moment, for as long as the clips that may serve it need.

    With several clips, the mean of their needs counts.

    Source: Faustino 2016, §3.2.2, where elements of the annotation vector are zero in transitions.
    """
    requested_labels = list(requested_labels)
    for key in keys:
        if key.choices:
            entry, leave = np.mean([compute_needed_frames(library, choice) for choice in key.choices], axis=0)
            low = max(0, int(np.ceil(key.frame - entry)))
            for frame in range(low, min(len(requested_labels), int(key.frame + leave) + 1)):
                requested_labels[frame] = None
    return requested_labels


def compute_needed_frames(library: Library, key: Key) -> tuple[float, float]:
    """Compute how long a key's clip is needed before and after its key frame.

    Returns:
        Two numbers of frames at the library's rate.
    """
    rate = library.fps / library.clips[key.clip].motion.fps
    return (key.frame - key.start) * rate, (key.end - key.frame) * rate


def library_frame(library: Library, key: Key) -> float:
    """Return a key's place among the library's frames (fractional)."""
    return float(library.frames.first[key.clip] + key.frame * library.fps / library.clips[key.clip].motion.fps)


def name_clip_key(library: Library, key: Key) -> Key:
    """Name a key moment by all that what is measured around it depends on, besides its clip.

    The same clip has other frame numbers in other libraries. Half frames are rounded to even ones, so it matters
    whether the number of its first frame is even.
    """
    return replace(key, clip=int(library.frames.first[key.clip]) % 2)
