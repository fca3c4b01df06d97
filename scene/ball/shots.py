"""The settings of an aimed ball as a shot of the core; the shot as keys, as a curve, and as overlays."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.motion import quaternion
from ..core import channels
from ..core.material import get_material
from ..core.measure import frames_per_second, units_per_metre
from ..core.saved_state import restore_playback, save_playback
from ..passes.hit_analysis import read_motion
from ..passes.possession import read_curves_before, sample_property
from ..passes.settings import KEPT
from ..path_editing.curve import remove_curve
from .settings import MARK

if TYPE_CHECKING:
    from ...beyond_mocap.ball.flight import Flight
    from ...beyond_mocap.ball.shot import Shot, Strikes

MIN_KEY_DISTANCE = 0.02  # frames, least distance of two keys; Blender merges keys within 0.01
CANDIDATE_POINTS = 40  # points of a drawn candidate trajectory
CURVE_STEP = 0.04  # s between points of the curve


@dataclass(frozen=True, eq=False)
class ShotRequest:
    """What is requested: the values of `BeyondMocapAim`. `body` is an object, so a request is only valid within one
    event.

    Attributes:
        body: armature that strikes, None: the ball leaves from `place`.
        part: that strikes.
        side: "left" or "right".
        bone: that strikes instead of the part, "" for none.
        first: first frame of the strike.
        last: last frame of the strike.
        target: (3,) m.
        place: (3,) m of the ball without a body.
        way: "AIR" or "GROUND".
        bounces: before the target.
        timing: "FREE", "SECONDS" or "FRAME".
        seconds: s from strike to target.
        arrival: scene frame of the arrival.
        ball: one of `physics.BALLS`.
        back: back spin, turns per second.
        left: spin to the left, turns per second.
        human: limit the launch to human speeds.
        follow: s simulated after the target.
    """

    body: bpy.types.Object | None
    part: str
    side: str
    bone: str
    first: int
    last: int
    target: tuple[float, float, float]
    place: tuple[float, float, float]
    way: str = "AIR"
    bounces: int = 0
    timing: str = "FREE"
    seconds: float = 1.0
    arrival: int = 0
    ball: str = "football"
    back: float = 0.0
    left: float = 0.0
    human: bool = True
    follow: float = 3.0

    def build_key(self) -> tuple:
        """Build plain values that distinguish requests, except for the body's motion; Blender keeps seven digits."""
        values = (getattr(self, field.name) for field in fields(self))
        return tuple(value.session_uid if isinstance(value, bpy.types.Object) else _round_values(value)
                     for value in values)


def _round_values(value):
    if isinstance(value, tuple):
        return tuple(_round_values(part) for part in value)
    return round(value, 4) if isinstance(value, float) else value


@dataclass(frozen=True, eq=False)
class SolvedShot:
    """A solved shot in a scene.

    Attributes:
        digest: of what it was computed from.
        shot: of the core.
        strikes: of the core.
        flight: the ball from the strike (0 s) on.
        strike: scene frame of the strike.
        fps: frames per second.
        target: (3,) m.
        candidate_trajectories: (N, CANDIDATE_POINTS, 3) m of the possible launches.
    """

    digest: str
    shot: "Shot"
    strikes: "Strikes"
    flight: "Flight"
    strike: int
    fps: float
    target: tuple[float, float, float]
    candidate_trajectories: np.ndarray


_strikes: dict[tuple, "Strikes"] = {}
_solved: dict[int, SolvedShot] = {}


def find_solved(ball: bpy.types.Object) -> SolvedShot | None:
    """Find the last solved shot of a ball in this session."""
    return _solved.get(ball.session_uid)


def has_solved_shots() -> bool:
    """Say whether any ball has been aimed in this session."""
    return bool(_solved)


def store_solved(ball: bpy.types.Object, solved: SolvedShot) -> None:
    """Store the shot that a ball's keys already show."""
    _solved[ball.session_uid] = solved


