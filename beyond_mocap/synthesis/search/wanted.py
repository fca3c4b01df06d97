"""The request at the library's rate: what every frame has to show, and which clips can serve each key moment."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...annotation import (
    MUST_NOT,
    STANDING_SPEED,
    TRANSITION,
    KeyMoment,
    Timeline,
    automatic_gaits,
    avoided_per_frame,
    fill,
    gait_thresholds,
    spoken,
    words_per_frame,
)
from ...base.errors import NotInLibrary, TimedLine, told_time
from ...library.automatic import automatic_words
from ...library.keys import Key, nearest_serving, nearest_words, serving, standing_in
from ...library.library import Library
from ...motion.track import SampledTrack
from ..plan import Plan, ResolvedPlan
from .preferences import Taste, off_style_cost, taste

PAPERS_OMEGA = 4.0  # Faustino 2024, §3.1.1

Words = frozenset[str] | None


@dataclass(frozen=True, kw_only=True)
class WantedKey:
    """A key moment of a request.

    Attributes:
        requested: the key moment of the timeline.
        frame: fractional frame at the library's rate.
        choices: key moments of clips that may serve it; empty: locomotion is shown instead.
        used_instead: the labels used where the library lacks the requested ones, else None.
        is_ball_height_known: whether the feed measured the ball's height then.
        rates: playback rates of its clip; none: `slots.KEY_PLAYBACK_RATES`.
    """

    asked: KeyMoment
    frame: float
    choices: tuple[Key, ...]
    used_instead: tuple[str, ...] | None
    ball_height_known: bool = False
    rates: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False, kw_only=True)
class Wanted:
    """A request of T frames at the library's rate.

    Attributes:
        plan: the plan, with the settings of the costs.
        track: the player at the library's rate.
        requested_labels: requested labels per frame, None where continuity alone counts.
        gait: (T,) index into the library's gaits.
        timeline: the timeline, filled.
        keys: the key moments, in order of time.
        allowed: (C,) bool, clips to use.
        warnings: what the library lacks of the request.
        avoided: per frame the labels that must not be shown; empty where all may be shown throughout.
        style_cost: (N,) float32, cost per slot of library frames without the requested style, None where none is
            requested.
        weak_foot: side of the foot that key moments without a side avoid, or "".
        lag_preference: the player's preference for a lag, None for none.
    """

    plan: Plan
    track: SampledTrack
    asked: tuple[Words, ...]
    gait: np.ndarray
    timeline: Timeline
    keys: tuple[WantedKey, ...]
    allowed: np.ndarray
    warnings: tuple[str, ...]
    avoided: tuple[frozenset[str], ...] = ()
    off_style: np.ndarray | None = None
    weak_foot: str = ""
    taste: Taste | None = None

    def __len__(self) -> int:
        return len(self.track.times)

    def avoided_in(self, first: int, end: int) -> frozenset[str]:
        """Return all labels that are avoided in any of the frames first .. end."""
        return frozenset().union(*self.avoided[max(first, 0) : end])


def build_order(library: Library, plan: ResolvedPlan) -> Wanted:
    """Convert a plan to frames at the library's rate.

    Args:
        library: the clips.
        plan: the resolved plan.
    Raises:
        NotInLibrary: for a key moment whose labels no clip carries, unless the plan continues with the nearest.
    """
    asked_for = plan.asked
    track = plan.sampled(library.fps)
    gaits = library.gaits
    speeds = np.array([gait.speed for gait in gaits])
    labelled = plan.method == "path" and not asked_for.omega
    thresholds = library.gait_thresholds if labelled else gait_thresholds(speeds, asked_for.omega or PAPERS_OMEGA)
    gait = automatic_gaits(track.speed, library.fps, speeds, thresholds)
    avoided = avoided_per_frame(plan.timeline, track.times)
    gait = _other_gaits(library, gait, track.speed, avoided)
    automatic = automatic_words(library, gait, track)
    automatic = [tuple(word for word in words if word not in avoid) for words, avoid in zip(automatic, avoided)]
    timeline = fill(plan.timeline, track.times, automatic)
    allowed = np.array([asked_for.mirror or not clip.mirrored for clip in library.clips])
    warnings: list[str] = []
    keys = tuple(_key(
        library, moment, track, gait=gait, allowed=allowed, go_on=asked_for.nearest, warnings=warnings,
    ) for moment in timeline.keys)
    known = plan.track.ball_height_known
    nearest_sample = [int(np.argmin(np.abs(plan.track.times - key.asked.in_force))) for key in keys]
    keys = tuple(replace(key, ball_height_known=bool(known[at])) for key, at in zip(keys, nearest_sample))
    asked = _with_transitions(words_per_frame(timeline, track.times), keys, library)
    warnings += _lacking(library, plan.timeline)
    avoided = tuple(avoided) if any(avoided) else ()
    off_style = off_style_cost(library, asked_for.style, asked_for.style_weight, warnings)
    weak_foot = {"left": "right", "right": "left"}.get(asked_for.strong_foot, "")
    own = taste(library, asked_for.lag, asked_for.variety, float(track.times[0]))
    return Wanted(plan=asked_for, track=track, asked=tuple(asked), gait=gait, timeline=timeline, keys=keys,
                  allowed=allowed, warnings=tuple(warnings), avoided=avoided, off_style=off_style,
                  weak_foot=weak_foot, taste=own)


def _other_gaits(library: Library, gait: np.ndarray, speed: np.ndarray, avoided: list[frozenset[str]]) -> np.ndarray:
    """Replace gaits (T,) with an avoided label by the gait nearest in speed, if there is one.

    Near by ratio, since a walking player rather jogs than stands still; speed (T,) m/s.
    """
    out = gait.copy()
    for frame in [frame for frame, avoid in enumerate(avoided) if library.gaits[gait[frame]].word in avoid]:
        others = [n for n, other in enumerate(library.gaits) if other.word not in avoided[frame]]
        away = [
            abs(np.log((library.gaits[n].speed + STANDING_SPEED) / (speed[frame] + STANDING_SPEED))) for n in others
        ]
        out[frame] = others[int(np.argmin(away))] if others else gait[frame]
    return out


def _key(library, moment: KeyMoment, track, gait, allowed, go_on: bool, warnings: list[str]) -> WantedKey:
    """Build one key moment: its frame and the clips that may serve it."""
    frame = float(np.clip((moment.in_force - track.times[0]) * library.fps, 0, len(track.times) - 1))
    usable = tuple(key for key in library.keys if allowed[key.clip] and not library.clips[key.clip].made)
    made = tuple(key for key in library.keys if allowed[key.clip] and library.clips[key.clip].made)
    if moment.avoid:
        usable, made = _without(moment, usable, made, warnings)
    # recordings that carry the labels first, then synthetic clips
    choices = serving(usable, moment.words)
    if choices:
        return WantedKey(asked=moment, frame=frame, choices=(*choices, *standing_in(choices, made, moment.words)),
                         used_instead=None)
    offered = nearest_words(usable, moment.words)
    line = f"line {moment.line}, " if moment.line else ""
    lacks = f"the library has no clip for '{' '.join(moment.words)}'"
    text = f"{line}{told_time(moment.time)} s: {lacks}; nearest: {_listed(offered)}"
    if not go_on:
        way_out = "add such a clip, or turn on Nearest Labels"
        raise NotInLibrary(f"{text}; use one of these, {way_out}", offered)
    choices = nearest_serving(usable, moment.words)
    gait_words = library.gaits[int(gait[int(round(frame))])].words
    used = spoken(choices[0].words) if choices else gait_words
    instead = " ".join(used) if choices else "locomotion continues there"
    warnings.append(TimedLine(f"{text}; used instead: {instead}", (moment.time, moment.time)))
    return WantedKey(asked=moment, frame=frame, choices=(*choices, *standing_in(choices, made, moment.words)),
                     used_instead=used)


def _without(moment: KeyMoment, usable: tuple[Key, ...], made: tuple[Key, ...], warnings: list[str]):
    """Remove recorded and synthetic keys with labels that the moment avoids.

    Where no recorded one with its labels would be left, all stay and a warning is added.
    """
    kept = tuple(tuple(key for key in keys if not key.words.intersection(moment.avoid)) for keys in (usable, made))
    if serving(usable, moment.words) and not serving(kept[0], moment.words):
        avoided = " ".join(MUST_NOT + word for word in moment.avoid)
        lacks = f"no clip for '{' '.join(moment.words)}' is {avoided}"
        text = f"{told_time(moment.time)} s: {lacks}; a clip with an avoided label is used"
        warnings.append(TimedLine(text, (moment.time, moment.time)))
        return usable, made
    return kept


def _listed(offered: tuple[str, ...]) -> str:
    """Join labels for a message."""
    return " | ".join(offered) if offered else "the library has no key moments"


def _lacking(library: Library, timeline: Timeline) -> list[str]:
    """Report each label of a span that no clip carries."""
    asked = {word for span in timeline.spans for word in span.words} - {TRANSITION}
    lacking = sorted(asked - library.words)
    return [f"no clip carries the label '{word}': spans with it follow their other labels" for word in lacking]


def _with_transitions(asked: list[Words], keys: tuple[WantedKey, ...], library: Library) -> list[Words]:
    """Clear the requested labels around each key moment, for as long as the clips that may serve it need.

    With several clips, the mean of their needs counts.

    Source: Faustino 2024, §3.2.2, where elements of the annotation vector are zero in transitions.
    """
    asked = list(asked)
    for key in keys:
        if key.choices:
            entry, leave = np.mean([needed(library, choice) for choice in key.choices], axis=0)
            low = max(0, int(np.ceil(key.frame - entry)))
            for frame in range(low, min(len(asked), int(key.frame + leave) + 1)):
                asked[frame] = None
    return asked


def needed(library: Library, key: Key) -> tuple[float, float]:
    """Compute how long a key's clip is needed before and after its key frame.

    Returns:
        Two numbers of frames at the library's rate.
    """
    rate = library.fps / library.clips[key.clip].motion.fps
    return (key.frame - key.start) * rate, (key.end - key.frame) * rate


def pool_frame(library: Library, key: Key) -> float:
    """Return a key's place among the library's frames (fractional)."""
    return float(library.frames.first[key.clip] + key.frame * library.fps / library.clips[key.clip].motion.fps)
