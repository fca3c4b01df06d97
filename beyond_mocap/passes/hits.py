"""Hit analysis: when a part of the body can strike a ball, read from its movement alone (Ball handling §3, Fig. 2, 3).

A **high frame** is one in which the part is higher than around it and above a threshold; a **fast frame** one in which
it is faster than around it. Between a high frame and the fast frame beside it lies the **ball stretch**, in which a
ball can be struck. The **hit motion** goes from the lowest place before the high frame to the lowest one after it; what
lies between hit motions are **link stretches**, in which one clip can be left for another.

Nobody observed a ball: the strike's frame is the likeliest one, where the part is fastest. On recorded kicks that is
within 3 frames (at 120 per second) of where the foot's peak was labelled, which may lead the contact by as much.

What the paper leaves open, and what is done here: positions are smoothed by 0.1 s before they are compared, because
optical markers and suits shake at an impact; a kick's swing passes the ground at its fastest, so a lowest place ends
the hit motion only where the part is slow too; steps of walking and running lift the foot as well and are told from
hits by the body's own speed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..ball.contact import Tool, striking_surface
from ..base.errors import InputError
from ..motion import quaternion
from ..motion.humanoid import heading_from_positions, identify, leg_length
from ..motion.motion import Motion, forward_kinematics
from ..motion.skeleton import Skeleton
from ..motion.track import zero_phase_hann

_SIDED = ("foot", "hand", "tool")
_SMOOTHING = 0.1
_APART = 0.25
_SLOW = 0.4
_RISES = 0.03
# least rise in m above where the part usually is, and least speed in m/s, of an automatic threshold's hits
_LEAST_RISE = {"foot": 0.10, "head": 0.10, "chest": 0.08, "hand": 0.15, "tool": 0.20}
_LEAST_SPEED = {"foot": 1.5, "head": 0.8, "chest": 0.6, "hand": 2.0, "tool": 2.5}


@dataclass(frozen=True, eq=False, kw_only=True)
class HitMotion:
    """One hit motion (§3: S_H), all frames of its motion's own rate.

    first, last: where it begins and ends. high: the highest frame. fasts: the fastest before and after it. key: the
    likeliest frame of the strike (nobody observed a ball): the faster of the two. max_speed: of the part, m/s.
    vectors (4, 3) m and times (4,) s: the part's way first - fast - high - fast - last, as the body sees it (x where it
    faces on average, y to its left, the pelvis' own travel taken out), and how long each took (eq. 2: m_i, t_i).
    velocity (3,) m/s: of the part at the key, in the same frame but with the body's travel. facing: radians, world.
    size: the body's leg length, m. fps: frames per second."""

    part: str
    side: str
    first: int
    last: int
    high: int
    fasts: tuple[int, ...]
    key: int
    max_speed: float
    vectors: np.ndarray
    times: np.ndarray
    velocity: np.ndarray
    facing: float
    size: float
    fps: float

    @property
    def ball_stretch(self) -> tuple[int, int]:
        """First and last frame in which the ball can be struck (§3: S_B), between the key and the high frame."""
        return min(self.key, self.high), max(self.key, self.high)

    @property
    def direction(self) -> float:
        """Radians from where the body faces to where the part goes at the key: where a ball would leave to."""
        return float(np.arctan2(self.velocity[1], self.velocity[0]))


@dataclass(frozen=True, eq=False, kw_only=True)
class Hits:
    """What the hit analysis found in one motion.

    height (T,): of the part above the ground, m; speed (T,): its speed, m/s. highs, fasts: frames. threshold: the
    height in m above which high frames were looked for. motions: in order of time, without overlap. ball_stretches,
    links: (first, last) frames, both included. place (T, 3): the part, m, world."""

    part: str
    side: str
    fps: float
    threshold: float
    height: np.ndarray
    speed: np.ndarray
    place: np.ndarray
    highs: tuple[int, ...]
    fasts: tuple[int, ...]
    motions: tuple[HitMotion, ...]
    ball_stretches: tuple[tuple[int, int], ...]
    links: tuple[tuple[int, int], ...]

    @property
    def strongest(self) -> HitMotion | None:
        """The hit motion in which the part is fastest; None where there is none."""
        return max(self.motions, key=lambda one: one.max_speed, default=None)