def clear_strikes(body: bpy.types.Object | None = None) -> None:
    """Clear the stored strikes of a body, or of all: its motion may have changed."""
    for key in [key for key in _strikes if body is None or key[0] == body.session_uid]:
        del _strikes[key]


def clear_all() -> None:
    """Clear everything stored, when another file is opened or the extension is disabled."""
    _strikes.clear()
    _solved.clear()


def build_request(scene: bpy.types.Scene, ball: bpy.types.Object) -> ShotRequest:
    """Build the request of an aimed ball from its settings; InputError if something is missing."""
    aim = ball.beyond_mocap_aim
    if aim.target is None or aim.target.name not in scene.objects:
        step = "pick a target, or press Revert Aim"
        raise InputError(f"ball {ball.name}", "its target is missing", "an object to aim at", step)
    if aim.body is not None and aim.body.name not in scene.objects:
        found = f"{aim.body.name} is not in this scene"
        raise InputError(f"ball {ball.name}", found, "a body of this scene", "pick another body")
    if aim.body is None and ball.get(KEPT):
        step = "pick a body, or press Revert Aim"  # a ball created for a strike has no own position
        raise InputError(f"ball {ball.name}", "no body strikes it", "a body", step)
    same = {field.name: getattr(aim, field.name) for field in fields(ShotRequest)
            if field.name not in ("target", "place")}
    return ShotRequest(**same, target=measure_position(scene, aim.target), place=tuple(aim.place))


def measure_position(scene: bpy.types.Scene, thing: bpy.types.Object) -> tuple[float, float, float]:
    """Measure an object's position, m."""
    return tuple(float(value) / units_per_metre(scene) for value in thing.matrix_world.translation)


def find_strikes(scene: bpy.types.Scene, request: ShotRequest) -> "Strikes":
    """Find where the part can strike; without a body, where the ball lies.

    Args:
        scene: the scene.
        request: the request.
    Returns:
        The strikes, world frame.
    Raises:
        InputError: if the body does not move on these frames, or its pose is invalid.
    """
    from ...beyond_mocap.ball.contact import find_striking_surface
    from ...beyond_mocap.ball.physics import BALLS
    from ...beyond_mocap.ball.shot import Strikes

    if request.last < request.first:
        found = f"frames {request.first} to {request.last}"
        raise InputError("aim", found, "a last frame not before the first", "set From and To")
    frames = np.arange(request.first, request.last + 1)
    if request.body is None:
        position = np.array([request.place])
        return Strikes(frames=frames[:1], start=position, end=position, radius=-BALLS[request.ball].radius,
                       velocity=np.zeros((1, 3)))
    key = (request.body.session_uid, request.part, request.side, request.bone, request.first, request.last,
           frames_per_second(scene))
    if key not in _strikes:
        motion, first = read_motion(scene, request.body)
        last = first + len(motion) - 1
        inside = frames[(frames >= first) & (frames <= last)]
        if not len(inside):
            found = f"frames {request.first} to {request.last}, but its motion is on {first} to {last}"
            raise InputError(f"armature {request.body.name}", found, "frames of its motion", "set From and To")
        surface = find_striking_surface(motion.skeleton, request.bone or request.part, request.side)
        found = Strikes.from_motion(motion, surface, inside - first, inside)
        if not (np.isfinite(found.start).all() and np.isfinite(found.velocity).all()):
            raise InputError(f"armature {request.body.name}", "NaN values in its pose", "a valid pose",
                             "check its keys")
        _strikes[key] = found
    return _strikes[key]


