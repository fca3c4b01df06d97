"""Key moments moved to the solved touches of the ball, and the ball's trajectory by physics and by contact.

    plan = resolve_touches(Plan(track=track, timeline=timeline))

This is what `synthesize` and `resynthesize` do with a solved ball (`solve_ball`): before the search, key moments move
to solved touches; when the body is done, the ball passes through the places where it was met, as solved in between, and
in dribbles step by step from foot to foot (`synthesis.construct.ball_touch.dribble`).
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import replace
from operator import attrgetter

import numpy as np

from ..annotation import KeyMoment, Span, Timeline
from ..annotation.ball_contact import (
    SENDING,
    TAKING,
    build_surfaces,
    find_contact_window,
    find_striking_part,
    measure_contact_gap,
)
from ..annotation.labels import list_labels
from ..annotation.striking import build_part_surfaces, measure_ball_gap
from ..ball.tracked.carried import find_carried_stretches
from ..ball.tracked.kinds import THROW_IN, TOUCH_KINDS
from ..ball.tracked.solve import SolvedBall, SolvedTouch
from ..base.errors import InputError, TimedMessage
from ..base.time_series import find_runs
from ..motion.motion import compute_pose
from ..motion.track import BALL_RADIUS, Track
from ..motion.track.ball_path import BallPath
from .construct.ball_detour import find_free_contact, lead_ball_around_body
from .construct.ball_touch.dribble import plan_dribbles
from .construct.ball_touch.touch_frames import compute_contact_frames, find_nearest_frame
from .construct.ball_touch.touch_problem import BALL_NOISE
from .construct.contact_geometry import BALL_SECONDS, add_flight_arc, lead_ball_through
from .construct.give import give_with_ball
from .construct.held_ball import HandTouch, carry_in_hands, hold_in_spans
from .construct.near_miss import miss_ball
from .plan import Plan, PlayerTouch, ResolvedPlan, SolvedTrajectory
from .take import DribbleTouch, KeyResult, Take

MAX_TOUCH_OFFSET = 0.4
"""Seconds from a key moment within which its touch is searched."""

AT_BALL_GAP = 0.03
"""Metres between the surfaces up to which a part is at the ball."""

_WITHIN = 1.5  # m from the player within which a touch by an unknown player may be this player's
# cost in seconds: player unknown, other part, other kind
_UNKNOWN_PLAYER_COST, _OTHER_PART_COST, _OTHER_KIND_COST = 0.15, 0.25, 0.15
_MAX_SAMPLE_GAP = 0.1  # s from the nearest measured sample beyond which the ball counts as filled in
_CARRIED_MARGIN = 0.15  # s from the ends of such a stretch from which on its course shows no touches, only steering
_LISTED_TIMES = 6  # key moments that a line lists
_STEP = 0.004  # s between the points of a trajectory
_CARRYING, _HOLDING = (frozenset(list_labels(ball=what)) for what in ("carries", "holds"))
_SENDING_KINDS = {kind.name for kind in TOUCH_KINDS if kind.ball in ("sends", "carries")}
_TAKING_KINDS = {kind.name for kind in TOUCH_KINDS if kind.ball == "takes"}


def resolve_touches(plan: Plan, known: SolvedTrajectory | None = None) -> Plan:
    """Solve the ball's trajectory and move the plan's key moments to its touches.

    Args:
        plan: the plan.
        known: the trajectory, where an earlier take of the same track has it.
    Returns:
        The plan; without a trajectory where it is not to be solved or the track has no ball.
    """
    if not plan.solve_touches:
        return plan if plan.solved is None else replace(plan, solved=None)
    trajectory = plan.solved or known or solve_track_ball(plan)
    return plan if trajectory is None else replace(plan, solved=trajectory,
                                                   timeline=_match_touches(plan.timeline, trajectory.touches))


def solve_track_ball(plan: Plan) -> SolvedTrajectory | None:
    """Solve the ball's trajectory from the samples of one player's track; None where these are too few."""
    from ..ball.tracked.solve import solve_ball

    try:
        solved = solve_ball(plan.track, only_own_flights=True)
    except InputError:
        return None
    return build_trajectory(solved, plan.track.name, plan)


def sample_solved_ball(solved: SolvedBall, first: float, last: float) -> tuple[np.ndarray, np.ndarray]:
    """Sample a solved ball every _STEP and at each touch.

    Args:
        solved: the solved ball.
        first, last: s, the span.
    Returns:
        Times (N,) s and positions (N, 3) m, NaN where the ball is not known.
    """
    even = np.linspace(first, last, int(np.ceil((last - first) / _STEP)) + 1)
    times = np.union1d(even, [touch.time for touch in solved.touches if first <= touch.time <= last])
    begins, ends = solved.pieces[0].start, solved.pieces[-1].end
    pairs = zip(solved.pieces, solved.pieces[1:])
    # gaps between pieces in which the ball is not known
    gaps = np.array([[before.end, after.start] for before, after in pairs]).reshape(-1, 2)
    unknown = (times < begins) | (times > ends)
    for end, start in gaps[gaps[:, 1] - gaps[:, 0] > _STEP]:
        unknown |= (times > end) & (times < start)
    ball = np.maximum(solved.ball.at(times), [-np.inf, -np.inf, BALL_RADIUS])
    return times, np.where(unknown[:, None], np.nan, ball)


def build_trajectory(solved: SolvedBall, player: str, plan: Plan, sample=sample_solved_ball) -> SolvedTrajectory:
    """Convert a solved ball to the trajectory of one player's plan.

    Args:
        solved: the solved ball.
        player: name of the player.
        plan: the player's plan; its time is covered.
        sample: `sample_solved_ball`, or one that remembers its result for plans of the same span.
    Returns:
        The trajectory, with the player's touches marked.
    """
    first, last = plan.track.times[[0, -1]].tolist()
    inside = [touch for touch in solved.touches if first <= touch.time <= last]
    times, ball = sample(solved, first, last)
    seen = solved.times[solved.measured]
    carried = _find_carries(plan.track)
    filled = _is_far(times, seen) | _is_within(times, carried)
    moments = np.array([touch.time for touch in inside])
    inside = [touch for touch, is_carried in zip(inside, _is_within(moments, carried, _CARRIED_MARGIN))
              if not (is_carried and touch.player in ("", player))]
    return SolvedTrajectory(times, ball, filled, tuple(_build_touch(touch, player, plan) for touch in inside))


def _is_within(times: np.ndarray, stretches: list[tuple[float, float]], margin: float = 0.0) -> np.ndarray:
    """Return (M,) bool: times within stretches, more than a margin in seconds from their ends."""
    return np.any([(times >= first + margin) & (times <= last - margin) for first, last in stretches],
                  axis=0) if stretches else np.zeros(len(times), bool)


def _is_far(times: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Return (M,) bool: times more than _MAX_SAMPLE_GAP seconds from the nearest of the times `seen` (K,)."""
    if len(seen) < 2:
        return np.ones(len(times), bool)
    after = np.clip(np.searchsorted(seen, times), 1, len(seen) - 1)
    return np.minimum(np.abs(times - seen[after - 1]), np.abs(seen[after] - times)) > _MAX_SAMPLE_GAP


