"""Solve touches, trajectory and ball exits from samples; `solve_ball` does it for a match or one player's track.

1. `samples`: what the feed filled in, which samples are wrong, how much the rest scatters. 2. `pieces`: all places
where the trajectory may change. 3. `touches`: which of them are touches, in one search that weighs the change of
velocity against the players nearby; then one chain of players. 4. `kinds`: what each touch was, and where the ball left
the pitch.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...base.errors import InputError, UserCancelledError
from ...base.time_series import interpolate_columns
from ...base.vectors import measure_lengths
from ...motion.skeleton import freeze_array
from ...motion.track import BALL_RADIUS, Track
from ...motion.track.match_data import REFEREE, Match
from . import kinds, pieces, touches
from .flights import replace_by_flights
from .kinds import BallEnd, find_ball_ends
from .samples import Samples, build_samples
from .trajectory import BallPiece, SolvedTrajectory

PITCH = (105.0, 68.0)  # m, the standard pitch
_MAX_GAP = 1.5  # s without a sample: a longer gap is not solved
_SHORTEST, _FEWEST = 0.3, 5  # s, samples: shorter stretches are left out
_CORRELATED_SECONDS = 0.06  # s in which errors of samples correlate: they count as one sample
_STEP = 0.04  # s between the knots of a trajectory
_BLEND = 0.2  # s over which a trajectory is bent to the position of a touch
_RESTART = 60.0  # s within which a ball over the touch line is thrown in
_CONFIDENCE_SCALE = 4.0  # nats: margins below this mean doubt, since the costs are only typical for feeds
_MAX_SINK_SPEED = 4.0  # m/s downward, at most, after a touch that stops the ball; feeds let heights drop at once
_REPORTED_FILLED_SHARE = 0.05  # share of filled samples from which it is reported
_FULL_TRACKING = 14  # tracked players: with so many, a touch by none of them is an error of the feed
_MIN_HEIGHT_SHARE = 0.8  # share of samples with a height from which heights are used


@dataclass(frozen=True, eq=False, kw_only=True)
class SolvedTouch:
    """A touch: a player changed the ball's trajectory.

    Attributes:
        time: s.
        uncertainty: s, standard deviation of the time.
        player: id, "" if no tracked player was near.
        part: "foot", "head", "chest" or "hand".
        kind: one of `kinds.KINDS`.
        position: (3,) m of the ball's centre.
        before: (3,) m/s of the ball before the touch.
        after: (3,) m/s after it.
        confidence: 0 to 1, that there was a touch and that it was this player's.
    """

    time: float
    uncertainty: float
    player: str
    part: str
    kind: str
    position: np.ndarray
    before: np.ndarray
    after: np.ndarray
    confidence: float

    def __post_init__(self):
        for name in ("position", "before", "after"):
            object.__setattr__(self, name, freeze_array(getattr(self, name)))


@dataclass(frozen=True, eq=False, kw_only=True)
class SolvedBall:
    """The solution for N samples.

    Attributes:
        times: (N,) s of the samples.
        touches: in order of time.
        ball: the trajectory with its pieces.
        filled: (N,) bool, filled in by the feed.
        outlier: (N,) bool, wrong samples.
        measured: (N,) bool, used and not filled in.
        residuals: (N,) m, horizontal, from each sample to the trajectory, NaN where unknown.
        ends: where the ball left the pitch.
        confidence: 0 to 1, the mean of the touches.
        notes: messages for people.
    """

    times: np.ndarray
    touches: tuple[SolvedTouch, ...]
    ball: SolvedTrajectory
    filled: np.ndarray
    outlier: np.ndarray
    measured: np.ndarray
    residuals: np.ndarray
    ends: tuple[BallEnd, ...]
    confidence: float
    notes: tuple[str, ...] = ()

    @property
    def pieces(self) -> tuple[BallPiece, ...]:
        """The pieces of the trajectory."""
        return self.ball.pieces

def solve_samples(times: np.ndarray, ball: np.ndarray, positions: np.ndarray, players: Sequence[str],
                  teams: Sequence[str] = (), pitch: tuple[float, float] = PITCH, where: str = "ball",
                  progress: Callable[[float, str], None] | None = None, cancelled: Callable[[], bool]
                  | None = None, only_own_flights: bool = False) -> SolvedBall:
    """Solve the ball of a feed.

    Args:
        times: (N,) s.
        ball: (N, 3) m, NaN where unknown.
        positions: (P, N, 2) m of the players, NaN where absent.
        players: (P,) ids.
        teams: (P,) names, () if unknown.
        pitch: length and width m.
        where: the feed's name, for messages.
        progress: receives the share done and the step.
        cancelled: called between steps; True cancels the work.
        only_own_flights: whether flights are fitted only from and to touches of `players`, which is sooner done.
    Returns:
        Touches, trajectory and exits.
    Raises:
        InputError: if the ball has fewer than five samples, or never so many without a long gap.
        UserCancelledError: if `cancelled` returns True.
    """
    samples = build_samples(times, ball, where)
    unique_times, first = np.unique(np.asarray(times, float), return_index=True)
    positions = np.asarray(positions, float)[:, first[np.searchsorted(unique_times, samples.times)]]
    untracked_cost = touches.UNTRACKED_COST if len(players) > 1 else touches.SINGLE_UNTRACKED_COST
    windows = _find_windows(samples, where)
    found = []
    for number, window in enumerate(windows):
        if cancelled is not None and cancelled():
            raise UserCancelledError("solving the ball: cancelled")
        if progress is not None:
            progress(0.6 * number / len(windows), "touches")
        found.append(_solve_window(samples, window, positions, untracked_cost))
    solved, speeds = _label_touches(samples, found, positions, players=players, teams=teams, pitch=pitch,
                                    untracked_cost=untracked_cost)
    curves = [piece for window, cuts in zip(windows, found) for piece in _build_pieces(samples, window, cuts)]
    if progress is not None:
        progress(0.6, "flights")
    moments = np.array([touch.time for touch in solved])
    heights = _has_heights(samples)
    ends = np.array([touch.time for touch in solved if touch.player]) if only_own_flights else None
    path = SolvedTrajectory(tuple(replace_by_flights(samples, curves, moments, heights, cancelled=cancelled,
                                                     ends=ends)))
    solved = [_update_touch(touch, path, heights) for touch in solved]
    ends = find_ball_ends(samples.times, path.at(samples.times), *pitch)
    solved = _label_throw_ins(solved, ends, speeds, pitch)
    residuals = np.where(samples.known, path.residuals(samples.times, samples.positions), np.nan)
    confidence = float(np.mean([touch.confidence for touch in solved])) if solved else 0.0
    return SolvedBall(times=samples.times, touches=tuple(solved), ball=path, filled=samples.filled,
                      outlier=samples.outlier, measured=freeze_array(samples.is_measured, bool),
                      residuals=freeze_array(residuals), ends=tuple(_add_last_player(end, solved) for end in ends),
                      confidence=confidence, notes=_describe_feed(samples, heights))


def _find_windows(samples: Samples, where: str) -> list[slice]:
    """Find the stretches in which the ball is known, with gaps of up to _MAX_GAP; at least one."""
    there = np.flatnonzero(samples.is_used)
    breaks = np.flatnonzero(np.diff(samples.times[there]) > _MAX_GAP)
    firsts, lasts = [there[0], *there[breaks + 1]], [*there[breaks], there[-1]]
    spans = [slice(int(first), int(last) + 1) for first, last in zip(firsts, lasts)]
    spans = [span for span in spans if span.stop - span.start >= _FEWEST]
    if not spans:
        found = f"the ball's samples are mostly more than {_MAX_GAP:g} s apart"
        raise InputError(where, found, "at least five closer together", "choose a feed that has the ball more often")
    long_spans = [span for span in spans if samples.times[span.stop - 1] - samples.times[span.start] >= _SHORTEST]
    return long_spans or spans[:1]


def _bridge_gaps(samples: Samples, window: slice) -> np.ndarray:
    """Bridge gaps and wrong samples of a window: (n, 2 or 3) m, with heights if the feed has them."""
    points, used = samples.positions[window], samples.is_used[window]
    heights = np.isfinite(points[:, 2])
    axes = 3 if np.count_nonzero(heights & used) > _MIN_HEIGHT_SHARE * np.count_nonzero(used) else 2
    there = np.flatnonzero(used & heights) if axes == 3 else np.flatnonzero(used)
    every = np.arange(len(points))
    return interpolate_columns(every, there, points[there, :axes])


def _solve_window(samples: Samples, window: slice, positions: np.ndarray, untracked_cost: float) -> touches.Cuts:
    times, points = samples.times[window], _bridge_gaps(samples, window)
    weights = samples.is_used[window] / samples.scatter[window] ** 2 * min(1.0, samples.interval / _CORRELATED_SECONDS)
    places = pieces.find_candidate_cuts(times, points, samples.is_used[window], samples.interval)
    chosen = pieces.choose_cuts(times, points, weights, places)
    cost = _compute_reach_cost(times, points, positions[:, window], chosen, untracked_cost)
    return touches.solve_cuts(times, points, weights, chosen, cost)


def _compute_reach_cost(times, points, positions, cuts, untracked_cost) -> np.ndarray:
    """Compute the nats (C,) of the nearest player touching the ball between the samples before and after each cut."""
    costs = []
    for near in (cuts - 1, cuts):
        index = np.clip(near, 0, len(times) - 1)
        away = touches.measure_player_distances(times, points[index, :2], positions, times[index]).min(axis=0,
                initial=np.inf)
        costs.append(touches.compute_reach_cost(away, points[index, 2] if points.shape[1] == 3 else None,
                                                untracked_cost))
    return np.minimum(*costs)


def _build_pieces(samples: Samples, window: slice, cuts: touches.Cuts) -> list[BallPiece]:
    """Build the trajectory of one window; the ends of pieces are bent to the positions of the cuts."""
    times = samples.times[window]
    edges = np.concatenate([[times[0]], cuts.time, [times[-1]]])
    edges = np.maximum.accumulate(edges)
    long_enough = np.flatnonzero(np.diff(edges) >= 1e-6)
    if not len(long_enough):
        return []
    knots = [_place_knots(edges[index], edges[index + 1]) for index in long_enough]
    which, every = np.repeat(long_enough, [len(at) for at in knots]), np.concatenate(knots)
    bounds = np.cumsum([len(at) for at in knots])[:-1]
    curves = (np.split(values, bounds) for values in (cuts.pieces.position(every, which),
                                                      cuts.pieces.velocity(every, which)))
    out = []
    for index, at, places, speeds in zip(long_enough.tolist(), knots, *curves):
        start, end = edges[index], edges[index + 1]
        # At the start (cut index - 1) and at the end (cut index) add a shift that falls quadratically to zero.
        for edge, place, slope_sign in ((index - 1, 0, -2.0), (index, -1, 2.0)):
            if 0 <= edge < len(cuts.time):
                miss, over = cuts.place[edge] - places[place], min(_BLEND, end - start)
                near = np.maximum(0.0, 1.0 - np.abs(at - at[place]) / over)[:, None]
                places, speeds = places + near**2 * miss, speeds + slope_sign / over * near * miss
        out.append(_build_piece(samples, at, *_add_heights(places, speeds)))
    return out


def _place_knots(start: float, end: float) -> np.ndarray:
    """Place the knots (n,) s of a piece, at most _STEP apart."""
    return np.linspace(start, end, max(2, int(np.ceil((end - start) / _STEP)) + 1))


def _add_heights(places: np.ndarray, speeds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Add heights: three coordinates, the ball's centre never below its radius."""
    if places.shape[1] == 2:
        places = np.pad(places, ((0, 0), (0, 1)), constant_values=BALL_RADIUS)
        return places, np.pad(speeds, ((0, 0), (0, 1)))
    low = places[:, 2] < BALL_RADIUS
    places = np.where(low[:, None] * [False, False, True], BALL_RADIUS, places)
    return places, np.where(low[:, None] * [False, False, True], 0.0, speeds)