def analyse(motion: Motion, part: str = "foot", side: str = "right", threshold: float | None = None,
            joint: str | None = None, tool: Tool | None = None) -> Hits:
    """Where `part` of one side can strike a ball.

    part: "foot", "head", "chest", "hand", "tool" (held in that side's hand), or a joint's name. side: "left" or
    "right", no matter for head and chest. threshold: m above the ground over which the part has to rise; None: found
    from the heights it reaches, and steps of walking and running are left out. joint: a joint's name to look at instead
    of the part's own place. tool: what is in the hand (default: a racquet). InputError: a side that is neither, a part
    or joint that the skeleton lacks, fewer than three frames, a threshold or poses that are no numbers."""
    _check(motion, threshold)
    positions, rotations = forward_kinematics(motion)
    place = strike_place(motion.skeleton, positions, rotations, part=joint or part, side=side, tool=tool)
    side = side if part in _SIDED else ""
    body = _Body.of(motion, positions)
    way = _Way.of(place, body, part, motion.fps)
    peaks = _peaks(way.height)
    level = _threshold(way.height, peaks, part) if threshold is None else float(threshold)
    highs = [frame for frame in peaks if way.height[frame] > level]
    spans = _spans(way, highs)
    if threshold is None:
        other = _other_foot(motion.skeleton, positions, side, motion.fps) if part == "foot" else None
        spans = [span for span in spans if _is_hit(span, part, way, body, other)]
    found = tuple(_hit_motion(part, side, span, way, body) for span in spans)
    return Hits(part=part, side=side, fps=motion.fps, threshold=level, height=way.height, speed=way.speed, place=place,
                highs=tuple(sorted({*highs, *(one.high for one in found)})), fasts=tuple(_apart(way.speed, motion.fps)),
                motions=found, ball_stretches=tuple(one.ball_stretch for one in found),
                links=_between(found, len(motion)))


def strongest(motion: Motion, part: str, side: str = "", tool: Tool | None = None) -> HitMotion | None:
    """The hit motion in which `part` is fastest; side "": of either side. None without any. InputError as `analyse`."""
    sides = (side,) if side else (("left", "right") if part in _SIDED else ("",))
    found = [hit for one in sides if (hit := analyse(motion, part, one, tool=tool).strongest)]
    return max(found, key=lambda hit: hit.max_speed, default=None)


def hit_at(motion: Motion, frame: int, span: tuple[int, int], part: str = "foot", side: str = "right",
           tool: Tool | None = None) -> HitMotion:
    """The hit motion of a strike whose frame is known, within `span` (first, last): also of parts that neither rise nor
    are fast, as in a trap, of which `analyse` sees nothing. InputError as there."""
    _check(motion, None)
    positions, rotations = forward_kinematics(motion)
    place = strike_place(motion.skeleton, positions, rotations, part=part, side=side, tool=tool)
    body = _Body.of(motion, positions)
    first = int(np.clip(span[0], 0, len(motion) - 3))
    last = int(np.clip(span[1], first + 2, len(motion) - 1))
    key = int(np.clip(frame, first + 1, last - 1))
    side = side if part in _SIDED else ""
    return _hit_motion(part, side, (first, last), way=_Way.of(place, body, part, motion.fps), body=body, key=key)


def strike_place(skeleton: Skeleton, positions: np.ndarray, rotations: np.ndarray, part: str, side: str,
                 tool: Tool | None = None) -> np.ndarray:
    """(..., 3) m, world: the middle of the striking part, from joint positions (..., J, 3) m and world rotations
    (..., J, 4). InputError where the skeleton lacks it."""
    return np.mean(striking_surface(skeleton, part, side, tool).line(positions, rotations), axis=0)


def _check(motion: Motion, threshold: float | None) -> None:
    if len(motion) < 3:
        raise InputError("motion", f"{len(motion)} frames", "three or more to find hits in")
    if threshold is not None and not np.isfinite(threshold):
        raise InputError("threshold", f"{threshold}", "metres above the ground")
    if not np.isfinite(motion.root_positions).all() or not np.isfinite(motion.rotations).all():
        raise InputError("motion", "values that are no numbers", "numbers in every frame")