def _build_touch(touch: SolvedTouch, player: str, plan: Plan) -> PlayerTouch:
    """Convert a solved touch to this player's view: own touch or not, and the part if the height is known."""
    is_own: bool | None = touch.player == player
    if not touch.player:
        place = [np.interp(touch.time, plan.track.times, plan.track.positions[:, axis]) for axis in (0, 1)]
        is_own = None if np.linalg.norm(touch.position[:2] - place) <= _WITHIN else False
    heights = plan.track.ball_height_known[_find_nearest_sample(plan.track.times, touch.time)]
    part = touch.part if heights or touch.kind == THROW_IN else ""
    return PlayerTouch(touch.time, is_own, part, touch.kind)


def _find_nearest_sample(times: np.ndarray, time: float) -> int:
    """Find the sample nearest to a time, the earlier of two that are equally near."""
    after = int(np.searchsorted(times, time))
    near = np.arange(max(after - 1, 0), min(after + 1, len(times)))
    return int(near[np.abs(times[near] - time).argmin()])


def _match_touches(timeline: Timeline, touches: tuple[PlayerTouch, ...]) -> Timeline:
    """Move key moments to the touches that fit them best, each touch for one, in the order of both.

    Key moments and touches are aligned like two lines of text (edit distance): a key moment without a touch costs
    MAX_TOUCH_OFFSET, one with a touch the seconds between them and what of the touch does not fit its labels.
    """
    keys = [replace(key, solved=None) for key in timeline.keys]
    own_touches = [touch for touch in touches if touch.is_own is not False]
    best = np.full((len(keys) + 1, len(own_touches) + 1), np.inf)
    best[0], choices = 0.0, np.zeros((len(keys) + 1, len(own_touches) + 1), int)
    # best[row, column]: lowest cost of aligning the first `row` key moments with the first `column` touches;
    # choices: 0 the key moment stays, 1 the touch is skipped, 2 they are matched
    for row, key in enumerate(keys, 1):
        stays, matches = best[row - 1] + MAX_TOUCH_OFFSET, np.full(len(own_touches) + 1, np.inf)
        for number in _list_near_touches(key, own_touches):
            matches[number + 1] = best[row - 1, number] + _compute_mismatch(key, own_touches[number])
        best[row] = np.minimum.accumulate(np.minimum(stays, matches))  # skipped touches cost nothing
        is_skipped = np.concatenate([[False], best[row, :-1] == best[row, 1:]])
        choices[row] = np.where(best[row] == stays, 0, np.where(is_skipped, 1, 2))
    row, column, moved = len(keys), len(own_touches), keys[:]
    # trace back from the last cell: 0 moves up, 1 moves left, 2 moves both
    while row:
        choice = choices[row, column]
        if choice == 2:
            moved[row - 1] = replace(keys[row - 1], solved=own_touches[column - 1].time)
        row, column = row - (choice != 1), column - (choice > 0)
    return replace(timeline, keys=tuple(_restore_order(moved)))


