"""Recipe for a rally that is played live (Ball handling, section 4).

The holder of the ball repeats the strike that the user has just done, and the ball goes to the player whom the user
chose. Until the user acts, all players stand and the ball lies at the holder's feet. A pass is planned from where all
players stand, only passer and receiver are rebuilt, and it is inserted into the running scene when it is ready. The
receiver stops the ball and is the next to act. The others watch it: `live_watchers`.

An answer depends on the rally, the library's strike that is played, the receiver and the bounces, but not on when it
begins: what is planned before the user strikes is, to the bit, what is planned after it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.easing import smoothstep
from ..base.errors import InputError
from ..base.time_series import interpolate_columns
from ..base.vectors import dot_products
from ..library.library import Library
from ..motion import quaternion
from ..motion.humanoid import compute_heading
from ..motion.motion import Motion, resample
from ..motion.track.ball_path import BallPath
from .hit_library import classify_hit
from .hits import HitMotion
from .pass_plan import PassPlan
from .pass_scene import GROUND, Example, Pass, PassScene
from .passes import build_ball, build_ball_path, build_bone_weights, plan_scene
from .player_motion import BodySettings, build_player_motion, estimate_least_seconds
from .player_path import HitOrder, Stance
from .strike_means import StrikeMeans

STANDING_SECONDS = 60.0
"""Seconds that all players keep standing if the user does not act."""
BLEND_SECONDS = 0.4
"""Seconds over which a player's previous motion blends into the new one."""
BALL_DISTANCE = 0.6
"""Metres from the holder to the ball at the start."""
# s: standing that is synthesized after a pass, and its end that is repeated forward and backward; the same at the start
_TAIL, _SWAY, _START_TAIL, _START_SWAY = 6.0, 4.0, 12.0, 11.0
_READY_SECONDS = 1.2  # s after the last strike at which the receiver can act
_SETTLING_SECONDS = 1.0  # s after that at which all have turned to the ball
_ROUNDS = 2  # plans before the final one, each moving the holder nearer to where the ball lies


@dataclass(frozen=True, eq=False)
class PlayerTimeline:
    """The motion of one player of a rally.

    Attributes:
        start: s on the scene's clock of the motion's first frame.
        motion: the motion.
    """

    start: float
    motion: Motion

    @property
    def end(self) -> float:
        """s on the scene's clock of the motion's last frame."""
        return self.start + self.motion.duration

    def stance_at(self, seconds: float) -> Stance:
        """Compute where the player stands at `seconds` on the scene's clock."""
        frame = int(np.clip(round((seconds - self.start) * self.motion.fps), 0, len(self.motion) - 1))
        one = self.motion.frames(frame, frame + 1)
        return Stance(tuple(float(v) for v in one.root_positions[0, :2]), float(compute_heading(one)[0]))


@dataclass(frozen=True, eq=False, kw_only=True)
class Rally:
    """The current state of a rally.

    Attributes:
        scene: the passing scene.
        holder: name of the player who has the ball.
        players: name -> motion up to now and from now on.
        ball: its path on the scene's clock.
        rate: frames per second of the motions; a pass begins on one of these frames.
        start: s at which the rally began.
        ready_time: s from which on the holder can act.
        passes: number of passes played.
    """

    scene: PassScene
    holder: str
    players: dict[str, PlayerTimeline]
    ball: BallPath
    rate: float
    start: float
    ready_time: float
    passes: int = 0

    @property
    def stances(self) -> dict[str, Stance]:
        """Where each player stands once they have come to rest after the last pass."""
        return {name: played.stance_at(self.ready_time + _SETTLING_SECONDS) for name, played in self.players.items()}

    @property
    def end(self) -> float:
        """s on the scene's clock until which all players and the ball go on."""
        return min(float(self.ball.times[-1]), *(played.end for played in self.players.values()))

    def keep_standing(self) -> Rally:
        """Build the rally in which all go on for STANDING_SECONDS longer, standing, and the ball lies."""
        players = {name: PlayerTimeline(played.start, _extend_standing(played.motion, _SWAY, self.rate))
                   for name, played in self.players.items()}
        return replace(self, players=players, ball=_extend_lying(self.ball))

    def find_frame(self, at: float) -> float:
        """Find the time in s of the first frame from `at` s on."""
        return float(self.start + np.ceil((at - self.start) * self.rate - 1e-6) / self.rate)

    def add_pass(self, live_pass: LivePass, at: float) -> Rally:
        """Build the rally with a pass that begins on the first frame from `at` s on.

        Args:
            live_pass: the pass.
            at: s on the scene's clock.
        Returns:
            The rally: both players' motions blend into the pass, everything before it stays.
        """
        at = self.find_frame(at)
        players = dict(self.players)
        for name, motion in live_pass.motions.items():
            players[name] = continue_motion(self.players[name], motion, at)
        ball = _continue_ball(self.ball, live_pass.ball, at, min(BLEND_SECONDS, live_pass.strike))
        return replace(self, holder=live_pass.receiver, players=players, ball=ball, ready_time=at + live_pass.seconds,
                       passes=self.passes + 1)