def solve_request(scene: bpy.types.Scene, request: ShotRequest, name: str) -> SolvedShot:
    """Solve a shot; the same request gives the same shot.

    Args:
        scene: the scene.
        request: the request.
        name: of the ball, for messages.
    Returns:
        The solved shot.
    Raises:
        InputError: as for `ball.shot.solve_shot`.
    """
    from ...beyond_mocap.ball.batch import simulate_trajectories
    from ...beyond_mocap.ball.flight import Launch, simulate_flight
    from ...beyond_mocap.ball.physics import BALLS, HUMAN_BALL_SPEEDS
    from ...beyond_mocap.ball.shot import solve_shot

    strikes, kind, fps = find_strikes(scene, request), BALLS[request.ball], frames_per_second(scene)
    shot_digest = compute_digest(request, strikes)
    strikes, seconds = _select_timely_strikes(strikes, request, fps)
    target = np.array(request.target)
    target[2] = max(target[2], kind.radius)
    fastest = HUMAN_BALL_SPEEDS.get("foot" if request.bone else request.part, np.inf) if request.human else np.inf
    shot = solve_shot(strikes, target, kind, seconds=seconds, bounces=request.bounces,
                      spin_turns=(request.back, request.left), ground=request.way == "GROUND", fastest=fastest,
                      subject=f"ball {name}")
    spin = shot.launches.spin[shot.chosen_index]
    flight = simulate_flight(Launch(0.0, shot.start, shot.velocity, spin), kind, shot.seconds + request.follow)
    possible = np.flatnonzero(shot.launches.possible)
    times = np.linspace(0.0, shot.seconds, CANDIDATE_POINTS)
    trajectories, _ = simulate_trajectories(shot.starts[possible], shot.launches.velocity[possible],
                                            shot.launches.spin[possible], kind, times)
    return SolvedShot(shot_digest, shot, strikes, flight=flight, strike=int(strikes.frames[shot.chosen_index]), fps=fps,
                      target=tuple(target), candidate_trajectories=trajectories)


def compute_digest(request: ShotRequest, strikes: "Strikes") -> str:
    """Compute a short digest of what a shot is computed from."""
    hashed = hashlib.sha1(repr(request.build_key()[1:]).encode())
    for values in (strikes.frames, strikes.start, strikes.end, strikes.velocity):
        hashed.update(np.round(np.asarray(values, float), 5).tobytes())
    return hashed.hexdigest()[:16]


def _select_timely_strikes(strikes: "Strikes", request: ShotRequest, fps: float) -> tuple["Strikes", np.ndarray | float
        | None]:
    """Select the strikes that are early enough, and the seconds from each to the target."""
    if request.timing != "FRAME":
        return strikes, request.seconds if request.timing == "SECONDS" else None
    seconds = (request.arrival - strikes.frames) / fps
    in_time = seconds > 0.05
    if not in_time.any():
        expected = f"a frame after the strike ({strikes.frames[0]})"
        raise InputError("aim", f"arrival on frame {request.arrival}", expected, "set Frame")
    arrays = {name: getattr(strikes, name)[in_time] for name in ("frames", "start", "end", "velocity")}
    return replace(strikes, **arrays), seconds[in_time]


def write_shot(scene: bpy.types.Scene, ball: bpy.types.Object, solved: SolvedShot) -> None:
    """Write a shot to the ball: keys on every frame, and where it bounces and arrives.

    Before the strike the ball keeps its earlier animation. Keys of an earlier shot are replaced in place.

    Args:
        scene: the scene.
        ball: the ball.
        solved: the shot.
    """
    aim = ball.beyond_mocap_aim
    if not aim.before.kept:
        save_playback(aim.before, ball)
    ball.rotation_mode = "QUATERNION"
    frames, places, turns = build_keys(scene, ball, solved)
    curves = {"location": places, "rotation_quaternion": turns}
    action, _ = channels.find_playing_action(ball)
    if action is not None and action.get(MARK):
        channels.replace_keys(ball, frames, curves)
    else:
        named = {path: ("Object Transforms", values) for path, values in curves.items()}
        action = channels.create_action(ball, f"{ball.name} aimed", frames, named)
    action[MARK] = solved.digest
    store_solved(ball, solved)
    aim.strike, aim.arrived = solved.strike, solved.strike + solved.shot.seconds * solved.fps
    aim.figures, aim.messages = "\n".join(describe_shot(solved)), ""
    aim.curve = update_trajectory_curve(scene, aim.curve, ball, solved.flight)


