"""What a library's recordings show of the motion that players need, and what they lack: the one place that decides it.

Players spend more than half of their time below 2 m/s, standing, turning, stepping sideways and backward. Synthetic
clips (`synthetic_clips`, `missing_steps`) are made for exactly what is lacking here, and people read the same lines in
the panel, in the report of a library, and in the takes that need it.

Only frames that belong (`posture`) are counted, and recorded ones; mirrored twins give the other side.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..annotation import DISCRETE, LOCOMOTION
from ..base.time_series import find_runs, hann_smooth
from ..base.vectors import arctan2
from ..motion import quaternion
from ..motion.phase_blend import Strides, find_strides
from .features import Frames
from .loops.run_loops import MAX_MISMATCH, iter_steady_parts
from .loops.standing_loops import find_stands
from .posture import find_steady_travel, select_calm_postures

MAX_SPEED = 9.4  # m/s, a sprint
WARP = (0.875, 1.125)  # range of playback rates of a clip
SLOWEST_WALK = 1.6  # m/s: the slowest travel should not exceed it when it is played slower
MIN_SPEED_SECONDS = 1.5  # of recording at a speed from which on it is no gap
BACK_SPEEDS = (0.4, 0.8, 1.2, 1.6)  # m/s
# m/s, degrees from the heading to the left, and whether the feet cross
SIDE_WALKS = ((0.5, 90, False), (0.8, 90, False), (1.1, 90, True), (1.5, 90, True), (0.5, 45, False), (0.9, 45, False),
              (1.3, 45, False), (0.5, 135, False), (0.9, 135, False), (1.3, 135, False))
TURNS = tuple(np.radians((45.0, 90.0, 135.0, 180.0)))
MOVES = ((0.3, 0.0), (-0.3, 0.0), (0.0, 0.25), (0.0, 0.45))  # m ahead and to the left
MIN_SECONDS = 15.0  # of recording at a speed in a direction from which on it does not lack
MIN_TURN_SECONDS = 6.0  # of recorded turns on the spot from which on they do not lack
MIN_MOVES = 3  # recorded moves from a stand to a stand from which on such moves do not lack
MIN_CALM_SECONDS = 1.5  # of steady travel from which on it is known what belongs
CALM_SPEED = 2.0  # m/s up to which people walk
_NEEDED_TURN_RATE = np.radians(20.0)  # rad/s at which a body needs a turn: without one the plan turns it slowly
STEP_SPEEDS = (0.4, 2.0)  # m/s of steps in another direction than ahead
_TURN_SPEED = 0.5  # m/s of a body that turns in place
_SLOWEST_SPEED = 0.6  # m/s; what is slower is a stand with steps
_GRID = 1.03  # ratio of neighbouring speeds
_SPEED_RANGE, _DIRECTION_RANGE = (0.8, 1.25), np.radians(22.5)  # around a speed and a direction
_RESTING_SPEED, _RESTING_TURN, _MOST_MOVE_SECONDS = 0.15, np.radians(20.0), 3.0  # m/s, rad/s and s
_MOVE_RANGE, _MOST_TURN_OF_MOVE = 0.12, np.radians(22.5)  # m and rad around a move
_ON_THE_SPOT, _LEAST_TURN_RATE, _MOST_TURN_RATE = 0.3, np.radians(60.0), np.radians(250.0)  # m/s and rad/s
_STRANGE_SECONDS = 0.3  # reach of the window in which strangeness is averaged
# of walks whose trunk, arms and legs are used: m/s, the best one, s, and how many
_WALK_SPEEDS, _USUAL_SPEED, _MIN_WALK_SECONDS, _WALKS = (0.7, 1.9), 1.2, 1.5, 3
_SIDEWAYS = 0.7  # share of the speed
_RATE_SECONDS = 0.3  # over which a heading's rate is measured
_LACKS = {
    "belonging": ("nothing recorded surely belongs to calm standing or walking, upright with arms hanging",
                  "add a straight walk at one speed and a stand at ease"),
    "stands": ("no calm standing", "add four seconds of it"),
    "turns": ("hardly any turns in place", "add some"),
    "moves": ("hardly any single steps from a stand to a stand", "add some"),
    "speeds": ("hardly any locomotion", "add some"),
    "sideways": ("hardly any steps sideways or diagonally", "add some"),
    "backward": ("hardly any steps backward", "add some"),
}


@dataclass(frozen=True, kw_only=True)
class Coverage:
    """What recordings lack.

    Attributes:
        has_calm: whether frames are known to belong to calm standing or walking.
        has_stand, has_walk: whether there is a calm stand, and a calm walk whose strides can be repeated.
        speed_gaps: (from, to) m/s that locomotion does not reach.
        back_speeds: m/s, of BACK_SPEEDS.
        side_walks: of SIDE_WALKS.
        turns: rad, of TURNS.
        moves: m ahead and to the left, of MOVES.
    """

    has_calm: bool
    has_stand: bool
    has_walk: bool
    speed_gaps: tuple[tuple[float, float], ...]
    back_speeds: tuple[float, ...]
    side_walks: tuple[tuple[float, int, bool], ...]
    turns: tuple[float, ...]
    moves: tuple[tuple[float, float], ...]

    @property
    def lines(self) -> dict[str, str]:
        """Kind of motion that is lacking -> a line that says what to add and what is shown until then."""
        stepped = "synthetic ones are shown" if self.has_stand else "steps of other clips are shown"
        walked = "synthetic ones are shown" if self.has_walk else "steps of other clips are shown"
        backed = "walks are played backward" if self.has_walk else "steps of other clips are shown"
        instead = {
            "belonging": "players move as these recordings do", "stands": "a synthetic stand is shown",
            "turns": stepped, "moves": stepped, "speeds": "blended or synthetic ones are shown", "sideways": walked,
            "backward": backed,
        }
        return {kind: self.describe_lack(kind, text) for kind, text in instead.items() if self.lacks(kind)}

    def lacks(self, kind: str) -> bool:
        """Whether recordings lack a kind of motion, of `lines`."""
        return bool({
            "belonging": not self.has_calm, "stands": not self.has_stand, "turns": self.turns, "moves": self.moves,
            "speeds": self.speed_gaps, "sideways": self.side_walks, "backward": self.back_speeds,
        }[kind])

    @property
    def slowest_speed(self) -> float:
        """The m/s below which no locomotion is recorded that could be played so slowly; 0 where walks reach all."""
        low, high = self.speed_gaps[0] if self.speed_gaps else (np.inf, 0.0)
        return high if low <= _SLOWEST_SPEED * _GRID else 0.0

    def describe_lack(self, kind: str, instead: str) -> str:
        """Describe in a line what of a kind is lacking, what to add, and what is shown `instead`."""
        ranges = {
            "speeds": self.speed_gaps, "sideways": _span([walk[0] for walk in self.side_walks]),
            "backward": _span(self.back_speeds),
        }.get(kind)
        return describe_lack(kind, instead, format_speeds(ranges) if ranges else None)


def describe_lack(kind: str, instead: str, speeds: str | None = None) -> str:
    """Describe in a line what a library lacks.

    Args:
        kind: of motion.
        instead: what is shown instead.
        speeds: at which it is lacking; None for the one that is shown.
    """
    what, remedy = _LACKS[kind]
    at = f" at {speeds or 'this speed'}" if kind in ("speeds", "sideways", "backward") else ""
    return f"{what}{at}: {remedy}; until then {instead}"


def _span(speeds: Sequence[float]) -> tuple[tuple[float, float], ...]:
    return ((min(speeds), max(speeds)),) if speeds else ()


def format_speeds(ranges: Sequence[tuple[float, float]]) -> str:
    """Format ranges of speeds, from and to m/s, such as "1.5 to 2.9 and 3.8 m/s"."""
    return " and ".join(map(_format_range, ranges)) + " m/s"


def _format_range(ends: tuple[float, float]) -> str:
    low, high = (f"{end:.1f}" for end in ends)
    return low if low == high else f"{low} to {high}"


def measure_coverage(clips: Sequence, frames: Frames, fps: float, strangeness: np.ndarray) -> Coverage:
    """Measure what a library lacks.

    Args:
        clips: of the library.
        frames: their description, N frames.
        fps: of the frames.
        strangeness: (N,) how far each frame lies from normal locomotion (`posture`).
    """
    belongs = select_calm_frames(clips, frames, fps, strangeness)
    stands = find_stands(clips, frames, fps, strangeness)
    moves = measure_moves(clips, frames, fps, belongs)

    def is_rare(speed: float, degrees: float) -> bool:
        return count_seconds(frames, fps, belongs, speed, np.radians(degrees)) < MIN_SECONDS

    return Coverage(
        has_calm=_has_calm_postures(frames, fps, belongs, stands), has_stand=bool(stands),
        has_walk=next(_iter_calm_walks(clips, frames, fps, belongs), None) is not None,
        speed_gaps=find_speed_gaps(frames.speed[select_locomotion(frames, clips)], fps),
        back_speeds=tuple(speed for speed in BACK_SPEEDS if is_rare(speed, 180.0)),
        side_walks=tuple(walk for walk in SIDE_WALKS if is_rare(*walk[:2])),
        turns=TURNS if _count_turn_seconds(frames, fps, belongs) < MIN_TURN_SECONDS else (),
        moves=tuple(move for move in MOVES if _count_moves(moves, move) < MIN_MOVES),
    )


def _select_recorded(clips: Sequence, frames: Frames) -> np.ndarray:
    """Select the frames (N,) bool of recordings, twins left out, that show no action."""
    actions = [i for i, word in enumerate(frames.vocabulary) if word in DISCRETE]
    own = np.array([not clip.mirrored and not clip.is_synthetic for clip in clips])
    return own[frames.clip] & ~frames.words[:, actions].any(axis=1)


def select_locomotion(frames: Frames, clips: Sequence) -> np.ndarray:
    """Select the frames (N,) bool of recordings, twins left out, that show locomotion and no action."""
    gaits = [i for i, word in enumerate(frames.vocabulary) if word in LOCOMOTION[1:]]
    return _select_recorded(clips, frames) & frames.words[:, gaits].any(axis=1)


def select_calm_frames(clips: Sequence, frames: Frames, fps: float, strangeness: np.ndarray) -> np.ndarray:
    """Select the frames (N,) bool of recordings, twins left out, that belong to locomotion and show no action.

    What counts is the strangeness around a frame: at the ends of a swing a usual walk is strange for a moment.
    """
    parts = [slice(first, first + count) for first, count in zip(frames.first, frames.count)]
    around = [hann_smooth(strangeness[at], int(_STRANGE_SECONDS * fps)) for at in parts]
    return _select_recorded(clips, frames) & (np.concatenate(around) <= 1.0)


def _has_calm_postures(frames: Frames, fps: float, belongs: np.ndarray, stands: list[tuple[int, int, int]]) -> bool:
    """Whether frames `belongs` (N,) bool are known to be calm.

    What belongs is learned from the library itself: where all box, a guard is normal. So some steady travel is needed,
    and where people are slow, a stand or a steady walk in a posture that is calm for anybody.
    """
    steady, is_slow = belongs & find_steady_travel(frames, fps), belongs & (frames.speed < CALM_SPEED)
    calm, least = select_calm_postures(frames.posture), MIN_CALM_SECONDS * fps
    is_shown = np.sum(steady & is_slow & calm) >= least or any(np.mean(calm[a:b]) > 0.5 for _, a, b in stands)
    return bool(steady.sum() >= least and (is_shown or is_slow.sum() < least))


def find_speed_gaps(speed: np.ndarray, fps: float) -> tuple[tuple[float, float], ...]:
    """Find the ranges of speed that too few seconds of recorded locomotion reach within the time warp.

    Args:
        speed: (N,) m/s of frames of locomotion.
        fps: of those frames.
    Returns:
        (from, to) m/s of all gaps, from the slowest recording's speed, if that is a walk, to a sprint; one from a slow
        walk to a sprint where no speed is reached.
    """
    grid = np.exp(np.arange(np.log(_SLOWEST_SPEED), np.log(MAX_SPEED), np.log(_GRID)))
    ordered = np.sort(speed)
    reached = np.searchsorted(ordered, grid / WARP[0]) - np.searchsorted(ordered, grid / WARP[1])
    lacking = reached < MIN_SPEED_SECONDS * fps
    slowest = int(np.argmin(lacking))  # 0 where all is lacking
    lacking[:slowest] = grid[slowest] > SLOWEST_WALK
    ends = np.append(grid, MAX_SPEED)
    return tuple((float(grid[a]), float(ends[b])) for a, b in find_runs(lacking))


def count_seconds(frames: Frames, fps: float, belongs: np.ndarray, speed: float, direction: float) -> float:
    """Count the seconds of frames `belongs` (N,) at about a speed in m/s and in a direction, rad, to either side."""
    off = np.abs(arctan2(frames.velocity[:, 1], frames.velocity[:, 0])) - direction
    low, high = (speed * share for share in _SPEED_RANGE)
    near = (np.abs(off) < _DIRECTION_RANGE) & (frames.speed > low) & (frames.speed < high)
    return float(np.sum(belongs & near) / fps)


def find_calm_walks(clips: Sequence, frames: Frames, fps: float, belongs: np.ndarray) -> list[Strides]:
    """Find steady walks of `belongs` (N,) bool that can be repeated, the most usual first, at most one of each clip."""
    found = [(abs(np.log(part.speed / _USUAL_SPEED)) + mismatch / MAX_MISMATCH, index, part)
             for index, mismatch, part in _iter_calm_walks(clips, frames, fps, belongs)]
    return [strides for *_, strides in sorted(found, key=lambda one: one[:2])[:_WALKS]]


def _iter_calm_walks(clips: Sequence, frames: Frames, fps: float,
                     belongs: np.ndarray) -> Iterator[tuple[int, float, Strides]]:
    """Iterate over the steadiest part of each clip's longest calm walk: clip, how badly its ends fit, m, and it."""
    ahead = np.abs(arctan2(frames.velocity[:, 1], frames.velocity[:, 0])) < _DIRECTION_RANGE
    speed = frames.speed  # computed over all frames at every access
    walks = belongs & ahead & (speed > _WALK_SPEEDS[0]) & (speed < _WALK_SPEEDS[1])
    for index, clip in enumerate(clips):
        at = slice(frames.first[index], frames.first[index] + frames.count[index])
        runs = [run for run in find_runs(walks[at]) if run[1] - run[0] >= _MIN_WALK_SECONDS * fps]
        for first, end in sorted(runs, key=lambda run: run[0] - run[1])[:1]:
            rows = slice(int(frames.source[at.start + first]), int(frames.source[at.start + end - 1]) + 1)
            strides = find_strides(clip.motion.frames(rows.start, rows.stop), clip.heel_toe_contacts[rows])
            parts = [] if strides is None else [one for one in iter_steady_parts(strides) if one[0] < MAX_MISMATCH]
            if parts:
                yield (index, *min(parts, key=lambda one: one[0]))