@dataclass(frozen=True, eq=False, kw_only=True)
class _Body:
    """What of the body hits are seen against: pelvis (T, 3) m and its level speed (T,) m/s, both smoothed; facing (T,)
    radians; ground: m, the height of the floor; size: leg length, m."""

    pelvis: np.ndarray
    speed: np.ndarray
    facing: np.ndarray
    ground: float
    size: float

    @staticmethod
    def of(motion: Motion, positions: np.ndarray) -> "_Body":
        body = identify(motion.skeleton)
        toes = positions[:, [body.left.toe_or_foot, body.right.toe_or_foot], 2]
        pelvis = zero_phase_hann(positions[:, body.hips], motion.fps, _SMOOTHING)
        path = zero_phase_hann(pelvis[:, :2], motion.fps, 0.5)
        facing = np.unwrap(heading_from_positions(motion.skeleton, positions))
        speed = np.linalg.norm(_rate(path, motion.fps), axis=1)
        return _Body(pelvis=pelvis, speed=speed, facing=facing, ground=float(np.percentile(toes, 2)),
                     size=leg_length(motion.skeleton))


@dataclass(frozen=True, eq=False, kw_only=True)
class _Way:
    """The part's way, smoothed: place and velocity (T, 3) m and m/s, world; height (T,) m above the ground; speed (T,)
    m/s, of the head and the chest against the pelvis: a jump is faster than the nod that meets the ball."""

    place: np.ndarray
    velocity: np.ndarray
    height: np.ndarray
    speed: np.ndarray
    fps: float

    @staticmethod
    def of(place: np.ndarray, body: _Body, part: str, fps: float) -> "_Way":
        smooth = zero_phase_hann(place, fps, _SMOOTHING)
        velocity = _rate(smooth, fps)
        against = _rate(smooth - body.pelvis, fps) if part in ("head", "chest") else velocity
        return _Way(place=smooth, velocity=velocity, height=smooth[:, 2] - body.ground,
                    speed=np.linalg.norm(against, axis=1), fps=fps)


def _other_foot(skeleton: Skeleton, positions: np.ndarray, side: str, fps: float) -> np.ndarray:
    """(T,) m/s: how fast the foot is that does not strike."""
    limb = getattr(identify(skeleton), "left" if side == "right" else "right")
    place = positions[:, [limb.foot, limb.toe_or_foot]].mean(axis=1)
    return np.linalg.norm(_rate(zero_phase_hann(place, fps, _SMOOTHING), fps), axis=1)


def _rate(values: np.ndarray, fps: float) -> np.ndarray:
    """Central differences over time of (T, k), per second."""
    return np.gradient(values, axis=0) * fps


def _peaks(values: np.ndarray) -> list[int]:
    """Frames of `values` (T,) that are higher than their neighbours; of a level stretch its first."""
    rising = values[1:-1] > values[:-2]
    return (np.flatnonzero(rising & (values[1:-1] >= values[2:])) + 1).tolist()


def _apart(speed: np.ndarray, fps: float) -> list[int]:
    """The fast frames; of those closer than _APART seconds only the faster (§3: the part's return after a hit)."""
    kept: list[int] = []
    for frame in sorted(_peaks(speed), key=lambda frame: -speed[frame]):
        if all(abs(frame - other) >= _APART * fps for other in kept):
            kept.append(frame)
    return sorted(kept)


def _threshold(height: np.ndarray, peaks: list[int], part: str) -> float:
    """m: the height that divides the peaks into low and high best (Otsu 1979), at least a part's least rise above where
    it usually is: a foot on the ground, head and chest of who stands."""
    usual = float(np.percentile(height, 50 if part in ("head", "chest") else 10))
    least = usual + _LEAST_RISE.get(part, 0.10)
    tops = np.sort(height[peaks])
    if len(tops) < 2:
        return least
    before = np.cumsum(tops)[:-1] / np.arange(1, len(tops))
    after = (tops.sum() - np.cumsum(tops)[:-1]) / np.arange(len(tops) - 1, 0, -1)
    spread = np.arange(1, len(tops)) * np.arange(len(tops) - 1, 0, -1) * (after - before) ** 2
    cut = int(np.argmax(spread))
    return max(least, float(0.5 * (tops[cut] + tops[cut + 1])))


