"""Made kickers: alike from kick to kick, unlike each other."""

import numpy as np

from beyond_mocap.motion.retargeting.neutral import build_neutral_stance
from beyond_mocap.synthetic.kicks import BEFORE, KICKS, build_kick, compute_contacts
from beyond_mocap.synthetic.performers import KickManner, build_kicker, style_kick, vary_kick


def test_the_same_seed_is_the_same_person():
    one, same, other = build_kicker(3), build_kicker(3), build_kicker(4)
    assert one.skeleton.has_same_bones(same.skeleton, 0.0) and one.manner == same.manner
    assert not one.skeleton.has_same_bones(other.skeleton) and one.manner != other.manner


def test_the_unstyled_manner_at_full_effort_kicks_as_the_table_does():
    for base in KICKS.values():
        style = style_kick(base, KickManner(), 1.0)
        for name in ("leg", "pelvis", "spine", "left_arm", "strides"):
            assert np.allclose(np.array(getattr(style, name)), np.array(getattr(base, name)))


def test_a_harder_kick_swings_further_back_and_faster():
    who = build_kicker(1)
    feet = []
    for speed in (13.0, 22.0):
        style = vary_kick(who, KICKS["instep"], speed, np.random.default_rng(1))
        feet.append(
            np.linalg.norm(compute_contacts(style, build_neutral_stance(who.skeleton), "right", [(0.0, 0.0)])[1][0],
                           axis=1).max()
        )
    assert feet[1] > feet[0]


def test_the_contact_told_is_the_one_of_the_whole_kick():
    neutral = build_neutral_stance(build_kicker(2).skeleton)
    ends = compute_contacts(KICKS["instep"], neutral, "left", [(0.0, 0.0), (0.03, 4.0)])[0][1]
    motion = build_kick(KICKS["instep"], neutral, "left", 0.03, 4.0, fps=480.0)
    from beyond_mocap.motion.humanoid import identify_joints
    from beyond_mocap.motion.motion import forward_kinematics

    places, _ = forward_kinematics(motion)
    limb = identify_joints(motion.skeleton).left
    assert np.abs(places[int(BEFORE * 480), [limb.foot, limb.toe]] - ends).max() < 2e-4
