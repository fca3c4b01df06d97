"""Kalman smoothing: it is the Rauch-Tung-Striebel smoother, and it knows which frames to believe."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.markers.pose.low_pass import jerk_price, kalman, smoothed
from beyond_mocap.motion import quaternion
from beyond_mocap.synthetic.gait import gait


@pytest.fixture(scope="module")
def walk():
    return gait(1.4, 2.0, 200.0)


def textbook(seen, worth, price):
    """The smoother in its usual form: a pass of the filter, then the one back; seen (T,)."""
    step = np.array([[3.0, -3.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    state, spread = np.zeros(3), np.eye(3) * 1e9
    noise = np.diag([1.0 / price, 0.0, 0.0])
    ahead, after = [], []
    for t, value in enumerate(seen):
        if t:
            state, spread = step @ state, step @ spread @ step.T + noise
        ahead.append((state, spread))
        gain = spread[:, 0] / (spread[0, 0] + 1.0 / worth[t])
        state, spread = state + gain * (value - state[0]), spread - np.outer(gain, spread[0])
        after.append((state, spread))
    out = [after[-1][0]]
    for (now, wide), (next_state, next_wide) in zip(after[-2::-1], ahead[:0:-1]):
        back = wide @ step.T @ np.linalg.inv(next_wide)
        out.append(now + back @ (out[-1] - next_state))
    return np.array(out[::-1])[:, 0]


def test_it_is_the_smoother_of_rauch_tung_and_striebel():
    rng = np.random.default_rng(3)
    seen = np.cumsum(rng.normal(size=40))
    worth = rng.uniform(0.2, 2.0, 40)
    mine = smoothed(seen[:, None], worth, 2.0)[:, 0]
    assert np.abs(mine - textbook(seen, worth, 2.0)).max() < 1e-3 < np.abs(mine - seen).max()


def test_half_of_the_power_passes_at_the_cutoff_and_nothing_is_late():
    wave = np.sin(2.0 * np.pi * 13.4 * np.arange(4000) / 1000.0)
    out = smoothed(wave[:, None], np.ones(4000), jerk_price(1000.0, 13.4))[:, 0]
    assert np.allclose(out[500:-500], wave[500:-500] / np.sqrt(2.0), atol=1e-4)


def test_frames_that_tell_nothing_are_told_by_their_neighbours(walk):
    torn = np.array(walk.rotations)
    lost = slice(150, 160)
    torn[lost, 3] = quaternion.multiply(torn[lost, 3], quaternion.about_up(np.array(1.0)))
    worth = np.ones(torn.shape[:2])
    worth[lost, 3] = 0.0
    motion = replace(walk, rotations=torn)

    def off(out):
        turn = quaternion.multiply(quaternion.inverse(walk.rotations[lost, 3]), out.motion.rotations[lost, 3])
        return np.linalg.norm(quaternion.to_rotation_vector(turn), axis=-1).max()

    assert off(kalman(motion)) > 0.5
    assert off(kalman(motion, worth)) < 0.02


def test_what_cannot_be_smoothed_is_told_and_stays(walk):
    motion = replace(walk, fps=25.0)
    out = kalman(motion)
    assert out.motion is motion and len(out.notes) == 1


@pytest.mark.parametrize("worth", [np.ones(3), np.full((401, 25), np.nan)])
def test_a_worth_of_another_shape_is_refused(walk, worth):
    with pytest.raises(InputError, match="weights"):
        kalman(walk, worth)