def _spans(way: _Way, highs: list[int]) -> list[tuple[int, int]]:
    """(first, last) of the hit motion around each high frame, those that overlap made one."""
    speed, lows = way.speed, [0, *_peaks(-way.height), len(way.height) - 1]
    spans: list[tuple[int, int]] = []
    for high in highs:
        if spans and high < spans[-1][1]:
            continue
        first = _lowest(speed, high, [low for low in reversed(lows) if low < high])
        last = _lowest(speed, high, [low for low in lows if low > high])
        if spans and first < spans[-1][1]:
            first = spans[-1][1]
        spans.append((first, last))
    return spans


def _lowest(speed: np.ndarray, high: int, lows: list[int]) -> int:
    """Of the lowest frames on one side of `high`, nearest first, the first where the part has come to rest between."""
    for low in lows:
        between = speed[min(low, high) : max(low, high) + 1]
        if speed[low] <= _SLOW * between.max():
            return low
    return lows[-1]


def _is_hit(span: tuple[int, int], part: str, way: _Way, body: _Body, other: np.ndarray | None) -> bool:
    """Whether the part is faster than a step or the swing of an arm at this speed of the body. Feet that walk reach 2.7
    times the body's speed and half a metre per second more, in a run 2.1 times; recorded kicks more than 4 times. A
    foot that strikes is also faster than the one that stands (`other`, (T,) m/s): in a jump both go alike."""
    key = span[0] + int(np.argmax(way.speed[span[0] : span[1] + 1]))
    if key in span or way.speed[key] < _LEAST_SPEED.get(part, 1.0):
        return False
    if part in ("head", "chest"):
        return True
    if other is not None and way.speed[key] - other[key] < 1.0:
        return False
    pace = body.speed[key]
    return way.speed[key] > min(3.0 * (pace + 0.5), 2.3 * pace + 2.5)


def _hit_motion(part: str, side: str, span: tuple[int, int], way: _Way, body: _Body,
                key: int | None = None) -> HitMotion:
    first, last = span
    key = first + int(np.argmax(way.speed[first : last + 1])) if key is None else key
    high = _high(way.height, first, key, last)
    fasts = _fastest(way.speed, first, high), _fastest(way.speed, high, last)
    frames = np.array([first, fasts[0], high, fasts[1], last])
    turns = body.facing[first : last + 1]
    facing = float(np.arctan2(np.sin(turns).mean(), np.cos(turns).mean()))
    turn = quaternion.about_up(np.array(-facing))
    steps = np.diff(way.place[frames] - body.pelvis[frames] * [1.0, 1.0, 0.0], axis=0)
    return HitMotion(part=part, side=side, first=first, last=last, high=high, fasts=fasts, key=key,
                     max_speed=float(way.speed[list(fasts)].max()), vectors=quaternion.rotate(turn, steps),
                     times=np.diff(frames) / way.fps, velocity=quaternion.rotate(turn, way.velocity[key]),
                     facing=facing, size=body.size, fps=way.fps)


def _high(height: np.ndarray, first: int, key: int, last: int) -> int:
    """The high frame beside the key: where the part rises to after it, or where it comes down from, as an arm that
    throws."""
    before = first + int(np.argmax(height[first : key + 1]))
    after = key + int(np.argmax(height[key : last + 1]))
    return after if height[after] > height[key] + _RISES or height[after] >= height[before] else before


def _fastest(speed: np.ndarray, first: int, last: int) -> int:
    """The fast frame between two frames; the fastest one where speed only rises or falls there."""
    inside = [first + 1 + frame for frame in _peaks(speed[first + 1 : last])]
    return max(inside or range(first, last + 1), key=lambda frame: speed[frame])


def _between(motions, count: int) -> tuple[tuple[int, int], ...]:
    """(first, last) of what lies between hit motions, before the first and after the last."""
    edges = [(-1, -1), *((one.first, one.last) for one in motions), (count, count)]
    found = [(a + 1, b - 1) for (_, a), (b, _) in zip(edges, edges[1:])]
    return tuple((first, last) for first, last in found if last > first)
