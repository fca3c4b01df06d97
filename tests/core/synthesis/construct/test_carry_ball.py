"""The balls of the clips ride along: at the foot that touches them, on the track, in kicks and dribbles."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from beyond_mocap.annotation.ball_contact import measure_contact_gap
from beyond_mocap.annotation.body_solid import BodySolid, build_leg_surfaces
from beyond_mocap.annotation.striking import build_part_surfaces
from beyond_mocap.base.time_series import find_runs
from beyond_mocap.files.bvh import bvh
from beyond_mocap.files.tables import write_ball
from beyond_mocap.library.build import build_library
from beyond_mocap.match.long_player import iter_parts, search_long_player
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.track import BALL_RADIUS
from beyond_mocap.motion.track.ball_path import BallPath
from beyond_mocap.synthesis.construct.ball_touch.recorded_placement import find_move_to_part
from beyond_mocap.synthesis.construct.ball_touch.recorded_touches import NearestParts
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.resynthesize import resynthesize
from beyond_mocap.synthesis.synthesize import synthesize
from beyond_mocap.synthetic.gait import build_gait
from beyond_mocap.synthetic.gestures import build_strike

FPS = 30.0
STRIDE = 22  # frames from touch to touch, about
OFF = 0.08  # m by which a recorded ball is farther from the foot than it was
AHEAD = 0.5  # m by which the ball is pushed ahead of the foot
GAIT = build_gait(2.8, 5.0, FPS, seed=3)


def find_planted_touches():
    """Frames in which the right foot ends its swing: there a dribbler touches the ball."""
    toe = build_part_surfaces(GAIT.skeleton, "foot", ("right",))[0].compute_line(*forward_kinematics(GAIT))[1]
    is_swinging = np.gradient(toe[:, 0]) * FPS > 1.3 * 2.8
    return toe, np.flatnonzero(is_swinging[:-1] & ~is_swinging[1:])


def plant_dribble(off):
    """A ball (T, 3) m that is pushed ahead at each touch, and is recorded so many metres farther from the foot."""
    toe, touches = find_planted_touches()
    step = np.diff(touches).mean()
    times = np.concatenate([touches[:1] - step * np.arange(3, 0, -1), touches, touches[-1:] + step * np.arange(1, 4)])
    places = np.interp(times, touches, toe[touches, 0]) + 2.8 / FPS * (times - np.clip(times, *touches[[0, -1]]))
    frames = np.arange(len(GAIT))
    at = np.searchsorted(times, frames, side="right") - 1
    share = (frames - times[at]) / (times[at + 1] - times[at])
    forward = np.interp(frames, times, places) + 0.05 + BALL_RADIUS + off + 4.0 * AHEAD * share * (1.0 - share)
    across = np.interp(frames, touches, toe[touches, 1])
    return np.column_stack([forward, across, np.full(len(frames), BALL_RADIUS)])


@pytest.fixture(scope="module")
def dribbles_of(tmp_path_factory, clips_folder):
    """dribbles_of(off): walks without a ball, and a jog with a dribbled one that is recorded off the foot."""
    return cache(lambda off: build_dribbles(tmp_path_factory.mktemp("dribbles"), clips_folder, off))


def build_dribbles(folder, clips_folder, off):
    for name in ("walk", "stand"):
        for ending in (".bvh", ".txt"):
            (folder / (name + ending)).write_bytes((clips_folder / (name + ending)).read_bytes())
    ball = plant_dribble(off)
    bvh.write_bvh(folder / "dribble.bvh", GAIT)
    (folder / "dribble.txt").write_text("0 5 dribble jogging front\n")
    write_ball(folder / "dribble.ball.csv", BallPath(np.arange(len(ball)) / FPS, ball, np.ones(len(ball), bool)))
    return build_library(folder, unit=0.01)


@pytest.fixture(scope="module")
def dribbles(dribbles_of):
    return dribbles_of(OFF)


@pytest.fixture(scope="module")
def plan(track_of, timeline_of):
    track = track_of(lambda t: np.where(t < 4.0, 1.4, 2.8), 10.0, turn=0.25)
    return Plan(track=track, timeline=timeline_of((4.5, 9.8, "dribble jogging front")), recorded_ball=True, made=False)


@pytest.fixture(scope="module")
def take(dribbles, plan):
    return synthesize(dribbles, plan)


def show_dribble(take):
    return np.array([take.clips[clip].startswith("dribble") for clip in take.clip])


def measure_feet_gaps(take):
    """Gaps (T,) in m between the feet and the ball."""
    return measure_contact_gap(take.motion.skeleton, *forward_kinematics(take.motion), ("dribble",),
                               take.ball.positions)


def measure_touch_gaps(take):
    """Gaps in m between foot and ball in the output frames that show a touch of the clip."""
    away = np.abs(take.clip_frame[:, None] - find_planted_touches()[1]).min(axis=1)
    return np.abs(measure_feet_gaps(take)[show_dribble(take) & (away < 0.5)])


@pytest.mark.parametrize("off", [OFF, 0.0, -OFF])
def test_a_dribbled_ball_rides_along_at_the_foot_that_touches_it(dribbles_of, plan, off):
    """Also near transitions, and where it is recorded off the foot or inside it; it never goes into a foot or shin."""
    take = synthesize(dribbles_of(off), plan)
    shown, gaps = show_dribble(take), measure_touch_gaps(take)
    known = np.isfinite(take.ball.positions).all(axis=1)
    assert shown.sum() > 4 * FPS and known[shown].all()
    assert (known & ~shown).sum() < 2 * STRIDE, "the ball went on where a foot of the clip alone would touch it"
    assert len(gaps) >= 4 and np.median(gaps) < 0.01 and gaps.max() < 0.07, gaps
    assert not take.ball.measured.any()
    assert any("a recorded ball is shown for" in line for line in take.warnings)
    skeleton, pose, at = take.motion.skeleton, forward_kinematics(take.motion), np.flatnonzero(known)
    legs = BodySolid.from_pose(build_leg_surfaces(skeleton), *pose).measure_gaps(take.ball.positions[at], at)
    assert legs.min() > -0.02 and measure_feet_gaps(take)[at].min() > -0.005
    assert take.ball.positions[at, 2].min() >= BALL_RADIUS - 1e-9


def test_the_ball_rolls_on_the_track_without_jumps(take):
    first, end = max(find_runs(show_dribble(take)), key=lambda run: run[1] - run[0])
    ball, root = take.ball.positions[first:end], take.motion.root_positions[first:end]
    assert np.allclose(ball[:, 2], BALL_RADIUS, atol=0.01)
    assert np.linalg.norm(ball - root, axis=1).max() < 2.0
    assert np.linalg.norm(np.diff(ball, axis=0), axis=1).max() * FPS < 8.0


def test_a_ball_does_not_leap_where_many_clips_meet(dribbles_of, plan, track_of):
    """Stops, starts and turns: some pairs of clips have their balls more than a metre apart."""
    harsh = track_of(lambda t: np.where(t % 1.5 < 0.75, 4.0, 1.0), 12.0, turn=0.9)
    take = synthesize(dribbles_of(-OFF), replace(plan, track=harsh))
    step = np.linalg.norm(np.diff(take.ball.positions, axis=0), axis=1)
    assert len(take.seams) > 4 and np.nanmax(step) < 0.6


def test_an_update_carries_the_ball_too(take, dribbles, track_of, timeline_of):
    slower = track_of(lambda t: np.where((t < 4.0) | (t > 7.5), 1.4, 2.8), 10.0, turn=0.25)
    timeline = timeline_of((4.5, 7.0, "dribble jogging front"))
    again = resynthesize(dribbles, replace(take.plan, track=slower, timeline=timeline), take)
    shown = show_dribble(again)
    assert 2 * FPS < shown.sum() < show_dribble(take).sum()
    assert np.isfinite(again.ball.positions[shown]).all()
    assert np.median(measure_touch_gaps(again)) < 0.02


def test_the_ball_rides_along_across_windows(take, dribbles):
    edit = search_long_player(dribbles, take.plan, 24.0, lambda *told: None, lambda: False)
    (whole,) = iter_parts(dribbles, replace(edit, window=2.0), lambda *told: None, lambda: False)
    known, shown = np.isfinite(whole.ball.positions).all(axis=1), show_dribble(whole)
    first, end = max(find_runs(shown), key=lambda run: run[1] - run[0])
    assert end - first > 4 * FPS and known[shown].all() and (known & ~shown).sum() < 2 * STRIDE
    assert np.linalg.norm(np.diff(whole.ball.positions[first:end], axis=0), axis=1).max() * FPS < 8.0
    gaps = measure_touch_gaps(whole)
    assert len(gaps) >= 4 and np.median(gaps) < 0.02 and gaps.max() < 0.07, gaps
    assert not any("a recorded ball is shown for" in line for line in whole.warnings), "that is told of the whole"


def test_without_the_setting_and_with_a_ball_in_the_track_nothing_rides_along(dribbles, track_of, timeline_of, take):
    line = (0.5, 3.5, "dribble jogging front")
    plain = Plan(track=track_of(2.8, 4.0), timeline=timeline_of(line), made=False)
    assert synthesize(dribbles, plain).ball is None
    tracked = Plan(track=track_of(2.8, 4.0, ball=True), timeline=timeline_of(line), solve_touches=False,
                   made=False)
    asked = Plan(**{**vars(tracked), "recorded_ball": True})
    assert np.array_equal(*(synthesize(dribbles, plan).ball.positions for plan in (tracked, asked)))


@pytest.mark.parametrize("is_flying", [False, True])
def test_a_kicked_ball_is_met_and_flies_on_as_recorded(tmp_path, clips_folder, track_of, timeline_of, is_flying):
    """Also where it is recorded some centimetres off the foot, and then nearest to it in another frame."""
    for name in ("walk.bvh", "walk.txt", "jog.bvh", "jog.txt", "kick.bvh", "kick.txt"):
        (tmp_path / name).write_bytes((clips_folder / name).read_bytes())
    kick = build_strike("kick low inside", fps=60.0)
    motion, frame = kick.motion, round(kick.key * 60.0)
    foot = build_part_surfaces(motion.skeleton, "foot", ("right",))[0].compute_line(*forward_kinematics(motion))[1]
    after = np.arange(len(motion)) - frame
    before, after = np.minimum(after, 0)[:, None] / 60.0, np.maximum(after, 0)[:, None] / 60.0
    ball = foot[frame] * [1, 1, 0] + [0.16 + OFF, 0.0, BALL_RADIUS] + after * [15.0, 0.0, 0.0]
    if is_flying:
        ball += [-0.06, 0.0, 0.15] + before * [-9.0, 0.0, 0.0] - 4.9 * after**2 * [0.0, 0.0, 1.0]
        ball[:, 2] = np.maximum(ball[:, 2], BALL_RADIUS)
    write_ball(tmp_path / "kick.ball.csv", BallPath(np.arange(len(ball)) / 60.0, ball, np.ones(len(ball), bool)))
    plan = Plan(track=track_of(2.8, 7.0), timeline=timeline_of((4.0, "kick low inside right")), recorded_ball=True,
                made=False)
    take = synthesize(build_library(tmp_path, unit=0.01), plan)
    path, at = take.ball.positions, round(take.keys[0].frame)
    speed = np.linalg.norm(np.diff(path, axis=0), axis=1) * FPS
    gap = measure_contact_gap(take.motion.skeleton, *forward_kinematics(take.motion), take.keys[0].words, path)
    assert abs(gap[at]) < 0.02
    assert is_flying or np.nanmax(speed[at - 40 : at - 1]) < 0.01, "a ball that lies still in the clip moved"
    assert np.isfinite(path[at : at + 50]).all() and np.ptp(speed[at + 2 : at + 50]) < 1.0
    assert 10.0 < speed[at + 10] < 22.0
    lowest = path[np.isfinite(path[:, 2]), 2]
    assert lowest.min() >= BALL_RADIUS - 1e-9 and lowest[-1] < BALL_RADIUS + 1e-9, "it goes into the ground, or hovers"


def test_a_ball_is_brought_to_the_part_and_not_through_the_floor():
    """From outside and from inside."""
    part, reach = np.random.default_rng(3).uniform((-0.3, -0.3, 0.02), (0.3, 0.3, 1.0), (200, 3)), np.full(200, 0.15)
    away = np.random.default_rng(4).normal(size=(200, 3))
    ball = part + away / np.linalg.norm(away, axis=1, keepdims=True) * np.linspace(0.05, 0.4, 200)[:, None]
    ball[:, 2] = np.maximum(ball[:, 2], BALL_RADIUS)
    gap = np.linalg.norm(ball - part, axis=1) - reach
    moved = ball + find_move_to_part(ball, NearestParts(gap=gap, recorded=part, shown=part, reach=reach))
    left = np.linalg.norm(moved - part, axis=1) - reach
    is_near, lies = np.abs(gap) <= 0.15, ball[:, 2] <= BALL_RADIUS + 0.05
    low = np.abs(np.maximum(BALL_RADIUS, ball[:, 2]) - part[:, 2]) < reach  # a part high above a ball cannot be met
    can_meet = is_near & (low | ~lies) & (moved[:, 2] > BALL_RADIUS)
    assert (can_meet & (gap < 0.0)).sum() > 10 and (can_meet & (gap > 0.0)).sum() > 40
    assert np.allclose(left[can_meet], 0.0, atol=1e-9)
    assert np.array_equal(moved[~is_near], ball[~is_near]) and np.array_equal(moved[lies, 2], ball[lies, 2])
    assert moved[:, 2].min() >= BALL_RADIUS and (is_near & lies).any()
