"""Hit analysis: detect from its movement alone when a part of the body can strike a ball (Ball handling, section 3).

A **high frame** is one in which the part is higher than in the frames around it and above a threshold; a **fast frame**
is one in which it is faster than around it. Between a high frame and the adjacent fast frame lies the **ball stretch**,
in which a ball can be struck. The **hit motion** runs from the lowest position before the high frame to the lowest one
after it. The frames between hit motions are **link stretches**, in which one clip can be left for another (Fig. 2, 3).

No ball is observed: the strike's frame is the most likely one, where the part is fastest. On recorded kicks that is
within 3 frames (at 120 per second) of the labelled peak of the foot, which itself may lead the contact by as much.

Choices where the paper is silent: positions are smoothed over 0.1 s before they are compared, because optical markers
and suits shake at an impact. A kick's swing passes the ground at its fastest, so a lowest position ends the hit motion
only where the part is slow as well. Steps of walking and running also lift the foot; the body's own speed separates
them from hits.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..annotation.striking import SIDED_PARTS
from ..ball.contact import Tool
from ..base.errors import InputError
from ..motion import quaternion
from ..motion.motion import Motion
from .part_trajectory import PartMeasures, PartTrajectory, PlayerBody, measure_part

_APART = 0.25  # s: least distance of two fast frames; the part's return after a hit is closer
_SLOW = 0.4  # of the highest speed in a hit motion: the part is at most so fast at its ends
_SLOWED = 0.9  # of the highest speed: a part that is slower again has struck
_RECENT = 0.3  # s after a strike in which a hit motion under way is noticed
_LEAST_RISE_AFTER = 0.03  # m: least rise after the strike for the high frame to lie after it
# with an automatic threshold: least rise in m above the part's typical height, and least speed in m/s, of a hit
_LEAST_RISE = {"foot": 0.10, "head": 0.10, "chest": 0.08, "hand": 0.15, "tool": 0.20}
_LEAST_SPEED = {"foot": 1.5, "head": 0.8, "chest": 0.6, "hand": 2.0, "tool": 2.5}


@dataclass(frozen=True, eq=False, kw_only=True)
class HitMotion:
    """One hit motion (section 3: S_H). All frames are in its motion's own rate.

    Attributes:
        part: part of the body that strikes.
        side: "left", "right", or "" for parts without sides.
        first: frame on which it begins.
        last: frame on which it ends.
        high: highest frame.
        fasts: fastest frame before and fastest frame after `high`.
        key: most likely frame of the strike (no ball is observed): the faster of the two.
        max_speed: highest speed of the part, m/s.
        vectors: (4, 3) m, displacements first - fast - high - fast - last in the body's frame (x: its mean heading, y:
            to its left), pelvis travel removed (eq. 2: m_i); NaN where a motion under way has not come to them.
        times: (4,) s, duration of each displacement (eq. 2: t_i); NaN likewise.
        velocity: (3,) m/s of the part at the key, in the same axes but including the body's travel.
        facing: mean heading, rad, world.
        size: the body's leg length, m.
        fps: frames per second.
    """

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
        """First and last frame in which the ball can be struck (section 3: S_B), between the key and the high frame."""
        return min(self.key, self.high), max(self.key, self.high)

    @property
    def direction(self) -> float:
        """Angle in rad from the body's heading to the part's velocity at the key: where a ball would leave to."""
        return float(np.arctan2(self.velocity[1], self.velocity[0]))


@dataclass(frozen=True, eq=False, kw_only=True)
class Hits:
    """Result of the hit analysis of one motion with T frames.

    Attributes:
        part: part that was analysed.
        side: "left", "right", or "" for parts without sides.
        fps: frames per second.
        threshold: height in m above the ground that high frames exceed.
        height: (T,) m, the part above the ground.
        speed: (T,) m/s of the part.
        place: (T, 3) m, the part, world frame.
        highs: high frames.
        fasts: fast frames.
        motions: hit motions in order of time, without overlap.
        ball_stretches: (first, last) frame of each, both included.
        links: (first, last) frame of each link stretch, both included.
    """

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
        """The hit motion with the highest speed of the part, or None."""
        return max(self.motions, key=lambda one: one.max_speed, default=None)


def detect_hits(motion: Motion, part: str = "foot", side: str = "right", threshold: float | None = None,
                joint: str | None = None, tool: Tool | None = None, measured: PartMeasures | None = None) -> Hits:
    """Detect the hits of one part of the body in a motion.

    Args:
        motion: the motion, three frames or more.
        part: "foot", "head", "chest", "hand", "tool" (held in that side's hand), or a joint's name.
        side: "left" or "right"; ignored for head and chest.
        threshold: metres above the ground that the part has to exceed. None: found from the heights it reaches, and
            steps of walking and running are left out.
        joint: name of a joint to use instead of the part's own position.
        tool: what is in the hand; default: a racquet.
        measured: `measure_part` of all this, where it is known.
    Returns:
        All high and fast frames, hit motions, ball stretches and link stretches.
    Raises:
        InputError: for an unknown side, a part or joint that the skeleton lacks, fewer than three frames, or NaN or
        infinite values in the threshold or the poses.
    Source: Ball handling, section 3.
    """
    _check_input(motion, threshold)
    measured = measured or measure_part(motion, part, side, joint=joint, tool=tool)
    body, trajectory, other = measured.body, measured.trajectory, measured.other
    side = side if part in SIDED_PARTS else ""
    peaks = _find_peaks(trajectory.height)
    height_threshold = _find_threshold(trajectory.height, peaks, part) if threshold is None else float(threshold)
    highs = [frame for frame in peaks if trajectory.height[frame] > height_threshold]
    spans = _find_spans(trajectory, highs)
    if threshold is None:
        spans = [span for span in spans if _is_hit(span, part, trajectory, body, other)]
    hit_motions = tuple(_build_hit_motion(part, side, span, trajectory, body) for span in spans)
    return Hits(part=part, side=side, fps=motion.fps, threshold=height_threshold, height=trajectory.height,
                speed=trajectory.speed, place=measured.place,
                highs=tuple(sorted({*highs, *(one.high for one in hit_motions)})),
                fasts=tuple(_find_fast_frames(trajectory.speed, motion.fps)), motions=hit_motions,
                ball_stretches=tuple(one.ball_stretch for one in hit_motions),
                links=_find_links(hit_motions, len(motion)))


def detect_hit_under_way(motion: Motion, part: str = "foot", side: str = "right", threshold: float | None = None,
                         tool: Tool | None = None, measured: PartMeasures | None = None) -> HitMotion | None:
    """Detect a hit motion that is not over yet, but whose strike has just been: the part slows down again.

    It has to be as fast as `detect_hits` wants, to move ahead of the body, and to be above the threshold before, at or
    since the strike.

    Args:
        motion: the motion up to now, three frames or more.
        part, side, threshold, tool, measured: as in `detect_hits`.
    Returns:
        The hit motion up to now, with NaN for the displacements and durations that are still to come; None if there
        is none.
    Raises:
        InputError: as `detect_hits`.
    """
    _check_input(motion, threshold)
    measured = measured or measure_part(motion, part, side, tool=tool)
    body, trajectory, other = measured.body, measured.trajectory, measured.other
    speed, height, now = trajectory.speed, trajectory.height, len(motion) - 1
    earliest = max(now - int(_RECENT * motion.fps), 0)
    key = earliest + int(np.argmax(speed[earliest:]))
    if key == earliest or speed[now] > _SLOWED * speed[key]:
        return None
    peaks = _find_peaks(height)
    lows = [0, *_find_peaks(-height)]
    first = _find_lowest(speed, key, [low for low in reversed(lows) if low < key])
    top = first + int(np.argmax(height[first:]))
    least_height = _find_threshold(height, sorted({*peaks, top}), part) if threshold is None else threshold
    if first == 0 or speed[first:].max() > speed[key] or height[top] <= least_height:
        return None
    if threshold is None and not _is_hit((first, now), part, trajectory, body, other):
        return None
    hit = _build_hit_motion(part, side if part in SIDED_PARTS else "", (first, now), trajectory, body, key=key)
    if hit.velocity[0] < 0.0:  # it draws back for the strike
        return None
    coming = np.arange(4) >= (1 if hit.high > key else 3)
    return replace(hit, vectors=np.where(coming[:, None], np.nan, hit.vectors),
                   times=np.where(coming, np.nan, hit.times))


def find_strongest_hit(motion: Motion, part: str, side: str = "", tool: Tool | None = None) -> HitMotion | None:
    """Find the hit motion with the highest speed of a part.

    Args:
        motion: the motion.
        part: as in `detect_hits`.
        side: "left", "right", or "" for either.
        tool: what is in the hand.
    Returns:
        The hit motion, or None if there is none.
    Raises:
        InputError: as `detect_hits`.
    """
    sides = (side,) if side else (("left", "right") if part in SIDED_PARTS else ("",))
    hits = [hit for one in sides if (hit := detect_hits(motion, part, one, tool=tool).strongest)]
    return max(hits, key=lambda hit: hit.max_speed, default=None)


def build_hit_at(motion: Motion, frame: int, span: tuple[int, int], part: str = "foot", side: str = "right",
                 tool: Tool | None = None) -> HitMotion:
    """Build the hit motion of a strike whose frame is known.

    Works also for parts that neither rise nor are fast, such as in a trap, which `detect_hits` does not see.

    Args:
        motion: the motion, three frames or more.
        frame: frame of the strike.
        span: first and last frame of the hit motion; clamped to the motion.
        part: as in `detect_hits`.
        side: as in `detect_hits`.
        tool: what is in the hand.
    Returns:
        The hit motion with its key on `frame`.
    Raises:
        InputError: as `detect_hits`.
    """
    _check_input(motion, None)
    measured = measure_part(motion, part, side, tool=tool)
    first = int(np.clip(span[0], 0, len(motion) - 3))
    last = int(np.clip(span[1], first + 2, len(motion) - 1))
    key = int(np.clip(frame, first + 1, last - 1))
    side = side if part in SIDED_PARTS else ""
    return _build_hit_motion(part, side, (first, last), measured.trajectory, measured.body, key=key)


def _check_input(motion: Motion, threshold: float | None) -> None:
    if len(motion) < 3:
        raise InputError("motion", f"{len(motion)} frames", "three or more")
    if threshold is not None and not np.isfinite(threshold):
        raise InputError("threshold", f"{threshold}", "a height in metres above the ground")
    if not np.isfinite(motion.root_positions).all() or not np.isfinite(motion.rotations).all():
        raise InputError("motion", "NaN or infinite values", "finite numbers in every frame")


def _find_peaks(values: np.ndarray) -> list[int]:
    """Find the frames of `values` (T,) that are higher than their neighbours; of a plateau the first frame."""
    rising = values[1:-1] > values[:-2]
    return (np.flatnonzero(rising & (values[1:-1] >= values[2:])) + 1).tolist()


def _find_fast_frames(speed: np.ndarray, fps: float) -> list[int]:
    """Find the fast frames; of those closer than _APART seconds only the fastest (section 3: the part's return after a
    hit).
    """
    fast_frames: list[int] = []
    for frame in sorted(_find_peaks(speed), key=lambda frame: -speed[frame]):
        if all(abs(frame - other) >= _APART * fps for other in fast_frames):
            fast_frames.append(frame)
    return sorted(fast_frames)


def _find_threshold(height: np.ndarray, peaks: list[int], part: str) -> float:
    """Compute the height in m that best divides the peaks into low and high ones (Otsu 1979).

    It is at least a part's least rise above its typical height: a foot on the ground, head and chest of a standing
    person.
    """
    usual_height = float(np.percentile(height, 50 if part in ("head", "chest") else 10))
    least_height = usual_height + _LEAST_RISE.get(part, 0.10)
    tops = np.sort(height[peaks])
    if len(tops) < 2:
        return least_height
    # Otsu: for each cut of the sorted peaks, the means on both sides and the variance between them
    mean_below = np.cumsum(tops)[:-1] / np.arange(1, len(tops))
    mean_above = (tops.sum() - np.cumsum(tops)[:-1]) / np.arange(len(tops) - 1, 0, -1)
    # between-class variance, without its constant factor
    spread = np.arange(1, len(tops)) * np.arange(len(tops) - 1, 0, -1) * (mean_above - mean_below) ** 2
    cut = int(np.argmax(spread))
    return max(least_height, float(0.5 * (tops[cut] + tops[cut + 1])))


def _find_spans(trajectory: PartTrajectory, highs: list[int]) -> list[tuple[int, int]]:
    """Find (first, last) of the hit motion around each high frame; overlapping ones are merged."""
    speed, lows = trajectory.speed, [0, *_find_peaks(-trajectory.height), len(trajectory.height) - 1]
    spans: list[tuple[int, int]] = []
    for high in highs:
        if spans and high < spans[-1][1]:
            continue
        first = _find_lowest(speed, high, [low for low in reversed(lows) if low < high])
        last = _find_lowest(speed, high, [low for low in lows if low > high])
        # the hit motion before it ends here at the latest
        if spans and first < spans[-1][1]:
            first = spans[-1][1]
        spans.append((first, last))
    return spans


def _find_lowest(speed: np.ndarray, high: int, lows: list[int]) -> int:
    """Find, on one side of `high`, the nearest lowest frame by which the part has slowed down.

    Args:
        speed: (T,) m/s of the part.
        high: the high frame.
        lows: frames of lowest height on that side, nearest first.
    Returns:
        The first low whose speed is at most _SLOW of the highest speed between; the farthest low if there is none.
    """
    for low in lows:
        between = speed[min(low, high) : max(low, high) + 1]
        if speed[low] <= _SLOW * between.max():
            return low
    return lows[-1]


def _is_hit(span: tuple[int, int], part: str, trajectory: PartTrajectory, body: PlayerBody,
            other: np.ndarray | None) -> bool:
    """Whether the part is faster than a step or an arm's swing at this speed of the body.

    Feet that walk reach 2.7 times the body's speed plus half a metre per second, in a run 2.1 times; recorded kicks
    more than 4 times. A striking foot is also faster than the supporting one (`other`, (T,) m/s): in a jump both are
    alike.
    """
    key = span[0] + int(np.argmax(trajectory.speed[span[0] : span[1] + 1]))
    if key in span or trajectory.speed[key] < _LEAST_SPEED.get(part, 1.0):
        return False
    if part in ("head", "chest"):
        return True
    if other is not None and trajectory.speed[key] - other[key] < 1.0:
        return False
    pace = body.speed[key]
    return trajectory.speed[key] > min(3.0 * (pace + 0.5), 2.3 * pace + 2.5)


def _build_hit_motion(part: str, side: str, span: tuple[int, int], trajectory: PartTrajectory, body: PlayerBody,
                      key: int | None = None) -> HitMotion:
    """Build the hit motion of a span of frames; `key` None: the fastest frame."""
    first, last = span
    key = first + int(np.argmax(trajectory.speed[first : last + 1])) if key is None else key
    high = _find_high(trajectory.height, first, key, last)
    fasts = _find_fastest(trajectory.speed, first, high), _find_fastest(trajectory.speed, high, last)
    frames = np.array([first, fasts[0], high, fasts[1], last])
    turns = body.facing[first : last + 1]
    facing = float(np.arctan2(np.sin(turns).mean(), np.cos(turns).mean()))
    turn = quaternion.from_up_angle(np.array(-facing))
    steps = np.diff(trajectory.place[frames] - body.pelvis[frames] * [1.0, 1.0, 0.0], axis=0)
    return HitMotion(part=part, side=side, first=first, last=last, high=high, fasts=fasts, key=key,
                     max_speed=float(trajectory.speed[list(fasts)].max()), vectors=quaternion.rotate(turn, steps),
                     times=np.diff(frames) / trajectory.fps, velocity=quaternion.rotate(turn, trajectory.velocity[key]),
                     facing=facing, size=body.size, fps=trajectory.fps)


def _find_high(height: np.ndarray, first: int, key: int, last: int) -> int:
    """Choose the high frame beside the key.

    It lies after the key where the part rises to it, and before the key where the part comes down, as a throwing arm
    does.
    """
    before = first + int(np.argmax(height[first : key + 1]))
    after = key + int(np.argmax(height[key : last + 1]))
    return after if height[after] > height[key] + _LEAST_RISE_AFTER or height[after] >= height[before] else before


def _find_fastest(speed: np.ndarray, first: int, last: int) -> int:
    """Find the fast frame between two frames; where speed only rises or falls there, the fastest frame."""
    inside = [first + 1 + frame for frame in _find_peaks(speed[first + 1 : last])]
    return max(inside or range(first, last + 1), key=lambda frame: speed[frame])


def _find_links(motions, count: int) -> tuple[tuple[int, int], ...]:
    """Find the (first, last) frames between hit motions, before the first and after the last one."""
    edges = [(-1, -1), *((one.first, one.last) for one in motions), (count, count)]
    found = [(a + 1, b - 1) for (_, a), (b, _) in zip(edges, edges[1:])]
    return tuple((first, last) for first, last in found if last > first)
