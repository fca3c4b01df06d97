"""Decide which cuts of the ball's trajectory are touches, and by whom, in one search over all of them.

Between two cuts lies a smooth piece. A cut is one of three things, each with a probability of what is observed there:
**touch**: a player is near enough, and the velocity changes by any amount; **free**: a bounce, the start of rolling, an
error of the feed: the ball slows a little and keeps its direction; **nothing**: the cut is left out, and one piece goes
through. The lowest cost wins. Costs are negative logarithms of probabilities (nats).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .pieces import PieceFits, fit_between

USUAL_CHANGE = 9.0  # m/s, mean change of velocity by a touch
TOUCH_COST, FREE_COST = 4.0, 3.5  # nats for a cut of either kind, in addition to what is observed there
_NEAR_COST = 1.0  # nats for a free change just where a player is
_LONGEST = 6.0  # s, the longest piece
_STEPS = 14  # most cuts one piece may leave out
_JOINT_DEVIATION = 0.12  # m, deviation between the ends of neighbouring pieces
_MAX_JUMP_COST = 8.0  # nats at most for such a gap: the feed lost the ball and found it elsewhere
_SKIP_SECONDS = 0.16  # s around a cut in which samples may be wrong: bodies hide the ball, feeds attach it to a player
_SKIP_COST = 40.0  # nats per second of samples left out for this
_SHORT_SECONDS, _SHORT_COST = 0.24, 6.0  # s, shorter pieces are unlikely; nats for a piece of no length

REACH = 0.6  # m from a player's centre within which a touch has no cost
REACH_DEVIATION = 0.45  # m, deviation beyond REACH by bodies and tracking
HIGHEST = 2.4  # m of the ball's centre, up to which a header has no cost
OUT_OF_REACH = 3.5  # m of the ball's centre: higher than a keeper's hands in a jump, with the noise of heights
UNTRACKED_COST = 9.0  # nats for a touch by no tracked player, in a match
SINGLE_UNTRACKED_COST = 4.0  # the same if only one player is tracked
_RISE = 0.3  # m, deviation of jumps and heights beyond HIGHEST
_PLAYER_CHANGE_COST = 1.0  # nats for a touch by another player than the previous one
_FOLLOW_SECONDS = 1.0  # s, a player with two touches within this stays near the ball


@dataclass(frozen=True, eq=False, kw_only=True)
class Cuts:
    """The C cuts that remain, in order, and the C + 1 pieces around them.

    Attributes:
        time: (C,) s, between two samples.
        spread: (C,) s, standard deviation of the time.
        touch: (C,) bool, True for a touch, False for a free change.
        margin: (C,) nats by which the other kind costs more.
        place: (C, D) m.
        before: (C, D) m/s before the cut.
        after: (C, D) m/s after it.
        pieces: the fitted pieces.
    """

    time: np.ndarray
    spread: np.ndarray
    touch: np.ndarray
    margin: np.ndarray
    place: np.ndarray
    before: np.ndarray
    after: np.ndarray
    pieces: PieceFits


def solve_cuts(times, points, weights, cuts, player_cost) -> Cuts:
    """Choose the most likely cuts by dynamic programming over pieces.

    Args:
        times: (N,) s.
        points: (N, D) m.
        weights: (N,) 1/m^2.
        cuts: ascending sample indices, the first 0 and the last N.
        player_cost: (len(cuts),) nats for the nearest player being the one who touches there.
    Returns:
        The cuts that remain, with their pieces.
    """
    pieces = fit_between(times, points, weights, cuts=cuts, longest=_LONGEST, steps=_STEPS)
    # begin, upto: number of the cut at which each piece starts and ends. Pieces are sorted by begin;
    # `ending` sorts them by upto. Pieces that start at cut c: by_begin[c] .. by_begin[c + 1], likewise by_end.
    begin = np.searchsorted(cuts, pieces.first)
    upto = np.searchsorted(cuts, pieces.last + 1)
    by_begin = np.searchsorted(begin, np.arange(len(cuts) + 1))
    ending = np.argsort(upto, kind="stable")
    by_end = np.searchsorted(upto[ending], np.arange(len(cuts) + 1))
    # After a cut, a piece may start up to _SKIP_SECONDS later, so that samples hidden at the touch are left out.
    reach = np.searchsorted(cuts, np.searchsorted(times, times[cuts[:-1]] + _SKIP_SECONDS), "left") - 1
    reach = np.clip(np.maximum(reach, np.arange(len(cuts) - 1)), 0, len(cuts) - 2)
    outof = [(by_begin[cut], by_begin[reach[cut] + 1]) for cut in range(len(cuts) - 1)]
    left, right = _build_pairs(ending, by_end, outof)
    knot = _estimate_cuts(pieces, left, right, times=times, cuts=cuts, upto=upto, begin=begin, player_cost=player_cost)
    cost = np.minimum(knot.touch_cost, knot.free_cost)
    own = pieces.cost + _compute_short_cost(pieces, times)
    best = np.where(begin == 0, own, np.inf)
    back = np.full(len(pieces), -1)
    offset = 0
    # best[k]: lowest cost of a chain that ends with piece k; back[k]: the piece before it.
    # The pair costs lie cut by cut in one array: rows are pieces into the cut, columns pieces out of it.
    for cut in range(1, len(cuts) - 1):
        into, (low, high) = ending[by_end[cut] : by_end[cut + 1]], outof[cut]
        count = len(into) * (high - low)
        total = best[into][:, None] + cost[offset : offset + count].reshape(len(into), high - low)
        choice = total.argmin(axis=0)
        found = own[low:high] + total[choice, np.arange(high - low)]
        better = found < best[low:high]
        best[low:high] = np.where(better, found, best[low:high])
        back[low:high] = np.where(better, into[choice], back[low:high])
        offset += count
    last = ending[by_end[len(cuts) - 1] :]
    chain = [int(last[best[last].argmin()])]
    while back[chain[-1]] >= 0:
        chain.append(int(back[chain[-1]]))
    chain = np.array(chain[::-1])
    return _build_cuts(pieces.select_rows(chain), times, cuts, player_cost)


def _compute_short_cost(pieces: PieceFits, times: np.ndarray) -> np.ndarray:
    """Compute nats for pieces shorter than _SHORT_SECONDS."""
    ends = times[np.minimum(pieces.last + 1, len(times) - 1)]
    return _SHORT_COST * np.maximum(0.0, 1.0 - (ends - pieces.begin) / _SHORT_SECONDS)


def _build_pairs(ending, by_end, outof) -> tuple[np.ndarray, np.ndarray]:
    """Build the indices of all pieces that may follow each other, cut by cut, row by row."""
    left, right = [np.zeros(0, int)], [np.zeros(0, int)]
    for cut in range(1, len(outof)):
        into, following = ending[by_end[cut] : by_end[cut + 1]], np.arange(*outof[cut])
        left.append(np.repeat(into, len(following)))
        right.append(np.tile(following, len(into)))
    return np.concatenate(left), np.concatenate(right)


@dataclass(frozen=True, eq=False, kw_only=True)
class _CutEstimates:
    """Estimates at K cuts: time, spread, place, velocity before and after, and nats of both kinds."""
    time: np.ndarray
    spread: np.ndarray
    place: np.ndarray
    before: np.ndarray
    after: np.ndarray
    touch_cost: np.ndarray
    free_cost: np.ndarray


def _estimate_cuts(pieces: PieceFits, left, right, times, cuts, upto, begin, player_cost) -> _CutEstimates:
    """Estimate each cut from its neighbouring pieces, with the costs of both kinds."""
    cut, resumed = upto[left], begin[right]
    first, second = times[cuts[cut] - 1], times[np.minimum(cuts[resumed], len(times) - 1)]
    middle, step = 0.5 * (first + second), np.maximum(second - first, 1e-3)
    before, after = pieces.velocity(middle, left), pieces.velocity(middle, right)
    # Move the cut to the time at which the two pieces come closest.
    gap = pieces.position(middle, left) - pieces.position(middle, right)
    change = after - before
    size = (change**2).sum(axis=1)
    shift = np.clip((gap * change).sum(axis=1) / np.maximum(size, 1e-6), -0.6 * step, 0.6 * step)
    time = middle + shift
    before, after = pieces.velocity(time, left), pieces.velocity(time, right)
    here, there = pieces.position(time, left), pieces.position(time, right)
    place_left, speed_left = pieces.spread(time, left)
    place_right, speed_right = pieces.spread(time, right)
    miss = ((here - there) ** 2).sum(axis=1) / (_JOINT_DEVIATION**2 + place_left + place_right)
    speed_var = speed_left + speed_right
    change = after - before
    size = np.sqrt((change**2).sum(axis=1))
    joint = -np.logaddexp(-0.5 * miss, -_MAX_JUMP_COST)
    joint = joint + _SKIP_COST * (second - first - _measure_interval(times)) * (resumed > cut)
    near = np.minimum(player_cost[cut], player_cost[resumed])
    touch = TOUCH_COST + joint + near + _compute_touch_cost(size, speed_var)
    free = FREE_COST + _NEAR_COST * np.exp(-near) + joint + _compute_free_cost(before, change, here, speed_var)
    place = (here * place_right[:, None] + there * place_left[:, None]) / (place_left + place_right)[:, None]
    spread = np.sqrt((place_left + place_right) / np.maximum(size**2, 0.25) + (0.1 * step) ** 2)
    return _CutEstimates(time=time, spread=np.minimum(spread, step), place=place, before=before, after=after,
                         touch_cost=touch, free_cost=free)


def _measure_interval(times: np.ndarray) -> float:
    return float(np.median(np.diff(times)))


def _compute_touch_cost(size, variance) -> np.ndarray:
    """Compute the cost of a velocity change by a touch: its size falls off exponentially, its direction is
    arbitrary.
    """
    size = np.sqrt(size**2 + variance)
    return size / USUAL_CHANGE + np.log(USUAL_CHANGE * 2.0 * np.pi * np.maximum(size, 0.3))


def _compute_free_cost(before, change, place, variance) -> np.ndarray:
    """Compute the cost of a velocity change without a touch: slightly slower along the direction, hardly any
    sideways, and upward only at the ground.
    """
    flat = before[:, :2]
    speed = np.linalg.norm(flat, axis=1)
    direction = flat / np.maximum(speed, 1e-6)[:, None]
    along = (change[:, :2] * direction).sum(axis=1)
    across = change[:, 0] * direction[:, 1] - change[:, 1] * direction[:, 0]
    slower = np.where(along < 0.0, 0.5 + 0.12 * speed, 0.5) ** 2 + variance
    aside = (0.4 + 0.02 * speed) ** 2 + variance
    cost = 0.5 * (_soften_squares(along**2 / slower) + _soften_squares(across**2 / aside)
                  + np.log(4.0 * np.pi**2 * slower * aside))
    if change.shape[1] == 3:
        upward = change[:, 2]
        bounces = (place[:, 2] < 0.5) & (before[:, 2] < 0.0) & (upward > 0.0)
        room = np.where(bounces, 2.0 + np.abs(before[:, 2]), 1.0) ** 2 + variance
        cost = cost + 0.5 * _soften_squares(upward**2 / room)
    return cost


def _soften_squares(squares: np.ndarray) -> np.ndarray:
    """Soften squares (in deviations) beyond three deviations: errors of feeds have heavier tails than a normal
    distribution.
    """
    return np.where(squares < 9.0, squares, 6.0 * np.sqrt(np.maximum(squares, 9.0)) - 9.0)


def _build_cuts(pieces: PieceFits, times, cuts, player_cost) -> Cuts:
    """Build the cuts between the chosen pieces."""
    upto = np.searchsorted(cuts, pieces.last + 1)
    left = np.arange(len(pieces) - 1)
    knots = _estimate_cuts(pieces, left, left + 1, times=times, cuts=cuts, upto=upto,
                           begin=np.searchsorted(cuts, pieces.first), player_cost=player_cost)
    return Cuts(time=knots.time, spread=knots.spread, touch=knots.touch_cost < knots.free_cost,
                margin=np.abs(knots.touch_cost - knots.free_cost), place=knots.place, before=knots.before,
                after=knots.after, pieces=pieces)


def measure_player_distances(times: np.ndarray, ball: np.ndarray, positions: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Measure the horizontal distance from each player to the ball.

    Args:
        times: (N,) s of the positions.
        ball: (K, 2) m at the moments.
        positions: (P, N, 2) m of the players.
        at: (K,) s, the moments.
    Returns:
        (P, K) m, inf where a player is absent.
    """
    out = np.full((len(positions), len(at)), np.inf)
    after = np.clip(np.searchsorted(times, at), 1, len(times) - 1)
    share = np.clip((at - times[after - 1]) / (times[after] - times[after - 1]), 0.0, 1.0)[:, None]
    for player, path in enumerate(positions):
        place = path[after - 1] * (1.0 - share) + path[after] * share
        distance = np.linalg.norm(place - ball, axis=1)
        out[player] = np.where(np.isfinite(distance), distance, np.inf)
    return out