def _build_piece(samples: Samples, at: np.ndarray, places: np.ndarray, speeds: np.ndarray) -> BallPiece:
    """Build one piece with its kind and its residual to the measured samples."""
    part = slice(*np.searchsorted(samples.times, [at[0], at[-1]]))
    seen = samples.is_measured[part]
    piece = BallPiece(times=at, positions=places, velocities=speeds, kind="", spin=np.zeros(3), residual=np.nan,
                      bounces=np.zeros(0))
    off = SolvedTrajectory((piece,)).residuals(samples.times[part], samples.positions[part])[seen]
    fast, high = np.linalg.norm(speeds[:, :2], axis=1).max(), places[:, 2].max()
    kind = "flight" if high > 0.5 else "still" if fast < 0.3 else "roll"
    residual = float(np.sqrt(np.mean(off**2))) if len(off) else np.nan
    return replace(piece, kind=kind, residual=residual)


def _label_touches(samples, found, positions, players, teams, pitch, untracked_cost) -> tuple[list[SolvedTouch],
        list[float]]:
    """Label the touches with their players, parts and kinds; returns the players' speeds in m/s too."""
    fields = ("time", "spread", "margin", "place", "before", "after")
    rows = [tuple(_pad_to_three(getattr(cuts, name)[cuts.touch]) for name in fields) for cuts in found]
    columns = [np.concatenate(column) for column in zip(*rows)]
    order = np.argsort(columns[0], kind="stable")
    time, spread, margin, place, before, after = (column[order] for column in columns)
    if not len(time):
        return [], []
    away = touches.measure_player_distances(samples.times, place[:, :2], positions, time)
    chosen = touches.choose_players(away, time, _measure_mean_distance(samples, positions, time), untracked_cost)
    all_tracked, known_height = np.isfinite(away).sum(axis=0) >= _FULL_TRACKING, _has_heights(samples)
    is_in_reach = ~(place[:, 2] > touches.OUT_OF_REACH) if known_height else np.ones(len(time), bool)
    kept = np.flatnonzero(((chosen >= 0) | ~all_tracked) & is_in_reach)
    time, spread, margin, place = time[kept], spread[kept], margin[kept], place[kept]
    before, after, away, chosen = before[kept], after[kept], away[:, kept], chosen[kept]
    goals = find_goal_lines(positions, teams, pitch[0])
    known = [np.flatnonzero(np.isfinite(path[:, 0])) for path in positions]
    out, speeds = [], []
    for k in range(len(time)):
        player = int(chosen[k])
        moving = _estimate_player_velocity(samples, positions, known, player, time=time[k])
        speeds.append(float(measure_lengths(moving)))
        part = kinds.choose_part(place[k, 2] if known_height else None)
        same_next = k + 1 < len(time) and chosen[k + 1] == player and time[k + 1] - time[k] < 3.0
        same_before = k > 0 and chosen[k - 1] == player and time[k] - time[k - 1] < 3.0
        kind = kinds.choose_touch_kind(part, before[k] - moving, after[k] - moving, same_next, same_before)
        since = time[k] - time[k - 1] if k else np.inf
        if kinds.is_throw_in(place[k], before[k], after[k], since, speed=speeds[k], pitch=pitch):
            part, kind = "hand", kinds.THROW_IN
        elif player in goals:
            part, kind = kinds.choose_keeper_kind(place[k], before[k], goals[player], known_height) or (part, kind)
        confidence = _compute_confidence(margin[k], away[:, k], player)
        centre = np.array([place[k, 0], place[k, 1], kinds.limit_to_ground(place[k, 2])])
        name = players[player] if player >= 0 else ""
        out.append(SolvedTouch(time=float(time[k]), uncertainty=float(spread[k]), player=name, part=part, kind=kind,
                               position=centre, before=before[k], after=after[k], confidence=confidence))
    return out, speeds


