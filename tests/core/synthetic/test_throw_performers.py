"""Made throwers: alike from throw to throw, unlike each other, with bodies that keep their bones."""

import numpy as np

from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthetic.performers import ThrowManner, build_performer_throw, build_thrower, style_throw
from beyond_mocap.synthetic.throws import STYLES


def thrown(seed, speed=20.0, chance=5):
    return build_performer_throw(build_thrower(seed), (14.0, 0.0, 1.2), speed, np.random.default_rng(chance))


def test_the_same_seed_is_the_same_person():
    one, same, other = build_thrower(3), build_thrower(3), build_thrower(4)
    assert one.skeleton.has_same_bones(same.skeleton, 0.0) and one.manner == same.manner
    assert not one.skeleton.has_same_bones(other.skeleton) and one.manner != other.manner
    assert one.skeleton.names == other.skeleton.names
    assert 1.6 <= one.stature <= 2.0


def test_both_sides_of_a_body_are_alike():
    body = build_thrower(2).skeleton
    for joint, name in enumerate(body.names):
        if name.startswith("Left"):
            other = body.offsets[body.index("Right" + name[4:])]
            assert np.allclose(body.offsets[joint] * [1, -1, 1], other)


def test_the_unstyled_manner_at_full_effort_throws_as_the_table_does():
    style = style_throw(STYLES["overarm"], ThrowManner(), 1.0)
    for name in ("pelvis", "right_arm", "forearm", "left_foot", "right_foot"):
        assert np.allclose(np.array(getattr(style, name)), np.array(getattr(STYLES["overarm"], name)))


def test_throws_of_one_person_differ_less_than_those_of_two():
    first, again, other = (hand_way(thrown(*who)) for who in ((1, 20.0, 5), (1, 20.0, 6), (2, 20.0, 5)))
    assert 0.0 < np.abs(first - again).max() < np.abs(first - other).max()


def hand_way(made, fps=120.0):
    """Places (T, 3) of the hand against the hips within 0.6 s around the release."""
    body = identify_joints(made.motion.skeleton)
    places, _ = forward_kinematics(made.motion)
    frames = int(round(made.release * fps)) + np.arange(-36, 36)
    return places[frames, body.right.hand] - places[frames, body.hips]


def test_a_harder_throw_takes_a_longer_stride():
    toes = []
    for speed in (14.0, 24.0):
        made = thrown(1, speed)
        places, _ = forward_kinematics(made.motion)
        body = identify_joints(made.motion.skeleton)
        frame = int(made.release * 120)
        toes.append(np.linalg.norm(places[frame, body.left.toe] - places[0, body.right.toe]))
    assert toes[1] > toes[0] + 0.08