def apply_request(ball: bpy.types.Object, request: ShotRequest, target: bpy.types.Object) -> None:
    """Apply a request to a ball's settings, and aim it at `target`."""
    aim = ball.beyond_mocap_aim
    for field in fields(ShotRequest):
        if field.name != "target":
            setattr(aim, field.name, getattr(request, field.name))
    aim.target, aim.on = target, True


def check_ball(ball: bpy.types.Object | None) -> None:
    """Check that nothing else moves a ball; InputError otherwise."""
    if ball is None:
        return
    channels.check_editable(ball)
    if ball.parent is not None or len(ball.beyond_mocap_ball.holds) or any(one.influence for one in ball.constraints):
        found = "it has a parent, a constraint or is carried"
        raise InputError(f"ball {ball.name}", found, "a free ball", "free the ball first")
    if ball.rigid_body is not None and not ball.rigid_body.kinematic:
        found = "Blender's rigid bodies move it"
        raise InputError(f"ball {ball.name}", found, "a free ball", "remove its rigid body")


def find_place_ahead(strikes: "Strikes", far: float) -> tuple[float, float, float]:
    """Find a place (3,) m on the ground, `far` m in the direction in which the part moves fastest, or along X."""
    from ...beyond_mocap.ball.physics import FOOTBALL

    row = int(np.argmax(np.linalg.norm(strikes.velocity, axis=1)))
    level = strikes.velocity[row, :2]
    size = float(np.linalg.norm(level))
    x, y = strikes.start[row, :2] + far * (level / size if size > 0.1 else np.array([1.0, 0.0]))
    return float(x), float(y), FOOTBALL.radius


def find_strike_frames(scene: bpy.types.Scene, body: bpy.types.Object, part: str, side: str) -> tuple[int, int]:
    """Find the scene frames of the strike nearest to the current frame; that frame if there is none."""
    from ...beyond_mocap.passes.hits import detect_hits

    motion, first = read_motion(scene, body)
    now = min(max(scene.frame_current, first), first + len(motion) - 1)
    motions = detect_hits(motion, part, side).motions
    if not motions:
        return now, now
    nearest = min(motions, key=lambda one: abs(first + one.key - scene.frame_current))
    low, high = nearest.ball_stretch
    return int(first + low), int(first + high)


def find_radius(request: ShotRequest) -> float:
    """Find the radius of the requested ball, m."""
    from ...beyond_mocap.ball.physics import BALLS

    return BALLS[request.ball].radius


def build_keys(scene: bpy.types.Scene, ball: bpy.types.Object, solved: SolvedShot) -> tuple[np.ndarray, np.ndarray,
        np.ndarray]:
    """Build the keys of an aimed ball.

    Args:
        scene: the scene.
        ball: the ball.
        solved: the shot.
    Returns:
        Frames (F,), locations (F, 3) in Blender's units, rotations (F, 4).
    """
    strike, fps, flight = solved.strike, solved.fps, solved.flight
    rest = flight.rests_from if flight.rests_from is not None else flight.end
    last = int(np.ceil(strike + max(rest, solved.shot.seconds) * fps))
    whole = np.arange(strike, last + 1, dtype=float)
    # Bounces and the arrival get keys on fractional frames, unless a whole frame is close.
    exact = strike + fps * np.append(flight.bounces, solved.shot.seconds)
    exact = exact[(exact < last) & (np.abs(exact - np.round(exact)) > MIN_KEY_DISTANCE)]
    frames = np.sort(np.append(whole, exact))
    frames = frames[np.append(True, np.diff(frames) > MIN_KEY_DISTANCE)]
    seconds = (frames - strike) / fps
    places, turns = flight.at(seconds) * units_per_metre(scene), flight.rotations(seconds)
    earlier = _sample_earlier_keys(ball, strike)
    if earlier is not None:
        frames = np.concatenate([earlier[0], frames])
        places, turns = np.concatenate([earlier[1], places]), np.concatenate([earlier[2], turns])
    return frames, places, turns