@dataclass(frozen=True, eq=False, kw_only=True)
class LivePass:
    """One pass from standing to standing, with its own clock from 0.

    Attributes:
        giver: name of the player who passes.
        receiver: name.
        motions: name -> motion, of passer and receiver, at the rally's rate; each ends standing for STANDING_SECONDS.
        ball: its path.
        strike: s of the passer's strike.
        seconds: s until the receiver can act.
        clip: path of the recording that the passer's strike comes from.
        warnings: what differs from the request.
    """

    giver: str
    receiver: str
    motions: dict[str, Motion]
    ball: BallPath
    strike: float
    seconds: float
    clip: str
    warnings: tuple[str, ...]


def start_rally(library: Library, scene: PassScene, holder: str, start: float = 0.0, rate: float | None = None,
                *, progress=None, cancelled=None) -> Rally:
    """Start a rally: all players stand where the scene says, the ball is in front of the holder.

    Args:
        library: the library.
        scene: the passing scene.
        holder: name of the player who has the ball.
        start: s on the scene's clock.
        rate: frames per second of the motions; None: the scene's.
        progress: receives the share of the work done and a short text.
        cancelled: whether to stop.
    Returns:
        The rally.
    Raises:
        InputError: for an unknown holder.
    """
    names = [player.name for player in scene.players]
    if holder not in names:
        raise InputError("holder", f"{holder!r}", f"one of {', '.join(names)}")
    facing, place, radius = scene.find_facing(holder), scene.find_player(holder).place, build_ball(scene).radius
    ball_place = np.array([place[0] + BALL_DISTANCE * np.cos(facing), place[1] + BALL_DISTANCE * np.sin(facing),
                           radius])
    times = np.arange(int(_START_TAIL * scene.fps) + 1) / scene.fps
    ball = BallPath(times, np.tile(ball_place, (len(times), 1)), np.ones(len(times), bool))
    players, rate = {}, rate or scene.fps
    for number, player in enumerate(scene.players):
        if progress:
            progress(number / len(names), f"{player.name} standing")
        stance = Stance(player.place, scene.find_facing(player.name))
        player_motion = build_player_motion(library, stance, (), ball=ball, ball_radius=radius, fps=scene.fps,
                                            settings=_build_settings(scene), cancelled=cancelled)
        players[player.name] = PlayerTimeline(start, _extend_standing(player_motion.take.motion, _START_SWAY, rate))
    return Rally(scene=scene, holder=holder, players=players, ball=_continue_ball(None, ball, start, 0.0), rate=rate,
                 start=start, ready_time=start)


def collect_means(library: Library, scene: PassScene) -> StrikeMeans:
    """Collect the motions with which the players of a rally can strike, all in the library's size."""
    return StrikeMeans(library, scene, {player.name: 1.0 for player in scene.players})


