"""A hand is found by its markers under a motion that was filtered, and moved onto the floor."""

import numpy as np
import pytest

from beyond_mocap.markers.pose.low_pass import filter_butterworth
from beyond_mocap.markers.release.throwing_hand import refine_hand
from beyond_mocap.markers.release.without_ball import estimate_hand_release
from beyond_mocap.motion.hand import build_hand
from beyond_mocap.motion.motion import Motion
from beyond_mocap.synthetic.ground_truth.synthetic_markers import build_trial
from beyond_mocap.synthetic.throws import build_throw


@pytest.fixture(scope="module")
def known():
    return build_trial(build_throw((18.0, 0.0, 1.0), 30.0, fps=200.0).motion, "driveline")


def test_its_own_markers_make_it_sharp_again(known):
    true = build_hand(known.motion, "right")
    soft = filter_butterworth(known.motion, 6.0).motion
    low = Motion(soft.skeleton, soft.root_positions - [0.0, 0.0, 0.12], soft.rotations, soft.fps)
    dull = build_hand(low, "right")
    found = refine_hand(dull, known.trial)
    assert set(found.markers) == {"RFIN", "RWRA", "RWRB"}  # and not the forearm's
    assert np.allclose(found.shift, [0.0, 0.0, 0.12], atol=0.02)
    fast = slice(int(1.6 * 200), int(2.4 * 200))
    tip = true.finger * true.reach
    off = np.linalg.norm(found.to_world(tip) - true.to_world(tip), axis=-1)[fast]
    before = np.linalg.norm(dull.to_world(tip) + found.shift - true.to_world(tip), axis=-1)[fast]
    assert np.median(off) < 0.02 and off.max() < 0.5 * before.max()


def test_half_the_frames_tell_the_same(known):
    half = Motion(known.motion.skeleton, known.motion.root_positions[::2], known.motion.rotations[::2], 100.0)
    whole, part = (estimate_hand_release(build_hand(motion, "right"), 0.0366) for motion in (known.motion, half))
    assert abs(whole.time - part.time) < 0.006
    assert abs(np.linalg.norm(whole.velocity) / np.linalg.norm(part.velocity) - 1.0) < 0.04
    assert whole.speed_margin > 0.0 and whole.direction_margin > 0.0


def test_without_markers_the_motion_stays(known):
    hand = build_hand(known.motion, "left")
    far = known.trial.with_positions(known.trial.positions + [0.0, 5.0, 0.0])
    assert refine_hand(hand, far) is hand
