"""Recipe for a rally that is played live (Ball handling, section 4).

The holder of the ball repeats the strike that the user has just done, and the ball goes to the player whom the user
chose. Until the user acts, all players stand and the ball lies at the holder's feet. A pass is planned from where all
players stand, only passer and receiver are rebuilt, and it is inserted into the running scene when it is ready. The
receiver stops the ball and is the next to act.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..base.easing import smoothstep
from ..base.errors import InputError
from ..library.library import Library
from ..motion import quaternion
from ..motion.humanoid import heading
from ..motion.motion import Motion
from ..motion.track.ball_path import BallPath
from .bodies import BodySettings, least_seconds, player_motion
from .hit_library import kind_of
from .hits import HitMotion
from .pass_plan import PassPlan
from .pass_scene import GROUND, Example, Pass, PassScene
from .passes import ball_of, ball_path, bone_weights, planned
from .way import Stance

LONG = 60.0
"""Seconds that all players keep standing if the user does not act."""
FADE = 0.4
"""Seconds over which a player's previous motion blends into the new one."""
AHEAD = 0.6
"""Metres from the holder to the ball at the start."""
_TAIL, _SWAY = 4.0, 2.5  # s: standing that is synthesized after a pass; its end that is repeated forth and back
_STOPPED = 1.2  # s after the last strike at which the receiver can act
_ROUNDS = 2  # plans before the final one, each moving the holder nearer to where the ball lies


@dataclass(frozen=True, eq=False)
class Played:
    """The motion of one player of a rally.

    Attributes:
        start: s on the scene's clock of the motion's first frame.
        motion: the motion.
    """

    start: float
    motion: Motion

    def at(self, seconds: float) -> Stance:
        """Compute where the player stands at `seconds` on the scene's clock."""
        frame = int(np.clip(round((seconds - self.start) * self.motion.fps), 0, len(self.motion) - 1))
        one = self.motion.frames(frame, frame + 1)
        return Stance(tuple(float(v) for v in one.root_positions[0, :2]), float(heading(one)[0]))


@dataclass(frozen=True, eq=False, kw_only=True)
class Rally:
    """The current state of a rally.

    Attributes:
        scene: the passing scene.
        holder: name of the player who has the ball.
        players: name -> motion up to now and from now on.
        ball: its path on the scene's clock.
        start: s at which the rally began.
        ready_time: s from which on the holder can act.
        passes: number of passes played.
    """

    scene: PassScene
    holder: str
    players: dict[str, Played]
    ball: BallPath
    start: float
    free: float
    passes: int = 0

    def after(self, piece: Piece, at: float) -> Rally:
        """Build the rally with a pass that begins on the next frame after `at` s.

        Args:
            live_pass: the pass.
            at: s on the scene's clock.
        Returns:
            The rally: both players' motions blend into the pass, everything before it stays.
        """
        at = self.start + np.ceil((at - self.start) * self.scene.fps - 1e-6) / self.scene.fps
        players = dict(self.players)
        for name, motion in piece.motions.items():
            players[name] = _going_on(self.players[name], motion, at)
        ball = _on_from(self.ball, piece.ball, at)
        return replace(self, holder=piece.receiver, players=players, ball=ball, free=at + piece.seconds,
                       passes=self.passes + 1)


