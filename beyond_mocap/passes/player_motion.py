"""Recipe for one player of a passing scene: the ordered hit motions in place, and what the player does between them.

The path search binds each hit motion to its moment and fills the rest with standing, walking and turning. `player_path`
gives position and facing. Feet are planted or step, the head follows the ball, and the striking part is brought to the
ball. The ball is never moved.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..annotation import Timeline, choose_gaits
from ..annotation.gaits import STANDING, compute_standing_heading
from ..annotation.striking import BODY_PARTS
from ..annotation.timeline import KeyMoment
from ..ball.contact import find_striking_surface
from ..base.errors import InputError, format_seconds
from ..base.time_series import interpolate_columns
from ..base.vectors import arctan2
from ..library.automatic_locomotion import build_automatic_labels
from ..library.keys import Key
from ..library.library import Library
from ..motion import quaternion
from ..motion.motion import ACCEPTED_RATES, Motion
from ..motion.track import BALL_RADIUS, SampledTrack, Track
from ..motion.track.ball_path import BallPath
from ..motion.track.sampling import compute_travel_direction
from ..synthesis.construct.ball_touch.touch_frames import Touch
from ..synthesis.construct.construction import Construction
from ..synthesis.construct.strike_fixed_ball import FixedStrike, FixedStrikeResult, strike_fixed_ball
from ..synthesis.construct.track_following import IN_PLACE_SPEED, follow_turning
from ..synthesis.one_thread import limit_to_one_thread
from ..synthesis.plan import Plan
from ..synthesis.provenance import build_provenance_fields
from ..synthesis.resolve_plan import resolve_plan
from ..synthesis.search.cut_costs import BoneDistance
from ..synthesis.search.path_search import PathSearch
from ..synthesis.search.request import RequestedKey, SearchRequest
from ..synthesis.search.source_frames import SourceMotion, fetch_motion
from ..synthesis.take import Take
from .player_path import HitOrder, PlacedHit, Stance, build_player_path, compute_travel_time, place_hits
from .pose_distance import BoneWeights, weigh_bones

TRANSITION = 0.4
"""Seconds over which one piece of a clip blends into the next."""
READY = "ready"
"""Label of waiting for the ball, which players who stand show where the library has it."""
_PART_LABELS = {**{part: part for part in BODY_PARTS}, "hand": "throw"}  # there is no label "hand"
_WATCH_WEIGHT = 0.02  # weight of facing the ball while standing, against the clip's own turning


@dataclass(frozen=True)
class BodySettings:
    """Settings of the players' motion.

    Attributes:
        transition: seconds of the blend between pieces of clips (section 4: S_T).
        watch: whether head and shoulders follow the ball.
        seed: seed that the take records; nothing here is left to chance.
        weights: bone weights of eq. 1, by which poses are compared where one clip is left for the next.
    """

    transition: float = TRANSITION
    watch: bool = True
    seed: int = 0
    weights: BoneWeights = BoneWeights()


@dataclass(frozen=True, eq=False, kw_only=True)
class PlayerMotion:
    """The motion of one player of a passing scene, K strikes.

    Attributes:
        take: motion with contacts and provenance, as `synthesize` gives it.
        gaps: (K,) m between part and ball at each strike, NaN where the player misses.
        part_shifts: (K,) m by which the part was moved to meet the ball.
        warnings: what differs from the orders.
    """

    take: Take
    gaps: np.ndarray
    part_shifts: np.ndarray
    warnings: tuple[str, ...]


def build_player_motion(library: Library, stance: Stance, orders: Sequence[HitOrder], ball: BallPath,
                        ball_radius: float = BALL_RADIUS, fps: float = 30.0, settings: BodySettings = BodySettings(),
                        progress: Callable[[float, str], None] | None = None,
                        cancelled: Callable[[], bool] | None = None) -> PlayerMotion:
    """Build the motion of a player who begins at `stance` and strikes as ordered.

    The same input gives the same bits.

    Args:
        library: the library.
        stance: where the player begins.
        orders: strikes of this player, in any order.
        ball: its path at `fps` over the whole scene; the motion has the same length.
        ball_radius: m.
        fps: frames per second of the motion.
        settings: settings of the motion.
        progress: receives the share of the work done and a short text.
        cancelled: whether to stop.
    Returns:
        The motion with its gaps and warnings.
    Raises:
        InputError: for orders outside the scene, or two at one time.
        UserCancelledError: if `cancelled` returns True.
    """
    orders = sorted(orders, key=lambda order: order.time)
    _check_orders(orders, ball.times, fps)
    with limit_to_one_thread():
        return _PlayerBuilder(library, stance, orders, ball=ball, ball_radius=ball_radius, count=len(ball.times),
                              fps=fps, settings=settings).build(progress, cancelled)


def estimate_least_seconds(library: Library, before: HitOrder | Stance, after: HitOrder) -> float:
    """Estimate the least time that the body needs from one strike, or from standing, to the next.

    It has to leave the one motion, travel and turn, and begin the other.

    Args:
        library: the library.
        before: the strike before, or where the player stands.
        after: the next strike.
    Returns:
        Seconds.
    """
    next_hit = PlacedHit.from_order(library, after)
    run_up = after.time - next_hit.start
    end = (0.0, next_hit.compute_path(np.array([next_hit.start]))[0], next_hit.compute_velocity(next_hit.start))
    if isinstance(before, Stance):
        state, run_out = (0.0, np.array(before.place, float), np.zeros(2)), 0.0
    else:
        hit = PlacedHit.from_order(library, before)
        run_out = hit.end - before.time
        state = (0.0, hit.compute_path(np.array([hit.end]))[0], hit.compute_velocity(hit.end))
    is_still = np.linalg.norm(end[1] - state[1]) < 0.15 and max(np.linalg.norm(end[2]), np.linalg.norm(state[2])) < 0.3
    turn = abs(float(quaternion.wrap_angle(after.facing - before.facing)))
    return run_out + run_up + max(turn / 2.0, 0.2 if is_still else compute_travel_time(state, end))


def collect_strike_labels(library: Library) -> frozenset[str]:
    """Collect the labels that key moments of the library have and its other rows do not."""
    rows = [row for clip in library.clips for row in clip.annotations]
    other_labels = {label for row in rows if row.key is None for label in row.words}
    return frozenset(label for row in rows if row.key is not None for label in row.words) - other_labels


def _check_orders(orders: Sequence[HitOrder], times: np.ndarray, fps: float) -> None:
    """Check that the orders lie within the scene and that no two are at one time."""
    for order in orders:
        if not times[0] - 0.5 / fps <= order.time <= times[-1] + 0.5 / fps:
            scene = f"{format_seconds(times[0])} to {format_seconds(times[-1])} s"
            raise InputError("strike", f"at {format_seconds(order.time)} s", f"within the scene, {scene}")
    for before, after in zip(orders, orders[1:]):
        if after.time - before.time < 2.0 / fps:
            raise InputError("strike", f"one player has two at {after.time:g} s", "one at a time")


def _find_part_label(order: HitOrder) -> str:
    """Find the label of the part that strikes; a tool strikes like a kick."""
    return _PART_LABELS.get(order.part, "kick")


class _PlayerBuilder:
    """Builds the motion of one player.

    Attributes:
        start: s of the scene's first frame.
        hits: the placed hit motions.
        times: (T,) s of the motion's frames.
        ball: (T, 3) m, world frame.
    """

    def __init__(self, library, stance, orders, ball, ball_radius, count, fps, settings):
        self.library, self.orders, self.fps, self.settings = library, orders, fps, settings
        self.ball_radius, self.stance = ball_radius, stance
        self.start = float(ball.times[0])
        self.hits = place_hits(library, orders, self.start)
        self.times = self.start + np.arange(count) / fps
        self.ball = interpolate_columns(self.times, ball.times, ball.positions)

    def build(self, progress, cancelled) -> PlayerMotion:
        """Search, construct and solve ball contact."""
        report = progress or (lambda fraction, text: None)
        count = max(int(np.floor((self.times[-1] - self.start) * self.library.fps + 1e-6)) + 1, 2)
        order = self._build_request(self.start + np.arange(count) / self.library.fps)
        half = int(round(0.5 * self.settings.transition * self.library.fps))
        pose_distance = BoneDistance(weigh_bones(self.library, self.settings.weights), tuple(sorted({-half, half})))
        edit = PathSearch(
            self.library, order, progress=lambda part, text: report(0.7 * part, text), cancelled=cancelled,
            bone_distance=pose_distance,
        ).run()
        # output frames as fractional frames of the search, which runs at the library's rate
        index = np.minimum((self.times - self.start) * self.library.fps, count - 1)
        source = fetch_motion(self.library, edit, index, self.fps)
        track, path = self._build_track(self.times, self.fps)
        plan_as_requested = self._build_plan(track)
        plan = resolve_plan(plan_as_requested, self.library)
        report(0.75, "Constructing motion")
        planted, constructed = Construction(library=self.library, plan=plan, track=track, source=source,
                                            touches=self._build_touches(),
                                            heading=self._compute_heading(track, path.facing, source),
                                            is_planned=True).construct_body()
        body = Motion(self.library.skeleton, planted.root, planted.rotations, self.fps)
        met = strike_fixed_ball(body, constructed.heel_toe_contacts.any(axis=2), self._build_contacts())
        ball = BallPath(self.times, self.ball, np.ones(len(self.times), bool))
        take = Take(**build_provenance_fields(self.library, source), motion=met.motion, start_time=self.start,
                    contacts=constructed.contacts, timeline=Timeline(), keys=(), ball=ball, method="path",
                    seed=self.settings.seed, correction=planted.correction, ik_miss=planted.miss,
                    stepped=constructed.stepped, plan=plan_as_requested, edit=edit)
        report(1.0, "Done")
        return PlayerMotion(take=take, gaps=met.gap, part_shifts=met.moved, warnings=self._list_warnings(met, track))

    def _build_request(self, times: np.ndarray) -> SearchRequest:
        """Build the request to the search, at times (T,) s with the library's rate."""
        library = self.library
        track, _ = self._build_track(times, library.fps)
        speeds = np.array([gait.speed for gait in library.gaits])
        gait = choose_gaits(track.speed, library.fps, speeds, library.gait_thresholds)
        labels = [frozenset(labels) for labels in build_automatic_labels(library, gait, track)]
        if any(READY in row.words for clip in library.clips for row in clip.annotations):
            labels = [one | {READY} if STANDING in one else one for one in labels]
        strikes = collect_strike_labels(library)
        keys = tuple(self._build_key(hit, (hit.order.time - self.start) * library.fps) for hit in self.hits)
        for hit in self.hits:
            for frame in np.flatnonzero((times >= hit.start) & (times <= hit.end)):
                labels[frame] = None
        allowed = np.ones(len(library.clips), bool)
        avoided = tuple(strikes for _ in labels) if strikes else ()
        return SearchRequest(
            plan=self._build_plan(track), track=track, requested_labels=tuple(labels),
            is_asked=np.zeros(len(labels), bool), gait=gait, timeline=Timeline(), keys=keys, allowed=allowed,
            warnings=(), avoided=avoided,
        )

    def _build_key(self, hit: PlacedHit, frame: float) -> RequestedKey:
        """Build the key moment of a placed hit at a fractional `frame` of the search."""
        order = hit.order
        clip = self.library.clips[order.clip]
        frames = range(int(hit.first), int(hit.last) + 1)
        labels = frozenset({_find_part_label(order), order.side}
                           - {""}).union(*map(clip.labels_at, frames))
        key = Key(order.clip, float(order.strike_frame), hit.first, hit.last, labels)
        return RequestedKey(requested=KeyMoment(order.time, tuple(sorted(labels))), frame=frame, choices=(key,),
                            used_instead=None, is_ball_height_known=True, rates=(1.0,))

    def _build_track(self, times: np.ndarray, fps: float):
        """Build the track of the player's path at times (T,) s, and the path itself."""
        path = build_player_path(self.stance, self.hits, times)
        velocity = np.gradient(path.positions, 1.0 / fps, axis=0)
        ball = interpolate_columns(times, self.times, self.ball)
        track = SampledTrack(times=times, positions=path.positions, raw=path.positions, velocity=velocity,
                             speed=np.linalg.norm(velocity, axis=1), direction=compute_travel_direction(velocity, fps),
                             valid=np.ones(len(times), bool), ball=ball, ball_measured=np.ones(len(times), bool),
                             fps=float(fps))
        return track, path

    def _build_plan(self, track: SampledTrack) -> Plan:
        """Build the plan that the take stores: the track of the player's path."""
        return Plan(track=Track(track.times, track.positions, track.ball), library=self.library.folder, fps=self.fps,
                    seam_window=2.0 * self.settings.transition, seed=self.settings.seed, made=False,
                    watch=float(self.settings.watch), solve_touches=False)

    def _compute_heading(self, track: SampledTrack, recorded: np.ndarray, source: SourceMotion) -> np.ndarray:
        """Compute the heading (T,) rad: as recorded in hit motions, and between them a compromise, turned the short
        way.

        Between hit motions the goals are the direction of travel and, while standing, the ball; each is weighted.
        """
        known = np.flatnonzero(np.isfinite(recorded))
        rough = np.interp(np.arange(len(recorded)), known, recorded[known])
        own_speed = np.linalg.norm(source.velocity, axis=1)
        moving = [np.clip((speed - IN_PLACE_SPEED) / (1.0 - IN_PLACE_SPEED), 0.0, 1.0)
                  for speed in (track.speed, own_speed)]
        moving_weight = moving[0] ** 2 * moving[1] ** 2
        travel = track.direction - arctan2(source.velocity[:, 1], source.velocity[:, 0])
        watch, share = compute_standing_heading(track)
        weights = np.stack([moving_weight, _WATCH_WEIGHT * share * np.clip(1.0 - track.speed, 0.0, 1.0) ** 2])
        # both goals as the nearest angle to the rough heading, so that no weighted mean turns past half a turn
        goals = rough + quaternion.wrap_angle(np.stack([travel, watch]) - rough)
        trust = weights.sum(axis=0) + 1e-6
        goal = ((weights * goals).sum(axis=0) + 1e-6 * rough) / trust
        is_recorded = np.isfinite(recorded)
        goal, trust = np.where(is_recorded, recorded, goal), np.where(is_recorded, 1e6, trust)
        return follow_turning(goal, trust, source.turn)

    def _build_touches(self) -> list[Touch]:
        """Build the hit motions as stretches in which no steps are added."""
        return [
            Touch((hit.order.time - self.start) * self.fps, (_find_part_label(hit.order),),
                  (hit.order.time - hit.start) * self.fps, (hit.end - hit.order.time) * self.fps) for hit in self.hits
        ]  # fmt: skip

    def _build_contacts(self) -> list[FixedStrike]:
        """Build the ball contacts to solve: frame, surface, ball centre, and the blend in and out."""
        skeleton, out = self.library.skeleton, []
        for hit in self.hits:
            order = hit.order
            surface = find_striking_surface(skeleton, order.part, order.side, order.tool)
            frame = (order.time - self.start) * self.fps
            entry, leave = (frame - (hit.start - self.start) * self.fps, (hit.end - self.start) * self.fps - frame)
            ball = np.array(order.ball) if order.touches else np.full(3, np.nan)
            out.append(FixedStrike(frame, surface, ball, radius=self.ball_radius, entry=entry, leave=leave))
        return out

    def _list_warnings(self, met: FixedStrikeResult, track: SampledTrack) -> tuple[str, ...]:
        """Describe where the player would be too fast and where the part does not reach the ball."""
        warnings, fastest = [], int(np.argmax(track.speed))
        if track.speed[fastest] > ACCEPTED_RATES[1] * self.library.max_speed:
            needed_speed, library_speed = track.speed[fastest], self.library.max_speed
            warnings.append(
                f"{self.times[fastest]:.2f} s: the player has to run {needed_speed:.1f} m/s to arrive in time, but "
                f"the library has only {library_speed:.1f} m/s: allow more time, or choose a nearer place"
            )
        for order, gap in zip(self.orders, met.gap):
            if gap > 0.005:
                warnings.append(f"{order.time:.2f} s: the {order.part} is {100.0 * gap:.1f} cm off the ball")
        return tuple(warnings)
