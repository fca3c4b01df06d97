"""Takes of one player one after the other as one take, and the part of a take between two frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..annotation import Span, Timeline
from ..base.errors import spans_of
from ..motion.motion import concatenate
from ..motion.track.ball_path import BallPath
from ..synthesis.plan import Plan
from ..synthesis.take import DribbleTouch, Take

_SAME_TIME = 1e-6


def own_part(take: Take, first: int, end: int) -> Take:
    """Frames first .. end of a take, with the key moments, pins, touches and warnings of that time. It has no edit
    list, and nothing that would be needed to edit it."""
    inside = slice(first, end)
    begin, fps = take.start_time + first / take.motion.fps, take.motion.fps
    until = begin + (end - first) / fps
    seams = take.seams[(take.seams >= first) & (take.seams < end)] - first
    ball = take.ball
    if ball is not None:
        turns = None if ball.rotations is None else ball.rotations[inside]
        ball = BallPath(ball.times[inside], ball.positions[inside], ball.measured[inside], turns)
    values = {name: getattr(take, name) for name in ("correction", "ik_miss", "stepped")}
    return replace(
        take, motion=take.motion.frames(first, end), start_time=begin, clip=take.clip[inside],
        clip_frame=take.clip_frame[inside], mirrored=take.mirrored[inside], words=take.words[inside],
        contacts=take.contacts[inside], seams=seams, ball=ball,
        **{name: None if each is None else each[inside] for name, each in values.items()},
        timeline=_between(take.timeline, begin, until),
        keys=tuple(
            replace(key, frame=key.frame - first) for key in take.keys if _within(key.asked.in_force, begin, until)
        ),
        pins=tuple(pin for pin in take.pins if _within(pin.pin.time, begin, until)),
        dribbled=tuple(
            DribbleTouch(max(one.first - first, 0), min(one.last, end - 1) - first, one.side)
            for one in take.dribbled if one.first < end and one.last >= first
        ),
        warnings=tuple(line for line in take.warnings if _told_in(line, begin, until)),
        unpinned=None, met_ball=None, plan=None, edit=None,
    )  # fmt: skip


def _within(time: float, begin: float, until: float) -> bool:
    return begin - _SAME_TIME <= time < until - _SAME_TIME


def _told_in(line: str, begin: float, until: float) -> bool:
    """Whether a line is about no time, or about one that begins here."""
    spans = spans_of(line)
    return not spans or _within(spans[0][0], begin, until)


def _between(timeline: Timeline, begin: float, until: float) -> Timeline:
    """Spans cut to a time, and the key moments in it."""
    spans = [span for span in timeline.spans if span.start < until - _SAME_TIME and span.end > begin + _SAME_TIME]
    cut = [replace(span, start=max(span.start, begin), end=min(span.end, until)) for span in spans]
    return Timeline(tuple(cut), tuple(key for key in timeline.keys if _within(key.in_force, begin, until)))


def one_take(takes: Sequence[Take], plan: Plan) -> Take:
    """Takes that follow each other without a gap, as one; plan: the order of their time."""
    clips = tuple(dict.fromkeys(path for take in takes for path in take.clips))
    number = {path: index for index, path in enumerate(clips)}
    firsts = np.cumsum([0, *(len(take.motion) for take in takes)])
    seams = np.concatenate([take.seams + first for take, first in zip(takes, firsts)])
    arrays = ("clip_frame", "mirrored", "contacts", "correction", "ik_miss", "stepped")
    begin, fps = takes[0].start_time, takes[0].motion.fps
    return replace(
        takes[0], motion=concatenate([take.motion for take in takes]), clips=clips,
        clip=np.concatenate([np.array([number[path] for path in take.clips], int)[take.clip] for take in takes]),
        **{name: np.concatenate([getattr(take, name) for take in takes]) for name in arrays},
        words=tuple(words for take in takes for words in take.words), seams=seams[seams > 0],
        timeline=_one_timeline([take.timeline for take in takes]),
        keys=tuple(
            replace(key, frame=key.frame + first) for take, first in zip(takes, firsts) for key in take.keys
        ),
        pins=tuple(pin for take in takes for pin in take.pins),
        dribbled=tuple(
            DribbleTouch(one.first + int(first), one.last + int(first), one.side)
            for take, first in zip(takes, firsts) for one in take.dribbled
        ),
        ball=_one_ball(takes, begin + np.arange(firsts[-1]) / fps),
        warnings=tuple(dict.fromkeys(line for take in takes for line in take.warnings)),
        seconds={name: sum(take.seconds.get(name, 0.0) for take in takes) for name in takes[0].seconds},
        plan=plan, solved=plan.solved,
    )  # fmt: skip


def _one_timeline(timelines: Sequence[Timeline]) -> Timeline:
    """Timelines one after the other; a span that goes on in the next is one span."""
    spans: list[Span] = []
    for span in sorted((s for each in timelines for s in each.spans), key=lambda span: (span.words, span.start)):
        last = spans[-1] if spans else None
        same = last is not None and (last.words, last.avoid) == (span.words, span.avoid)
        if same and span.start <= last.end + _SAME_TIME:
            spans[-1] = replace(last, end=max(last.end, span.end))
        else:
            spans.append(span)
    return Timeline(tuple(spans), tuple(key for each in timelines for key in each.keys))


def _one_ball(takes: Sequence[Take], times: np.ndarray) -> BallPath | None:
    """The ball of all takes; unknown where one has none, None where none has any. times: (T,) s of all frames."""
    if all(take.ball is None for take in takes):
        return None
    empty = [(np.full((len(take.motion), 3), np.nan), np.zeros(len(take.motion), bool)) for take in takes]
    pairs = [none if take.ball is None else (take.ball.positions, take.ball.measured)
             for take, none in zip(takes, empty)]  # fmt: skip
    places, measured = (np.concatenate(column) for column in zip(*pairs))
    return BallPath(times, places, measured)