def _list_near_touches(key: KeyMoment, touches: Sequence[PlayerTouch]) -> range:
    """List the numbers of the touches, in order of time, that may be close enough to a key moment."""
    reach = MAX_TOUCH_OFFSET + 1e-6  # more than rounding can change
    return range(bisect_left(touches, key.time - reach, key=attrgetter("time")),
                 bisect_right(touches, key.time + reach, key=attrgetter("time")))


def _compute_mismatch(key: KeyMoment, touch: PlayerTouch) -> float:
    """Compute how far a touch is from a key moment and its labels, in seconds; inf where it cannot be meant."""
    part, words, off = find_striking_part(key.words), set(key.words), abs(touch.time - key.time)
    if part is None or key.misses_ball or off > MAX_TOUCH_OFFSET:
        return np.inf
    kinds = _SENDING_KINDS if SENDING & words else _TAKING_KINDS if TAKING & words else {touch.kind}
    unlike = _UNKNOWN_PLAYER_COST * (touch.is_own is None) + _OTHER_KIND_COST * (touch.kind not in kinds)
    unlike += _OTHER_PART_COST * (touch.part not in ("", part))
    return off + unlike


def _restore_order(keys: list[KeyMoment]) -> list[KeyMoment]:
    """Restore the requested time of key moments that would pass one another by their solved times."""
    while True:
        pairs = list(enumerate(zip(keys, keys[1:])))
        crossing = [n for n, (a, b) in pairs if a.resolved_time > b.resolved_time or a.resolved_time == b.resolved_time
                    and a.time < b.time]
        if not crossing:
            return keys
        for number in {m for n in crossing for m in (n, n + 1)}:
            keys[number] = replace(keys[number], solved=None)