def compute_reach_cost(distance: np.ndarray, height: np.ndarray | None,
                       untracked_cost: float = UNTRACKED_COST) -> np.ndarray:
    """Compute the nats for a player touching the ball at a horizontal distance.

    Args:
        distance: m between the player's centre and the ball.
        height: m of the ball's centre. None: unknown.
        untracked_cost: nats of a touch by no tracked player, the upper limit.
    Returns:
        Nats, same shape as `distance`.
    """
    cost = 0.5 * (np.maximum(distance - REACH, 0.0) / REACH_DEVIATION) ** 2
    if height is not None:
        cost = cost + 0.5 * (np.maximum(height - HIGHEST, 0.0) / _RISE) ** 2
    return np.minimum(cost, untracked_cost)


def choose_players(distances: np.ndarray, times: np.ndarray, between: np.ndarray,
                   untracked_cost: float = UNTRACKED_COST) -> np.ndarray:
    """Choose the player of every touch: the chain with the lowest cost, by dynamic programming over the touches.

    Args:
        distances: (P, K) m from each player to the ball at each touch.
        times: (K,) s.
        between: (P, K) m, a player's mean distance from the ball since the previous touch.
        untracked_cost: nats of a touch by no tracked player.
    Returns:
        (K,) player indices, -1 for none.
    """
    players, count = distances.shape
    if not count:
        return np.zeros(0, int)
    own = np.full((players + 1, count), untracked_cost)
    own[:players] = 0.5 * (np.maximum(distances - REACH, 0.0) / REACH_DEVIATION) ** 2 + distances / REACH_DEVIATION
    back = np.zeros((players + 1, count), int)
    best = own[:, 0]
    # best[p]: lowest cost of a chain whose last touch is by p (row P: no tracked player).
    # Either the same player touches again, or the best other one plus _PLAYER_CHANGE_COST.
    for touch in range(1, count):
        same = best.copy()
        if times[touch] - times[touch - 1] < _FOLLOW_SECONDS:
            same[:players] += 0.5 * np.maximum(between[:, touch] - 2.0 * REACH, 0.0) ** 2
        other = best.min() + _PLAYER_CHANGE_COST
        back[:, touch] = np.where(same <= other, np.arange(players + 1), best.argmin())
        best = np.minimum(same, other) + own[:, touch]
    chosen = np.zeros(count, int)
    chosen[-1] = best.argmin()
    for touch in range(count - 1, 0, -1):
        chosen[touch - 1] = back[chosen[touch], touch]
    return np.where(chosen == players, -1, chosen)