def measure_moves(clips: Sequence, frames: Frames, fps: float, belongs: np.ndarray) -> np.ndarray:
    """Measure recorded moves from a stand to a stand: (M, 3) m ahead, m to the left, and rad of turning."""
    moves, speed = [], frames.speed  # computed over all frames at every access
    for index in range(len(clips)):
        at = slice(frames.first[index], frames.first[index] + frames.count[index])
        turning = np.abs(np.gradient(frames.heading[at])) * fps if frames.count[index] > 1 else np.zeros(1)
        rests = (speed[at] < _RESTING_SPEED) & (turning < _RESTING_TURN)
        for first, end in find_runs(~rests):
            inside = 0 < first and end < frames.count[index] and end - first <= _MOST_MOVE_SECONDS * fps
            if inside and np.all(belongs[at][first:end]):
                ends = at.start + np.array([first - 1, end])
                way = quaternion.rotate_level(np.diff(frames.path[ends], axis=0), -frames.heading[ends[:1]])[0]
                moves.append((*way, frames.heading[ends[1]] - frames.heading[ends[0]]))
    return np.array(moves).reshape(-1, 3)


def _count_turn_seconds(frames: Frames, fps: float, belongs: np.ndarray) -> float:
    """Count the seconds of turns on the spot of frames `belongs` (N,)."""
    turning = np.abs(np.gradient(frames.heading)) * fps
    same_clip = (np.gradient(frames.clip) == 0.0) & (turning < _MOST_TURN_RATE)
    return float(np.sum(belongs & same_clip & (frames.speed < _ON_THE_SPOT) & (turning > _LEAST_TURN_RATE)) / fps)