def report_missing_touches(take: Take, plan: ResolvedPlan) -> list[str]:
    """Report what the ball lacks: touches that key moments request, touches of dribbles, places of its own.

    Args:
        take: the take of `apply_trajectory`.
        plan: the resolved plan.
    """
    touching = [key for key in plan.timeline.keys if find_striking_part(key.words) and not key.misses_ball]
    dribbles = [span for span in plan.timeline.spans if _CARRYING.intersection(span.words)]
    if plan.trajectory is None:
        message = "the ball's touches are not solved: the track has no ball, or too few samples of it"
        return [message] if plan.requested.solve_touches and (touching or dribbles) else []
    return [*_report_untouched_keys([key for key in touching if key.solved is None]),
            *_report_carries(plan.requested.track), *_report_untouched_dribbles(take, dribbles)]


def _report_untouched_keys(keys: list[KeyMoment]) -> list[str]:
    """Report in one line the key moments for which the trajectory has no touch."""
    if not keys:
        return []
    more = len(keys) - _LISTED_TIMES
    times = ", ".join(f"{key.time:g}" for key in keys[:_LISTED_TIMES]) + (f" and {more} more" if more > 0 else "")
    words = ", ".join(dict.fromkeys(f"'{' '.join(key.words)}'" for key in keys))
    stay = "the key moment stays at its time" if len(keys) == 1 else "these key moments stay at their times"
    return [TimedMessage(f"{times} s: the ball's trajectory has no touch for {words} within {MAX_TOUCH_OFFSET:g} s; "
                         f"{stay}", *((key.time, key.time) for key in keys))]


def _report_carries(track: Track) -> list[str]:
    """Report in one line where the feed has the ball at the player's place."""
    carries = _find_carries(track)
    times = ", ".join(f"{first:.1f}-{last:.1f}" for first, last in carries)
    return [TimedMessage(f"{times} s: the feed has the ball at the player's own place; it is dribbled as the feet have "
                         "it", *carries)] if carries else []


def _report_untouched_dribbles(take: Take, dribbles: list[Span]) -> list[str]:
    """Report the labelled dribbles in which no foot touches the ball."""
    touched = np.array([take.start_time + push.first / take.motion.fps for push in take.dribble_touches])
    return [
        TimedMessage(
            f"{span.start:g}-{span.end:g} s: no foot touches the ball in this "
            f"'{' '.join(sorted(_CARRYING.intersection(span.words)))}': it is too short, or no foot "
            "is near the ball", (span.start, span.end),
        ) for span in dribbles if not ((touched >= span.start) & (touched <= span.end)).any()
    ]  # fmt: skip