def _describe_feed(samples: Samples, heights: bool) -> tuple[str, ...]:
    """Describe what people should know about the feed."""
    filled, wrong = float(samples.filled.mean()), int(np.count_nonzero(samples.outlier))
    lines = ([f"{filled:.0%} of the ball's samples were filled in at constant velocity"]
             if filled > _REPORTED_FILLED_SHARE else [])
    lines += [f"{wrong} of the ball's samples {'is' if wrong == 1 else 'are'} wrong and ignored"] if wrong else []
    lines += [] if heights else ["the feed has no ball heights: estimates are good to a metre or two at best"]
    return tuple(lines)


def find_goal_lines(positions: np.ndarray, teams: Sequence[str], length: float) -> dict[int, float]:
    """Find the goalkeepers and their goal lines in a part of a match.

    Args:
        positions: (P, N, 2) m of the players, NaN where absent.
        teams: (P,) names.
        length: m of the pitch.
    Returns:
        Index of each goalkeeper -> x m of their goal line; none for a team where that is not clear.
    """
    found = kinds.find_keepers(positions, list(teams)) if len(teams) == len(positions) else {}
    places = {keeper: np.nanmedian(positions[keeper, :, 0]) for keeper in found.values()}
    return {keeper: float(np.sign(x)) * length / 2.0 for keeper, x in places.items() if abs(x) > length / 5.0}