def build_answer(library: Library, rally: Rally, hit: HitMotion, target: str, bounces: int = 0,
                 progress: Callable[[float, str], None] | None = None, cancelled: Callable[[], bool]
                 | None = None) -> LivePass:
    """Build the pass with which the holder answers a hit of the user: the most similar motion of the library (eq. 2).

    The kind of the pass is that of the library's motion. It is planned from where the players and the ball come to
    rest; the receiver goes back to their place in the scene.

    Args:
        library: the library.
        rally: the rally.
        hit: the user's hit motion, or the library's own that is most similar to it: the pass is the same.
        target: name of the receiver.
        bounces: how often the ball bounces on its trajectory.
        progress: receives the share of the work done and a short text.
        cancelled: whether to stop.
    Returns:
        The pass.
    Raises:
        InputError: for a target that is unknown, the holder, or out of reach.
        NotInLibrary: if no clip strikes with that part.
        UserCancelledError: if `cancelled` returns True.
    """
    stances, ball_place = rally.stances, rally.ball.positions[-1]
    played = collect_means(library, rally.scene).find_similar(rally.holder, hit).hit
    one = Pass(rally.holder, target, classify_hit(played), bounces=bounces, part=played.part, side=played.side,
               example=Example("", hit=played))
    scene = replace(
        rally.scene, passes=(one,), repeat=1, missed=0.0, dropped=0.0, lead_in=0.0, lead_out=_TAIL, serve=GROUND,
        players=tuple(  # the receiver goes back to their place: each strike carries its player on, towards the others
            replace(player, place=player.place if player.name == target else stances[player.name].place,
                    facing=stances[player.name].facing, height=0.0) for player in rally.scene.players
        ),
    )
    plan = _plan_pass(library, scene, stances[rally.holder], ball_place=ball_place, progress=progress,
                      cancelled=cancelled)
    path = build_ball_path(plan)
    path = replace(path, positions=_roll_ball(path, ball_place, plan.strikes[0].order.time))
    motions = {name: build_standing_motion(library, rally, name, plan.list_orders(name), path, cancelled=cancelled)
               for name in (one.giver, one.receiver)}
    strikes = plan.strikes
    clip = library.clips[strikes[0].order.clip].path
    seconds = strikes[-1].order.time + _READY_SECONDS
    return LivePass(giver=one.giver, receiver=target, motions=motions, ball=path, strike=strikes[0].order.time,
                    seconds=seconds, clip=clip, warnings=plan.warnings)


def build_standing_motion(library: Library, rally: Rally, name: str, orders: Sequence[HitOrder], ball: BallPath,
                          cancelled: Callable[[], bool] | None = None) -> Motion:
    """Build the motion of a rally's player from standing to standing, at the rally's rate.

    Args:
        library: the library.
        rally: the rally.
        name: of the player.
        orders: what they strike.
        ball: its path, from 0 s on.
        cancelled: whether to stop.
    Returns:
        The motion; at its end they stand for STANDING_SECONDS.
    """
    scene = rally.scene
    player_motion = build_player_motion(library, rally.stances[name], orders, ball=ball,
                                        ball_radius=build_ball(scene).radius, fps=scene.fps,
                                        settings=_build_settings(scene), cancelled=cancelled)
    return _extend_standing(player_motion.take.motion, _SWAY, rally.rate)


def _build_settings(scene: PassScene) -> BodySettings:
    """Build the players' settings of a scene."""
    weights = build_bone_weights(scene.weights)
    return BodySettings(transition=scene.transition, watch=scene.watch, seed=scene.seed, weights=weights)


def _plan_pass(library: Library, scene: PassScene, stance: Stance, ball_place: np.ndarray, progress,
               cancelled) -> PassPlan:
    """Plan the pass while the ball stays where it lies: the holder goes to where they strike it.

    Where the holder's motion is no kick from the ground, the ball hops up to them.
    """
    giver = scene.passes[0].giver
    try:
        for _ in range(_ROUNDS):
            plan = plan_scene(library, scene, progress, cancelled)
            shift = ball_place[:2] - np.array(plan.strikes[0].order.ball[:2])
            seconds = estimate_least_seconds(library, stance, plan.strikes[0].order)
            place = np.array(scene.find_player(giver).place) + shift
            scene = replace(
                scene, lead_in=max(seconds, 0.3),
                players=tuple(replace(one, place=tuple(place)) if one.name == giver else one for one in scene.players),
            )
        return plan_scene(library, scene, progress, cancelled)
    except InputError as error:
        if not str(error).startswith("serve"):
            raise
    players = tuple(replace(one, place=stance.place) if one.name == giver else one for one in scene.players)
    return plan_scene(library, replace(scene, serve=tuple(ball_place), players=players), progress, cancelled)


def _roll_ball(path: BallPath, ball_place: np.ndarray, strike: float) -> np.ndarray:
    """Compute the ball's positions (T, 3) m, blended from where it lies to where it is struck: a few centimetres."""
    offset = ball_place - path.positions[0]
    return path.positions + (1.0 - smoothstep(path.times / max(strike, 1e-6)))[:, None] * offset