def apply_trajectory(take: Take, plan: ResolvedPlan) -> tuple[Take, list[str]]:
    """Lead the ball of a take along its solved trajectory, through the places where it was met and around the body, and
    dribble it step by step.

    Args:
        take: the take with the ball as it was met.
        plan: the resolved plan.
    Returns:
        The take, unchanged where nothing is solved, and messages about measured places that lie in the body.
    """
    if plan.trajectory is None or take.ball is None:
        return _miss_ball(replace(take, solved=plan.trajectory), take.ball), []
    fps, contact_ball, times = take.motion.fps, take.ball.positions, take.ball.times
    keys = _list_ball_keys(take)
    held = [compute_contact_frames(key.frame, len(contact_ball)) for key in keys]
    course_changes = [(touch.time - take.start_time) * fps for touch in plan.trajectory.touches]
    trajectory, filled = plan.trajectory.interpolate(times)
    path = np.where(np.isfinite(trajectory), trajectory, contact_ball)
    # the height of a pin; on the ground the touches lead the ball evenly, as they do below
    path = np.column_stack([path[:, :2], plan.lead_ball(times, path)[:, 2]])
    known = np.interp(times, plan.track.times, plan.track.ball_height_known.astype(float)) > 0.5
    for number, pair in enumerate(held):
        path = add_flight_arc(path, float(np.mean(pair)), float(contact_ball[list(pair), 2].mean()), ~known, fps)
        bounds = _find_course_changes(pair, held[:number] + held[number + 1 :], course_changes, fps)
        path = lead_ball_through(path, pair, contact_ball[list(pair)], bounds)
        path = give_with_ball(take.motion.skeleton, take.motion.root_positions, take.motion.rotations, path, held=pair,
                              words=keys[number].contact_labels, until=bounds[1], fps=fps)
    stretches = [((first - take.start_time) * fps, (last - take.start_time) * fps)
                 for first, last in _list_dribbles(plan)]
    foot_contacts = take.contacts if take.stepped is None else take.contacts | take.stepped
    dribbled = plan_dribbles(take.motion.skeleton, take.motion.root_positions, take.motion.rotations,
                             foot_contacts=foot_contacts, ball=path, stretches=stretches, held=held, fps=fps,
                             measured=take.ball.measured & ~filled, course_changes=course_changes)
    pushed = [(push.first, push.last) for push in dribbled.pushes]
    take = _miss_ball(take, replace(take.ball, positions=dribbled.ball))
    free, met = _free_met_ball(take, dribbled.ball, dribbled.pushes)
    touches = [_build_hand_touch(take, key) for key in keys]
    free, carried = carry_in_hands(take.motion, free, touches)
    free, holds = hold_in_spans(take.motion, free, _find_shown(take, _HOLDING),
                                met=[frame for touch in touches for frame in touch.frames])
    carried += holds
    around = lead_ball_around_body(take.motion.skeleton, take.motion.root_positions, take.motion.rotations, ball=free,
                                   held=[*met, *pushed, *carried], fps=fps)
    ball, far = replace(take.ball, positions=around), np.linalg.norm(around - dribbled.ball, axis=1)
    for first, last in carried:
        far[first : last + 1] = 0.0
    messages = _report_detours(times, np.where(take.ball.measured & ~filled, far, 0.0))
    return replace(take, ball=ball, solved=plan.trajectory, contact_ball=take.ball,
                   dribble_touches=dribbled.pushes), messages


def _miss_ball(take: Take, ball: BallPath | None) -> Take:
    """Keep the body off a ball at the key moments that miss it, before the ball goes round the body."""
    if ball is None or not any(key.requested.misses_ball for key in take.keys):
        return take
    return replace(take, motion=miss_ball(take.motion, take.contacts, ball.positions, take.keys))


def _list_dribbles(plan: ResolvedPlan) -> list[tuple[float, float]]:
    """List first and last second of each dribble: labelled ones, and where the feed has the ball at the player."""
    labelled = [(span.start, span.end) for span in plan.timeline.spans if _CARRYING.intersection(span.words)]
    out: list[tuple[float, float]] = []
    for first, last in sorted([*labelled, *_find_carries(plan.requested.track)]):
        joins = out and first <= out[-1][1]
        out = [*out[:-1], (out[-1][0], max(out[-1][1], last))] if joins else [*out, (first, last)]
    return out


def _find_carries(track: Track) -> list[tuple[float, float]]:
    """Find first and last second of each stretch in which the feed has the ball at the player's place."""
    return find_carried_stretches(track.times, track.ball, track.positions)


def _report_detours(times: np.ndarray, moved: np.ndarray) -> list[str]:
    """Report where the ball goes farther round the body than its noise: `moved` (T,) m from where it was measured."""
    return [
        TimedMessage(
            f"{times[first]:.1f}-{times[end - 1]:.1f} s: the measured ball is inside the body; it goes round it, up to "
            f"{moved[first:end].max():.2f} m away", (float(times[first]), float(times[end - 1])),
        ) for first, end in find_runs(moved > BALL_NOISE)
    ]  # fmt: skip


def _find_shown(take: Take, labels: frozenset[str]) -> list[tuple[int, int]]:
    """Find first and last frame of each stretch in which a take shows one of some labels."""
    return [(first, end - 1) for first, end in find_runs(np.array([bool(labels & set(words)) for words in take.words]))]


