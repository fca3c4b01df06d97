"""The ball in the hands that hold it: before a throw and a punt, and after a catch.

A feed has a held ball somewhere at the player, and nothing of the arms that swing it. Here it goes with the hands for
as long as they are close together, or with the throwing hand: between both hands where it fits, otherwise in front of
them. A ball that is far from the hands there, as one that is punched, is not held. Only who throws or punts has held
it for certain, even where the feed has left it on the line beside them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...annotation.ball_contact import comes_from_hands, find_striking_part, uses_both_hands
from ...annotation.body_solid import BodySolid
from ...annotation.body_surfaces import build_body_surfaces
from ...annotation.striking import HAND_RADIUS
from ...base.easing import smoothstep
from ...base.time_series import find_runs
from ...base.vectors import cross_product, unit_vectors
from ...motion import quaternion
from ...motion.humanoid import identify_joints
from ...motion.motion import Motion, compute_pose
from ...motion.supports import GRAVITY
from ...motion.track import BALL_RADIUS

_TOUCHING = HAND_RADIUS + BALL_RADIUS
_CLOSE, _OPEN = 0.42, 0.6  # m between both hands up to which they hold a ball, and from which on one holds it alone
_NEAR, _NEAR_SECONDS = 1.5, 0.3  # m from the hands within which the feed's ball is, and s from the touch, if it is held
HELD_DISTANCE = 2.5
"""Metres on the ground beside a player up to which the feed's ball is the one that they throw or punt.