def _sample_earlier_keys(ball: bpy.types.Object, strike: int) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Sample the ball's earlier animation up to the frame before the strike; None if there is none."""
    curves = read_curves_before(ball.beyond_mocap_aim.before)
    ends = channels.find_key_range(curves)
    if ends is None or ends[0] >= strike or ("location", 0) not in curves:
        return None
    frames = np.arange(ends[0], strike, dtype=float)
    turns = sample_property(curves, "rotation_quaternion", frames, (1.0, 0.0, 0.0, 0.0))
    return frames, sample_property(curves, "location", frames, (0.0, 0.0, 0.0)), quaternion.normalize(turns)


def update_trajectory_curve(
    scene: bpy.types.Scene, path: bpy.types.Object | None, ball: bpy.types.Object, flight: "Flight"
) -> bpy.types.Object:
    """Update the curve along a flight, up to where the ball rests; visible in views, not in renders.

    Args:
        scene: the scene.
        path: the existing curve, or None.
        ball: the ball.
        flight: the flight.
    Returns:
        The curve.
    """
    units = units_per_metre(scene)
    end = flight.rests_from if flight.rests_from is not None else flight.end
    times = np.unique(np.concatenate([np.arange(0.0, end, CURVE_STEP), flight.bounces, [end]]))
    points = np.ones((len(times), 4), np.float32)
    points[:, :3] = flight.at(times) * units
    if path is None or path.name not in scene.objects or path.type != "CURVE":
        data = bpy.data.curves.new(f"{ball.name} trajectory", "CURVE")
        data.dimensions = "3D"
        data.materials.append(get_material("Trajectory", (0.9, 0.9, 0.9), 0.9))
        path = bpy.data.objects.new(data.name, data)
        path[MARK] = True
        path.hide_select = path.hide_render = True
        (ball.users_collection or (scene.collection,))[0].objects.link(path)
    splines = path.data.splines
    line = splines[0] if len(splines) == 1 and len(splines[0].points) == len(points) else None
    if line is None:
        splines.clear()
        line = splines.new("POLY")
        line.points.add(len(points) - 1)
    line.points.foreach_set("co", points.ravel())
    path.data.update_tag()
    return path


def describe_shot(solved: SolvedShot) -> list[str]:
    """Describe a shot in lines "name: value"."""
    shot, launches = solved.shot, solved.shot.launches
    speed = float(np.linalg.norm(shot.velocity))
    up = float(np.degrees(np.arctan2(shot.velocity[2], np.linalg.norm(shot.velocity[:2]))))
    part = float(np.linalg.norm(solved.strikes.velocity[shot.chosen_index]))
    texts = [f"Struck on frame: {solved.strike}", f"Launch: {speed:.1f} m/s, {up:.0f}\N{DEGREE SIGN} up"]
    if part:
        texts.append(f"Part speed: {part:.1f} m/s")
    texts.append(f"Arrives on frame: {solved.strike + shot.seconds * solved.fps:.1f}")
    texts.append(f"Flight, miss: {shot.seconds:.2f} s, {1000.0 * launches.miss[shot.chosen_index]:.1f} mm")
    before = solved.flight.bounces[solved.flight.bounces < shot.seconds - 1e-3]
    if len(before):
        texts.append("Bounces on frame: " + ", ".join(f"{solved.strike + second * solved.fps:.1f}"
                                                      for second in before))
    if len(shot.frames) > 1:
        texts.append(f"Possible frames: {int(launches.possible.sum())} of {len(shot.frames)}")
    return texts


def remove_aim(ball: bpy.types.Object) -> None:
    """Remove the aim of a ball: its earlier animation returns and its curve is removed; the target stays."""
    channels.check_local(ball)
    channels.check_editable(ball)
    aim = ball.beyond_mocap_aim
    if aim.curve is not None and aim.curve.get(MARK):
        remove_curve(aim.curve)
    if aim.before.kept:
        restore_playback(aim.before, ball, MARK)
    for name in ("on", "body", "target", "curve", "messages", "figures", "strike", "arrived"):
        aim.property_unset(name)
    _solved.pop(ball.session_uid, None)