def _build_hand_touch(take: Take, key: KeyResult) -> HandTouch:
    """Build the touch of a key moment, within the clip that plays there; in a dive it may be later (`strike`)."""
    frame, words = find_nearest_frame(key.frame, len(take.clip)), key.contact_labels
    others, frames = np.flatnonzero(take.clip != take.clip[frame]), compute_contact_frames(key.frame, len(take.clip))
    window = slice(frame, frame + int(find_contact_window(words) * take.motion.fps) + 1)
    if find_contact_window(words):
        places, world = compute_pose(take.motion.skeleton, take.motion.root_positions[window],
                                     take.motion.rotations[window])
        gaps = np.abs(measure_contact_gap(take.motion.skeleton, places, world, words, take.ball.positions[window]))
        frames = (frame + int(np.argmin(np.where(np.isfinite(gaps), gaps, np.inf))),) * 2
    return HandTouch(frames=frames, words=words,
                     low=int(max(others[others < frame], default=-1)) + 1,
                     high=int(min(others[others > frame], default=len(take.clip))) - 1)


def _list_ball_keys(take: Take) -> list[KeyResult]:
    """List the key moments in which some part meets the ball, in order of time."""
    skeleton = take.motion.skeleton
    return sorted((key for key in take.keys if build_surfaces(skeleton, key.contact_labels)), key=lambda key: key.frame)


def _free_met_ball(take: Take, ball: np.ndarray,
                   pushes: Sequence[DribbleTouch]) -> tuple[np.ndarray, list[tuple[int, int]]]:
    """Move the ball (T, 3) m out of the rest of the body where a part meets it: at a key moment, or for one frame of a
    dribble.

    Args:
        take: the take.
        ball: (T, 3) m.
        pushes: the touches of dribbles.
    Returns:
        The ball, and first and last frame of each such meeting.
    """
    out, met, skeleton, reach = ball, [], take.motion.skeleton, int(BALL_SECONDS * take.motion.fps)
    meetings = [(find_nearest_frame(key.frame, len(ball)), build_surfaces(skeleton, key.contact_labels))
                for key in _list_ball_keys(take)]
    meetings += [(push.first, build_part_surfaces(skeleton, "foot", (push.side,)))
                 for push in pushes if push.first == push.last]
    for frame, surfaces in meetings:
        places, world = (values[0] for values in compute_pose(skeleton, take.motion.root_positions[frame : frame + 1],
                                                              take.motion.rotations[frame : frame + 1]))
        gaps = [abs(measure_ball_gap(part.compute_line(places, world), part.radius, out[frame])) for part in surfaces]
        if min(gaps) < AT_BALL_GAP:
            place = find_free_contact(skeleton, surfaces[int(np.argmin(gaps))], places, world, out[frame])
            edges = [edge for pair in (*((push.first, push.last) for push in pushes), *met) for edge in pair]
            bounds = (max([frame - reach, *(edge for edge in edges if edge < frame)]),
                      min([frame + reach, *(edge for edge in edges if edge > frame)]))
            out = lead_ball_through(out, (frame, frame), np.array([place, place]), bounds)
            met.append((frame, frame))
    return out, met


def _find_course_changes(pair: tuple[int, int], others: list[tuple[int, int]], course_changes: list[float],
                         fps: float) -> tuple[int, int]:
    """Return the frames before and after a touch at which the ball changes its course for other reasons."""
    low = [*(p[1] for p in others if p[1] <= pair[0]), *(int(np.floor(turn)) for turn in course_changes if turn
                                                         < pair[0] - 1.5)]
    high = [*(p[0] for p in others if p[0] >= pair[1]), *(int(np.ceil(turn)) for turn in course_changes if turn
                                                          > pair[1] + 1.5)]
    return max(low, default=pair[0] - int(fps)), min(high, default=pair[1] + int(fps))