@dataclass(frozen=True, eq=False, kw_only=True)
class Piece:
    """One pass from standing to standing, with its own clock from 0.

    Attributes:
        giver: name of the player who passes.
        receiver: name.
        motions: name -> motion, of passer and receiver.
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


def begin(library: Library, scene: PassScene, holder: str, start: float = 0.0, progress=None, cancelled=None) -> Rally:
    """Start a rally: all players stand where the scene says, the ball is in front of the holder.

    Args:
        library: the library.
        scene: the passing scene.
        holder: name of the player who has the ball.
        start: s on the scene's clock.
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
    facing, place, radius = scene.facing(holder), scene.player(holder).place, ball_of(scene).radius
    lies = np.array([place[0] + AHEAD * np.cos(facing), place[1] + AHEAD * np.sin(facing), radius])
    times = np.arange(int(_TAIL * scene.fps) + 1) / scene.fps
    ball = BallPath(times, np.tile(lies, (len(times), 1)), np.ones(len(times), bool))
    players = {}
    for number, player in enumerate(scene.players):
        if progress:
            progress(number / len(names), f"{player.name} standing")
        stance = Stance(player.place, scene.facing(player.name))
        moved = player_motion(library, stance, (), ball=ball, ball_radius=radius, fps=scene.fps,
                              settings=_settings(scene), cancelled=cancelled)
        players[player.name] = Played(start, _lasting(moved.take.motion))
    return Rally(scene=scene, holder=holder, players=players, ball=_on_from(None, ball, start), start=start, free=start)


def answer(library: Library, rally: Rally, now: float, hit: HitMotion, target: str, bounces: int = 0,
           progress: Callable[[float, str], None] | None = None, cancelled: Callable[[], bool] | None = None) -> Piece:
    """Build the pass with which the holder answers a hit of the user: the most similar motion of the library (eq. 2).

    Args:
        library: the library.
        rally: the rally.
        now: s on the scene's clock, when all players stand.
        hit: the user's hit motion.
        target: name of the receiver.
        bounces: how often the ball bounces on its trajectory.
        progress: receives the share of the work done and a short text.
        cancelled: whether to stop.
    Returns:
        The pass.
    Raises:
        InputError: for a target that is unknown, the holder, or out of reach.
        NotInLibrary: if no clip strikes with that part.
        Cancelled: if `cancelled` returns True.
    """
    stances = {name: played.at(now) for name, played in rally.players.items()}
    lies = rally.ball.positions[min(int(np.searchsorted(rally.ball.times, now)), len(rally.ball.times) - 1)]
    one = Pass(rally.holder, target, kind_of(hit), bounces=bounces, part=hit.part, side=hit.side,
               example=Example("", hit=hit))
    scene = replace(
        rally.scene, passes=(one,), repeat=1, missed=0.0, dropped=0.0, lead_in=0.0, lead_out=_TAIL, serve=GROUND,
        players=tuple(
            replace(player, place=stances[player.name].place, facing=stances[player.name].facing, height=0.0)
            for player in rally.scene.players
        ),
    )
    plan = _planned(library, scene, stances[rally.holder], lies=lies, progress=progress, cancelled=cancelled)
    path = ball_path(plan)
    path = replace(path, positions=_rolled(path, lies, plan.strikes[0].order.time))
    motions = {}
    for name in (one.giver, one.receiver):
        moved = player_motion(library, stances[name], plan.orders(name), ball=path, ball_radius=ball_of(scene).radius,
                              fps=scene.fps, settings=_settings(scene), cancelled=cancelled)
        motions[name] = _lasting(moved.take.motion)
    strikes = plan.strikes
    clip = library.clips[strikes[0].order.clip].path
    seconds = strikes[-1].order.time + _STOPPED
    return Piece(giver=one.giver, receiver=target, motions=motions, ball=path, strike=strikes[0].order.time,
                 seconds=seconds, clip=clip, warnings=plan.warnings)


def _settings(scene: PassScene) -> BodySettings:
    """Build the players' settings of a scene."""
    weights = bone_weights(scene.weights)
    return BodySettings(transition=scene.transition, watch=scene.watch, seed=scene.seed, weights=weights)


def _planned(library: Library, scene: PassScene, stance: Stance, lies: np.ndarray, progress, cancelled) -> PassPlan:
    """Plan the pass while the ball stays where it lies: the holder goes to where they strike it.

    Where the holder's motion is no kick from the ground, the ball hops up to them.
    """
    giver = scene.passes[0].giver
    try:
        for _ in range(_ROUNDS):
            plan = planned(library, scene, progress, cancelled)
            shift = lies[:2] - np.array(plan.strikes[0].order.ball[:2])
            seconds = least_seconds(library, stance, plan.strikes[0].order)
            place = np.array(scene.player(giver).place) + shift
            scene = replace(
                scene, lead_in=max(seconds, 0.3),
                players=tuple(replace(one, place=tuple(place)) if one.name == giver else one for one in scene.players),
            )
        return planned(library, scene, progress, cancelled)
    except InputError as error:
        if not str(error).startswith("serve"):
            raise
    players = tuple(replace(one, place=stance.place) if one.name == giver else one for one in scene.players)
    return planned(library, replace(scene, serve=tuple(lies), players=players), progress, cancelled)