def _extend_standing(motion: Motion, sway_seconds: float, rate: float) -> Motion:
    """Extend a motion that ends standing by STANDING_SECONDS at `rate` frames per second, playing its last
    `sway_seconds` forward and backward.
    """
    motion = resample(motion, rate)
    count = len(motion)
    sway = min(int(sway_seconds * motion.fps), count - 1)
    # a triangle wave over the last `sway` frames
    more = np.arange(1, int(STANDING_SECONDS * motion.fps) + 1) % (2 * sway)
    frames = np.concatenate([np.arange(count), count - 1 - np.where(more <= sway, more, 2 * sway - more)])
    return replace(motion, root_positions=motion.root_positions[frames], rotations=motion.rotations[frames])


def continue_motion(before: PlayerTimeline, motion: Motion, at: float) -> PlayerTimeline:
    """Continue a player's motion with `motion` from `at` s on, blended in over BLEND_SECONDS.

    Only the frames around the blend are computed, since a strike waits for it: all others are as they were before.
    """
    first = round((at - before.start) * motion.fps)
    blend = _blend_in(before.motion, motion, first)
    count = len(blend)
    tail = motion.rotations[count:]
    if len(tail):  # sign-continuous with the blend
        tail = tail * np.where(dot_products(blend.rotations[-1], tail[0]) < 0.0, -1.0, 1.0)[:, None]
    root = _join_frames(before.motion.root_positions, first, (blend.root_positions, motion.root_positions[count:]))
    rotations = _join_frames(before.motion.rotations, first, (blend.rotations, tail))
    return PlayerTimeline(before.start, Motion.from_stored(motion.skeleton, root, rotations, motion.fps))


def _join_frames(before: np.ndarray, first: int, after: tuple[np.ndarray, ...]) -> np.ndarray:
    """Join the first frames of `before` (T, ...), which holds its last one, with those that come after them."""
    held = np.repeat(before[-1:], max(first - len(before), 0), axis=0)
    joined = np.concatenate([before[:first], held, *after])
    joined.setflags(write=False)
    return joined


def _blend_in(before: Motion, motion: Motion, first: int) -> Motion:
    """Compute the frames of a motion that are blended in, where it begins on frame `first` of the one before."""
    count = min(int(BLEND_SECONDS * motion.fps) + 1, len(motion))
    frames = np.clip(np.arange(first - 1, first + count), 0, len(before) - 1)  # one more, for the signs
    weight = smoothstep(np.arange(-1, count) / max(count - 1, 1))[:, None]
    shown = np.clip(np.arange(-1, count), 0, None)
    root = (1.0 - weight) * before.root_positions[frames] + weight * motion.root_positions[shown]
    old = quaternion.match_signs(before.rotations[frames], motion.rotations[shown])
    rotations = quaternion.slerp(old, motion.rotations[shown], weight)
    rotations[0] = before.rotations[frames[0]]
    return Motion(motion.skeleton, root, rotations, motion.fps).frames(1, count + 1)


def _continue_ball(before: BallPath | None, path: BallPath, at: float, blend: float) -> BallPath:
    """Join the ball's path so far with `path` from `at` s on, blended in over `blend` s; then let it lie for
    STANDING_SECONDS.
    """
    path = _extend_lying(path)
    times, places, rotations = path.times + at, path.positions, path.rotations
    if before is None:
        return replace(path, times=times)
    is_before = before.times < at - 0.5 * (times[1] - times[0])
    # it may still roll out from the pass before
    weight = 1.0 - smoothstep((times - at) / max(blend, 1e-6))[:, None]
    places = places + weight * (interpolate_columns(times, before.times, before.positions) - places)
    rotations = quaternion.multiply(rotations, before.rotations[is_before][-1] if is_before.any()
                                    else quaternion.identity(1)[0])
    return BallPath(np.concatenate([before.times[is_before], times]),
                    np.concatenate([before.positions[is_before], places]),
                    np.ones(int(is_before.sum()) + len(times), bool),
                    np.concatenate([before.rotations[is_before], rotations]))


def _extend_lying(path: BallPath) -> BallPath:
    """Let the ball of a path lie at its end for STANDING_SECONDS."""
    step = path.times[1] - path.times[0]
    added = int(round(STANDING_SECONDS / step))
    times = np.concatenate([path.times, path.times[-1] + step * np.arange(1, added + 1)])
    rotations = path.rotations if path.rotations is not None else quaternion.identity(len(path.times))
    return BallPath(times, np.concatenate([path.positions, np.repeat(path.positions[-1:], added, axis=0)]),
                    np.ones(len(times), bool), np.concatenate([rotations, np.repeat(rotations[-1:], added, axis=0)]))