def _label_throw_ins(solved: list[SolvedTouch], ends: list[BallEnd], speeds: Sequence[float],
                     pitch: tuple[float, float]) -> list[SolvedTouch]:
    """Label throw-ins: the first touch from the touch line after each ball over it; speeds (K,) m/s of the players."""
    out = list(solved)
    for end in ends:
        later = [k for k, touch in enumerate(solved) if end.time < touch.time < end.time + _RESTART]
        takes = (k for k in later if out[k].position[1] * end.y > 0.0)
        first = next((k for k in takes if kinds.is_from_touch_line(out[k].position, out[k].after, speeds[k],
                                                                   pitch)), None)
        if end.kind == "touch line" and first is not None:
            out[first] = replace(out[first], part="hand", kind=kinds.THROW_IN)
    return out


def _has_heights(samples: Samples) -> bool:
    return bool(np.isfinite(samples.positions[samples.is_used, 2]).mean() > _MIN_HEIGHT_SHARE)


def _update_touch(touch: SolvedTouch, path: SolvedTrajectory, heights: bool) -> SolvedTouch:
    """Update a touch with the trajectory's velocities just before and after it.

    Where the feed has no heights, also with the height and body part that the arriving flight implies.
    """
    before, after = path.velocity(np.array([touch.time - 1e-4, touch.time + 1e-4]))
    if touch.kind in (kinds.RECEIVE, kinds.DRIBBLE, kinds.CHEST_CONTROL):
        after = np.array([after[0], after[1], max(after[2], -_MAX_SINK_SPEED)])
    if heights or touch.part == "hand":
        return replace(touch, before=before, after=after)
    height = float(path.at(np.array([touch.time]))[0, 2])
    part = kinds.choose_part(height)
    kind = {"head": kinds.HEADER, "chest": kinds.CHEST_CONTROL}.get(part, touch.kind)
    position = np.array([*touch.position[:2], kinds.limit_to_ground(height)])
    return replace(touch, before=before, after=after, position=position, part=part, kind=kind)