def _rolled(path: BallPath, lies: np.ndarray, strike: float) -> np.ndarray:
    """Compute the ball's positions (T, 3) m, blended from where it lies to where it is struck: a few centimetres."""
    away = lies - path.positions[0]
    return path.positions + (1.0 - smoothstep(path.times / max(strike, 1e-6)))[:, None] * away


def _lasting(motion: Motion) -> Motion:
    """Extend a motion that ends standing by STANDING_SECONDS, playing its last seconds forth and back."""
    count = len(motion)
    sway = min(int(_SWAY * motion.fps), count - 1)
    # a triangle wave over the last `sway` frames
    more = np.arange(1, int(LONG * motion.fps) + 1) % (2 * sway)
    frames = np.concatenate([np.arange(count), count - 1 - np.where(more <= sway, more, 2 * sway - more)])
    return replace(motion, root_positions=motion.root_positions[frames], rotations=motion.rotations[frames])


def _going_on(before: Played, motion: Motion, at: float) -> Played:
    """Continue a player's motion with `motion` from `at` s on, blended in over BLEND_SECONDS."""
    root, rotations = _faded(before, motion, at)
    past = np.clip(np.arange(round((at - before.start) * motion.fps)), 0, len(before.motion) - 1)
    root = np.concatenate([before.motion.root_positions[past], root])
    rotations = np.concatenate([before.motion.rotations[past], rotations])
    return Played(before.start, replace(motion, root_positions=root, rotations=rotations))


def _faded(before: Played, motion: Motion, at: float) -> tuple[np.ndarray, np.ndarray]:
    """Compute the root positions (T, 3) m and rotations (T, J, 4) of a motion that begins at `at` s, blended in."""
    count = min(int(FADE * motion.fps) + 1, len(motion))
    first = round((at - before.start) * motion.fps)
    frames = np.clip(np.arange(first, first + count), 0, len(before.motion) - 1)
    weight = smoothstep(np.arange(count) / max(count - 1, 1))[:, None]
    root, rotations = np.array(motion.root_positions), np.array(motion.rotations)
    root[:count] = (1.0 - weight) * before.motion.root_positions[frames] + weight * root[:count]
    old = quaternion.signed_like(before.motion.rotations[frames], rotations[:count])
    rotations[:count] = quaternion.slerp(old, rotations[:count], weight)
    return root, rotations


def _on_from(before: BallPath | None, path: BallPath, at: float) -> BallPath:
    """Join the ball's path so far with `path` from `at` s on, then let it lie for STANDING_SECONDS."""
    step = path.times[1] - path.times[0]
    more = int(round(LONG / step))
    times = np.concatenate([path.times, path.times[-1] + step * np.arange(1, more + 1)]) + at
    places = np.concatenate([path.positions, np.repeat(path.positions[-1:], more, axis=0)])
    turns = path.rotations if path.rotations is not None else quaternion.identity(len(path.times))
    turns = np.concatenate([turns, np.repeat(turns[-1:], more, axis=0)])
    if before is None:
        return BallPath(times, places, np.ones(len(times), bool), turns)
    kept = before.times < at - 0.5 * step
    turns = quaternion.multiply(turns, before.rotations[kept][-1] if kept.any() else quaternion.identity(1)[0])
    return BallPath(np.concatenate([before.times[kept], times]), np.concatenate([before.positions[kept], places]),
                    np.ones(int(kept.sum()) + len(times), bool), np.concatenate([before.rotations[kept], turns]))