Feeds leave the ball of a throw-in where it went out or lay, and often fill it in until it is far in the field.
"""

_LONGEST = 4.0  # s that a ball is held
_EASE_SECONDS, _EASE_PACE = 0.35, 3.0  # s, least, and m/s in which it comes into the hands from the feed, and returns
_COMING_SECONDS = 1.2  # s beside a clip in which it may do so: as long as it takes from the farthest place of a feed's
_SHORTEST = 0.15  # s that a ball is held at least, and in which it passes from the hands to where it is met
_DROP_SECONDS = (0.08, 0.9)  # s of a fall from the hands to a foot, at least and at most
_SOLID = frozenset({"trunk", "head", "neck", "thigh", "shank"})
_ARMS_SHARE = 1.5  # how much more the forearms say than the chest where the front of both hands is
_ROUNDS = 3


@dataclass(frozen=True, kw_only=True)
class HandTouch:
    """A touch before or after which the ball may be held.

    Attributes:
        frames: first and last frame of the touch.
        words: labels that say which part meets the ball.
        low, high: first and last frame of the clip that plays there.
    """

    frames: tuple[int, int]
    words: tuple[str, ...]
    low: int
    high: int


def carry_in_hands(motion: Motion, ball: np.ndarray, touches: Sequence[HandTouch]
                   ) -> tuple[np.ndarray, list[tuple[int, int]]]:
    """Let the ball go with the hands that hold it.

    Args:
        motion: T frames.
        ball: (T, 3) m, its centre, at its place in the frames of the touches.
        touches: in order of time.
    Returns:
        The ball, and first and last frame of each time that it is held.
    """
    out, held, edges = ball, [], [0, *(frame for touch in touches for frame in touch.frames), len(ball) - 1]
    for number, touch in enumerate(touches):
        is_kick = comes_from_hands(touch.words) and find_striking_part(touch.words) == "foot"
        wide = _widen(touch, edges[2 * number], edges[2 * number + 3], motion.fps)
        span = _limit_span(ball, wide, int(_LONGEST * motion.fps))
        if span is None or not is_kick and find_striking_part(touch.words) != "hand":
            continue
        hands = _build_hands(motion, span, touch, out)
        if hands is None:
            continue
        if is_kick and (found := hands.find_drop(out)) is not None:
            out = hands.drop(out, found)
            held.append((found[0], touch.frames[0]))
        elif not is_kick:
            for found in (hands.find_before(out), hands.find_after(out)):
                out = out if found is None else hands.carry(out, found, meets=True)
                held += [] if found is None else [found]
    return out, held


def hold_in_spans(motion: Motion, ball: np.ndarray, spans: Sequence[tuple[int, int]],
                  met: Sequence[int] = ()) -> tuple[np.ndarray, list[tuple[int, int]]]:
    """Let the ball go with the hands while an action shows that it is held.

    Args:
        motion: T frames.
        ball: (T, 3) m, its centre.
        spans: first and last frame of each such action.
        met: frames in which the ball is met; it is back there.
    Returns:
        The ball, and first and last frame of each time that it is held.
    """
    out, held = ball, []
    for first, last in spans:
        touch = HandTouch(frames=(first, first), words=(), low=first, high=last)
        wide = _widen(touch, max([0, *(frame for frame in met if frame < first)]),
                      min([len(ball) - 1, *(frame for frame in met if frame > last)]), motion.fps)
        span = _limit_span(ball, wide, wide.high - wide.low)
        hands = None if span is None else _build_hands(motion, span, touch, ball)
        found = () if hands is None else hands.find_closed(out)
        for low, high in found:
            out = hands.carry(out, (low, high), meets=False)
            held.append((low, high))
    return out, held


def _widen(touch: HandTouch, before: int, after: int, fps: float) -> HandTouch:
    """Widen the frames of a touch by those in which the ball comes into the hands, between the touches beside it."""
    reach = int(_COMING_SECONDS * fps)
    return replace(touch, low=max(touch.low - reach, min(before, touch.low)),
                   high=min(touch.high + reach, max(after, touch.high)))


def _limit_span(ball: np.ndarray, touch: HandTouch, reach: int) -> tuple[int, int] | None:
    """Return the first and the last frame, up to `reach` from a touch, in which the ball is known and may be held."""
    first, last = touch.frames
    unknown = np.flatnonzero(~np.isfinite(ball).all(axis=1))
    if np.any((unknown >= first) & (unknown <= last)):
        return None
    low = max([touch.low, first - reach, 0, *(unknown[unknown < first] + 1)])
    return int(low), int(min([touch.high, last + reach, len(ball) - 1, *(unknown[unknown > last] - 1)]))


@dataclass(frozen=True, eq=False, kw_only=True)
class _Hands:
    """Hands that may hold a ball, W frames from frame `low` on.

    Attributes:
        touch: the touch.
        low: the first frame.
        places: (W, 3) m where a ball in the hands is.
        holds: (W,) bool, whether they can hold one.
        fps: frames per second.
    """

    touch: HandTouch
    low: int
    places: np.ndarray
    holds: np.ndarray
    fps: float

    def _is_near(self, ball: np.ndarray, frame: int) -> bool:
        """Return whether the ball is at the hands in a frame."""
        return bool(np.linalg.norm(self._find_offset(ball, frame)) < _NEAR)

    def _is_ready(self, ball: np.ndarray, frame: int) -> bool:
        """Return whether the ball of a later touch is in the hands in a frame: near them, or beside who throws it."""
        is_beside = np.linalg.norm(self._find_offset(ball, frame)[:2]) < HELD_DISTANCE
        return self._is_near(ball, frame) or bool(comes_from_hands(self.touch.words) and is_beside)

    def _find_offset(self, ball: np.ndarray, frame: int) -> np.ndarray:
        """Find the offset (3,) m of the ball from its place in the hands in a frame."""
        row = int(np.clip(frame - self.low, 0, len(self.places) - 1))
        return ball[self.low + row] - self.places[row]

    def _find_first(self, last: int) -> int:
        """Find the frame from which on the hands hold the ball up to the last frame."""
        open_hands = np.flatnonzero(~self.holds[: last - self.low])
        return self.low + (int(open_hands[-1]) + 1 if len(open_hands) else 0)

    def find_before(self, ball: np.ndarray) -> tuple[int, int] | None:
        """Find first and last frame before the touch in which the ball is held; None where it comes from elsewhere."""
        last = self.touch.frames[0]
        first = self._find_first(last)
        is_held = last - first >= _SHORTEST * self.fps and self._is_ready(ball, last - int(_NEAR_SECONDS * self.fps))
        return (first, last) if is_held else None

    def find_after(self, ball: np.ndarray) -> tuple[int, int] | None:
        """Find first and last frame behind the touch in which the ball is held; None where it goes elsewhere."""
        first = self.touch.frames[1]
        open_hands = np.flatnonzero(~self.holds[first - self.low :])
        last = first + int(open_hands[0]) - 1 if len(open_hands) else self.low + len(self.holds) - 1
        is_held = last - first >= _SHORTEST * self.fps and self._is_near(ball, first + int(_NEAR_SECONDS * self.fps))
        return (first, last) if is_held else None

    def find_closed(self, ball: np.ndarray) -> list[tuple[int, int]]:
        """Find first and last frame of each time that both hands are closed around a ball that is near."""
        runs = [(self.low + a, self.low + b - 1) for a, b in find_runs(self.holds)]
        return [(a, b) for a, b in runs if b - a >= _SHORTEST * self.fps and self._is_near(ball, (a + b) // 2)]

    def find_drop(self, ball: np.ndarray) -> tuple[int, int] | None:
        """Find first and last frame in which the hands hold the ball before they drop it to the foot."""
        least, most = (self.touch.frames[0] - int(seconds * self.fps) for seconds in _DROP_SECONDS)
        close = np.flatnonzero(self.holds[: max(least - self.low + 1, 0)]) + self.low
        if not len(close) or close[-1] < most or not self._is_ready(ball, int(close[-1])):
            return None
        return self._find_first(int(close[-1])), int(close[-1])

    def carry(self, ball: np.ndarray, span: tuple[int, int], meets: bool) -> np.ndarray:
        """Put the ball into the hands from the first to the last frame of a span; `meets`: one end is the touch."""
        frames = np.arange(self.low, self.low + len(self.places))
        eases = [self.fps * max(_EASE_SECONDS, float(np.linalg.norm(self._find_offset(ball, at))) / _EASE_PACE)
                 for at in span]
        room = span[0] - self.low, self.low + len(self.places) - 1 - span[1]
        first, last = (max(min(ease, free), 1.0) for ease, free in zip(eases, room))
        beyond = np.maximum((span[0] - frames) / first, (frames - span[1]) / last)
        share, places = 1.0 - smoothstep(np.clip(beyond, 0.0, 1.0)), self.places
        if meets:
            at = span[1] if span[1] == self.touch.frames[0] else span[0]
            share[(frames - at) * (1 if at == span[1] else -1) > 0] = 0.0
            near = 1.0 - smoothstep(np.clip(np.abs(frames - at) / (_SHORTEST * self.fps), 0.0, 1.0))
            places = places + near[:, None] * (ball[at] - places[at - self.low])
        out = ball.copy()
        out[frames] += share[:, None] * (places - ball[frames])
        out[frames, 2] = np.maximum(out[frames, 2], BALL_RADIUS)
        return out

    def drop(self, ball: np.ndarray, span: tuple[int, int]) -> np.ndarray:
        """Carry the ball, and let it fall from the hands to where the foot meets it."""
        met, out = self.touch.frames[0], self.carry(ball, span, meets=False)
        frames, seconds = np.arange(span[1], met + 1), (met - span[1]) / self.fps
        share = ((frames - span[1]) / (met - span[1]))[:, None]
        out[span[1] + 1 :] = ball[span[1] + 1 :]
        out[frames] = out[span[1]] + share * (ball[met] - out[span[1]])
        out[frames, 2] += 0.5 * GRAVITY * seconds**2 * share[:, 0] * (1.0 - share[:, 0])
        return out


def _build_hands(motion: Motion, span: tuple[int, int], touch: HandTouch, ball: np.ndarray) -> _Hands | None:
    """Compute where a ball in the hands is, and when they can hold one; None for bodies without hands."""
    body, low = identify_joints(motion.skeleton), span[0]
    joints = [body.left.hand, body.right.hand]
    if None in joints or None in (body.left.upper_arm, body.right.upper_arm):
        return None
    positions, world = compute_pose(motion.skeleton, motion.root_positions[low : span[1] + 1],
                                    motion.rotations[low : span[1] + 1])
    apart = np.linalg.norm(positions[:, joints[0]] - positions[:, joints[1]], axis=1)
    frames = np.arange(low, low + len(apart))
    shows = (frames >= touch.low) & (frames <= touch.high)
    places, holds = _place_between_hands(motion, positions, world), (apart < _CLOSE) & shows
    if find_striking_part(touch.words) == "hand" and not uses_both_hands(touch.words):
        at = touch.frames[0]
        hand = min(joints, key=lambda joint: float(np.linalg.norm(positions[at - low, joint] - ball[at])))
        in_palm = quaternion.rotate(quaternion.inverse(world[at - low, hand]), ball[at] - positions[at - low, hand])
        alone = smoothstep(np.clip((apart - _CLOSE) / (_OPEN - _CLOSE), 0.0, 1.0))[:, None]
        places = places + alone * (positions[:, hand] + quaternion.rotate(world[:, hand], in_palm) - places)
        both = frames[: at - low][holds[: at - low]]
        alone_from = both[-1] if len(both) else touch.low if comes_from_hands(touch.words) else at
        holds = (holds & (frames < at)) | (frames >= alone_from) & shows
    return _Hands(touch=touch, low=low, places=places, holds=holds, fps=motion.fps)


def _place_between_hands(motion: Motion, positions: np.ndarray, world: np.ndarray) -> np.ndarray:
    """Place a ball (W, 3) m so that it touches both hands: between them, or in front where they are closer than it is
    wide; before or behind trunk, head and legs, never inside.
    """
    body = identify_joints(motion.skeleton)
    left, right = positions[:, body.left.hand], positions[:, body.right.hand]
    across = unit_vectors(right - left, np.array([0.0, 1.0, 0.0]))
    arms = [positions[:, arm.hand] - positions[:, arm.lower_arm] for arm in (body.left, body.right)]
    front = unit_vectors(cross_product(positions[:, body.neck_or_chest] - positions[:, body.hips],
                                       positions[:, body.right.upper_arm] - positions[:, body.left.upper_arm]))
    ahead = unit_vectors(_ARMS_SHARE * unit_vectors(arms[0] + arms[1]) + front)
    ahead = unit_vectors(ahead - np.sum(ahead * across, axis=1, keepdims=True) * across)
    half = 0.5 * np.linalg.norm(right - left, axis=1)
    places = 0.5 * (left + right) + np.sqrt(np.maximum(_TOUCHING**2 - half**2, 0.0))[:, None] * ahead
    solid = BodySolid.from_pose([part for part in build_body_surfaces(motion.skeleton) if part.part in _SOLID],
                                positions, world)
    before = np.sum((places - positions[:, body.neck_or_chest]) * front, axis=1, keepdims=True) > 0.0
    for _ in range(_ROUNDS):
        places = places + np.maximum(solid.measure_depths(places).max(axis=1), 0.0)[:, None] * np.where(before, front,
                                                                                                        -front)
    return places