def _count_moves(recorded: np.ndarray, move: tuple[float, float]) -> int:
    """Count the `recorded` moves (M, 3) that go m ahead and to either side as `move` does."""
    off = np.linalg.norm(np.stack([recorded[:, 0], np.abs(recorded[:, 1])], axis=1) - move, axis=1)
    return int(np.sum((off < _MOVE_RANGE) & (np.abs(recorded[:, 2]) < _MOST_TURN_OF_MOVE)))


def compute_turn_rate(heading: np.ndarray, fps: float) -> np.ndarray:
    """Compute how fast (T,) rad/s an unwrapped heading (T,) rad changes, over a third of a second."""
    half = max(1, round(0.5 * _RATE_SECONDS * fps))
    padded = np.pad(heading, half, mode="edge")
    return (padded[2 * half :] - padded[: -2 * half]) * fps / (2 * half)


def classify_steps(velocity: np.ndarray, turn_rate: np.ndarray) -> dict[str, np.ndarray]:
    """Classify frames by the kinds of motion that libraries often lack.

    Args:
        velocity: (T, 2) m/s in the body's heading frame, x forward.
        turn_rate: (T,) rad/s of the heading.
    Returns:
        "turns", "sideways" and "backward" -> (T,) bool.
    """
    speed = np.linalg.norm(velocity, axis=1)
    is_slow = (speed > STEP_SPEEDS[0]) & (speed < STEP_SPEEDS[1])
    return {
        "turns": (np.abs(turn_rate) > _NEEDED_TURN_RATE) & (speed < _TURN_SPEED),
        "sideways": is_slow & (np.abs(velocity[:, 1]) > _SIDEWAYS * speed),
        "backward": is_slow & (-velocity[:, 0] > _SIDEWAYS * speed),
    }
