"""A strike towards a target: which frame is taken, and where the ball lies then."""

import numpy as np
import pytest

from beyond_mocap.ball.flight import Launch, simulate_flight
from beyond_mocap.ball.physics import FOOTBALL, PAPER
from beyond_mocap.ball.shot import Strikes, compute_spins, solve_shot
from beyond_mocap.base.errors import InputError


def swing(count=9):
    """A foot, 0.2 m long, that swings along X over the origin 0.3 m high, fastest in the middle."""
    x = np.linspace(-0.4, 0.4, count)
    middle = np.stack([x, 0.0 * x, 0.3 + 0.5 * x**2], axis=1)
    speed = 12.0 * (1.0 - (x / 0.6) ** 2)
    velocity = np.stack([speed, 0.0 * x, speed * x], axis=1)
    return Strikes(frames=np.arange(100, 100 + count), start=middle - [0.1, 0.0, 0.0], end=middle + [0.1, 0.0, 0.0],
                   radius=0.04, velocity=velocity)


@pytest.mark.parametrize("bounces", [0, 1])
def test_the_ball_touches_the_part_and_arrives(bounces):
    strikes, target = swing(), np.array([12.0, 2.0, 0.5])
    shot = solve_shot(strikes, target, PAPER, bounces=bounces)
    row = shot.chosen_index
    line = strikes.end[row] - strikes.start[row]
    share = np.clip((shot.start - strikes.start[row]) @ line / (line @ line), 0.0, 1.0)
    assert np.linalg.norm(shot.start - strikes.start[row] - share * line) == pytest.approx(0.04 + 0.11, abs=0.005)
    there = simulate_flight(Launch(0.0, shot.start, shot.velocity), PAPER, shot.seconds).at([shot.seconds])[0]
    assert np.linalg.norm(there - target) < 0.02


def test_the_frame_is_the_one_with_the_fastest_part():
    shot = solve_shot(swing(), (15.0, 0.0, 0.3), FOOTBALL, seconds=1.0)
    assert abs(shot.frames[shot.chosen_index] - 104) <= 1


def test_along_the_ground_it_leaves_level():
    shot = solve_shot(swing(), (10.0, 0.0, 0.0), FOOTBALL, ground=True)
    assert shot.velocity[2] == 0.0 and shot.start[2] == pytest.approx(0.11)


def test_a_launch_nearby_gives_the_same_shot():
    strikes = swing()
    one = solve_shot(strikes, (12.0, 1.0, 0.4), FOOTBALL, seconds=1.2, bounces=1)
    other = solve_shot(strikes, (12.0, 1.0, 0.4), FOOTBALL, seconds=1.2, bounces=1, previous=one.launches)
    assert other.velocity == pytest.approx(one.velocity, abs=0.05)


def test_out_of_reach_says_how_far():
    with pytest.raises(InputError, match=r"throw.*119\.\d m.*no launch|throw.*119\.\d m.*38 m/s"):
        solve_shot(swing(), (120.0, 0.0, 0.3), FOOTBALL, seconds=1.0, fastest=38.0, subject="throw")


def test_a_target_at_the_foot_is_told():
    with pytest.raises(InputError, match="target"):
        solve_shot(swing(), swing().end[4] + [0.1, 0.0, 0.1], FOOTBALL)


def test_back_spin_lifts_and_spin_to_the_left_turns_left():
    spin = compute_spins(np.array([[3.0, 0.0, 1.0]]), (1.0, 2.0))[0]
    assert spin == pytest.approx([0.0, -2.0 * np.pi, 4.0 * np.pi])
