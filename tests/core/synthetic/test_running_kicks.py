"""A kick on the run: a long last stride, the plant foot beside the ball in time, a swing through it, and on."""

import numpy as np
import pytest

from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.motion.retargeting.neutral import build_neutral_stance
from beyond_mocap.synthetic.running_kicks import Swing, build_running_kick, build_swing, measure_plant_foot

FPS = 120.0
SPEEDS = (2.0, 3.5, 5.0, 7.0)
NEUTRAL = build_neutral_stance(build_adult_skeleton())
BODY = identify_joints(NEUTRAL.skeleton)


@pytest.fixture(scope="module", params=[(kind, speed) for kind in ("instep", "inside") for speed in SPEEDS])
def kick(request):
    """Kind, run's speed, the kick, its joints (T, J, 3) m and the frame of the contact."""
    kind, speed = request.param
    gesture = build_running_kick(build_swing(kind, NEUTRAL), speed, NEUTRAL, fps=FPS)
    return kind, speed, gesture, forward_kinematics(gesture.motion)[0], int(round(gesture.key * FPS))


def find_stance(places: np.ndarray, side, around: int) -> tuple[int, int]:
    """First and last frame of the toe's rest around a frame."""
    moving = np.linalg.norm(np.gradient(places[:, side.toe, :2], axis=0), axis=1) * FPS > 0.3
    return int(np.flatnonzero(moving[:around]).max()) + 1, around + int(np.flatnonzero(moving[around:]).min()) - 1


def test_the_plant_foot_stands_beside_the_kicking_foot_and_level_with_it(kick):
    _, _, gesture, _, at = kick
    ahead, beside = measure_plant_foot(Swing(motion=gesture.motion, contact=float(at)))
    assert 0.2 <= beside <= 0.37 and -0.05 <= ahead <= 0.2


def test_the_plant_foot_is_down_in_time_and_stays(kick):
    _, speed, _, places, at = kick
    first, last = find_stance(places, BODY.left, at)
    assert 0.02 <= (at - first) / FPS <= 0.15 and (last - at) / FPS >= 0.02
    assert np.ptp(places[first : last + 1, BODY.left.toe, :2], axis=0).max() < 0.02


def test_the_foot_is_as_fast_as_a_kickers(kick):
    kind, _, _, places, at = kick
    apart = places[:, BODY.right.foot] - places[:, BODY.hips]
    speed = np.linalg.norm(apart[at + 1] - apart[at - 1]) * 0.5 * FPS
    assert (9.0 if kind == "instep" else 6.0) < speed < 20.0


def test_the_kicking_foot_returns_late_and_nothing_goes_through_the_ground(kick):
    kind, _, _, places, at = kick
    heights = places[at : at + int(0.3 * FPS), BODY.right.foot, 2]
    assert heights[-1] > 0.1 and heights.max() > (0.5 if kind == "instep" else 0.2)
    feet = [BODY.left.foot, BODY.left.toe, BODY.right.foot, BODY.right.toe]
    assert places[:, feet, 2].min() > -0.02


def test_the_last_stride_is_long(kick):
    _, speed, _, places, at = kick
    plant = find_stance(places, BODY.left, at)[0]
    landing = [find_stance(places, BODY.right, frame)[0] for frame in range(at - int(0.6 * FPS), at)
               if np.linalg.norm(places[frame + 1, BODY.right.toe, :2] - places[frame, BODY.right.toe, :2]) * FPS < 0.1]
    step = (plant - max(landing)) / FPS
    assert step > 0.85 * 0.5 / np.interp(speed, [2.0, 3.5, 5.2, 7.0], [1.2, 1.38, 1.53, 1.76])


def test_the_pelvis_keeps_the_speed_of_the_run(kick):
    _, speed, gesture, places, at = kick
    travelled = places[-1, BODY.hips, 0] - places[0, BODY.hips, 0]
    assert travelled / gesture.motion.duration == pytest.approx(speed, rel=0.1)


@pytest.mark.parametrize("degrees", [-22.0, 0.0, 42.0])
def test_the_foot_swings_in_the_direction_that_is_asked_for(degrees):
    gesture = build_running_kick(build_swing("instep", NEUTRAL), 4.0, NEUTRAL, direction=np.radians(degrees), fps=FPS)
    places, at = forward_kinematics(gesture.motion)[0], int(round(gesture.key * FPS))
    apart = places[:, BODY.right.foot] - places[:, BODY.left.upper_leg]
    way = apart[at + 1, :2] - apart[at - 1, :2]
    assert np.degrees(np.arctan2(way[1], way[0])) == pytest.approx(degrees, abs=12.0)


def test_a_slower_swing_is_a_softer_kick():
    speeds = []
    for rate in (0.6, 1.0):
        gesture = build_running_kick(build_swing("inside", NEUTRAL), 3.0, NEUTRAL, rate=rate, fps=FPS)
        places, at = forward_kinematics(gesture.motion)[0], int(round(gesture.key * FPS))
        apart = places[:, BODY.right.foot] - places[:, BODY.hips]
        speeds.append(np.linalg.norm(apart[at + 1] - apart[at - 1]) * 0.5 * FPS)
    assert speeds[0] == pytest.approx(0.6 * speeds[1], rel=0.15)


def test_the_same_kick_is_built_twice():
    swing = build_swing("instep", NEUTRAL)
    one, two = (build_running_kick(swing, 4.0, NEUTRAL).motion for _ in range(2))
    assert np.array_equal(one.rotations, two.rotations) and np.array_equal(one.root_positions, two.root_positions)