def _pad_to_three(values: np.ndarray) -> np.ndarray:
    """Pad rows of two coordinates with a zero third."""
    return np.pad(values, ((0, 0), (0, 1))) if values.ndim == 2 and values.shape[1] == 2 else values


def _measure_mean_distance(samples: Samples, positions: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Measure each player's mean distance (P, K) m from the ball since the previous touch."""
    ball = samples.positions[:, :2]
    away = np.linalg.norm(positions - ball, axis=2)
    seen = np.isfinite(away)
    total = np.pad(np.cumsum(np.where(seen, away, 0.0), axis=1), ((0, 0), (1, 0)))
    count = np.pad(np.cumsum(seen, axis=1), ((0, 0), (1, 0)))
    at = np.searchsorted(samples.times, time)
    # Differences of the cumulative sums give the mean between two touches.
    before = np.concatenate([[0], at[:-1]])
    return (total[:, at] - total[:, before]) / np.maximum(count[:, at] - count[:, before], 1)


def _estimate_player_velocity(samples: Samples, positions: np.ndarray, known: Sequence[np.ndarray], player: int,
                              time: float) -> np.ndarray:
    """Estimate a player's velocity (3,) m/s around `time`; zero if the player is not known then.

    known: for each player, the samples in which they are.
    """
    if player < 0:
        return np.zeros(3)
    ends = np.array([time - 0.2, time + 0.2])
    path, there = positions[player], known[player]
    if len(there) < 2:
        return np.zeros(3)
    first, last = np.searchsorted(there, np.searchsorted(samples.times, ends))
    near = there[max(first - 2, 0) : last + 2]  # with a sample beyond either end
    place = [np.interp(ends, samples.times[near], path[near, axis]) for axis in range(2)]
    return np.array([*((p[1] - p[0]) / 0.4 for p in place), 0.0])


def _compute_confidence(margin: float, away: np.ndarray, player: int) -> float:
    """Compute the confidence, 0 to 1: that it was a touch, times that it was this player's."""
    touch = 1.0 / (1.0 + np.exp(-margin / _CONFIDENCE_SCALE))
    if player < 0:
        return float(0.5 * touch)
    likelihood = np.exp(-touches.compute_reach_cost(away, None) - away / touches.REACH_DEVIATION)
    return float(touch * likelihood[player] / max(likelihood.sum(), 1e-12))


def _add_last_player(end: BallEnd, solved: list[SolvedTouch]) -> BallEnd:
    earlier = [touch.player for touch in solved if touch.time < end.time]
    return replace(end, player=earlier[-1] if earlier else "")


def solve_ball(source: Match | Track, progress: Callable[[float, str], None] | None = None,
               cancelled: Callable[[], bool] | None = None, start: float | None = None,
               end: float | None = None, only_own_flights: bool = False) -> SolvedBall:
    """Solve the ball of a match or of one player's track, whole or from `start` to `end`.

    A track has one player: touches by others have the player "". Referees do not touch the ball.

    Args:
        source: the match or track.
        progress: receives the share done and the step.
        cancelled: called between steps; True cancels the work.
        start: s. None: from the beginning.
        end: s. None: to the end.
        only_own_flights: of a track, whether only flights from and to its player are fitted, which is sooner done.
    Returns:
        Touches, trajectory and exits.
    Raises:
        InputError: if the source has no ball in that time.
        UserCancelledError: if `cancelled` returns True.
    """
    low, high = -np.inf if start is None else start, np.inf if end is None else end
    part = (source.times >= low) & (source.times <= high)
    if not part.any():
        span = f"{source.times[0]:g} to {source.times[-1]:g} s"
        raise InputError("times", f"no sample between {low:g} and {high:g} s", span)
    if isinstance(source, Track):
        unknown = ~source.ball_height_known[:, None] & [False, False, True]
        ball = np.where(unknown, np.nan, source.ball)
        return solve_samples(source.times[part], ball[part], source.positions[None, part], [source.name],
                             where=source.name, pitch=PITCH, progress=progress, cancelled=cancelled,
                             only_own_flights=only_own_flights)
    playing = [index for index, player in enumerate(source.players) if player.team != REFEREE]
    players = [source.players[index] for index in playing]
    return solve_samples(source.times[part], source.ball[part], source.positions[playing][:, part],
                         players=[player.id for player in players], teams=[player.team for player in players],
                         pitch=(source.length, source.width), where="the tracking data", progress=progress,
                         cancelled=cancelled)
