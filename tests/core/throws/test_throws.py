"""Throws measured and compared: his p-values come back from his own tables, planted deviations and impacts as
planted."""

import numpy as np
import pytest

from beyond_mocap.ball.physics import BASEBALL, PAPER
from beyond_mocap.evaluation.paired_tests import compare_differences, find_inliers
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.synthetic.throws import build_throw
from beyond_mocap.throws.evaluate_throws import find_impact, measure_deviations, release_ball

# Fredriksson's tables 8.1, 8.2, 8.5, 8.6 (m: left arm, right arm, left leg, right leg, impact; a row for each subject)
SINGLE = np.array([
    [0.1597, 0.1433, 0.0814, 0.0915, 2.034], [0.1263, 0.1001, 0.0816, 0.0798, 2.054],
    [0.2120, 0.1950, 0.1331, 0.1444, 3.975], [0.1677, 0.1420, 0.1014, 0.1312, 1.456],
])  # fmt: skip
HIERARCHY_RAW = np.array([
    [0.0728, 0.0639, 0.0323, 0.0328, 2.007], [0.0511, 0.0496, 0.0266, 0.0275, 2.542],
    [0.0992, 0.0962, 0.0483, 0.0427, 2.181], [0.0767, 0.0574, 0.0452, 0.0400, 1.819],
])  # fmt: skip
FEED_FORWARD = np.array([
    [0.0662, 0.0612, 0.0415, 0.0493, 1.654], [0.0706, 0.0875, 0.0409, 0.0360, 2.226],
    [0.1106, 0.0817, 0.0507, 0.0431, 1.985], [0.0881, 0.0760, 0.0406, 0.0594, 1.252],
])  # fmt: skip
HIERARCHY = np.array([
    [0.0525, 0.0505, 0.0178, 0.0219, 0.831], [0.0391, 0.0410, 0.0175, 0.0157, 0.705],
    [0.0714, 0.0818, 0.0380, 0.0227, 0.867], [0.0583, 0.0451, 0.0291, 0.0217, 0.861],
])  # fmt: skip
# 8.3 with 8.4, and 8.7 with 8.8: differences, their mean, spread, p
FIRST = (
    np.array([[-0.0869, -0.0794, -0.0492, -0.0587, -0.0273], [-0.0751, -0.0506, -0.0551, -0.0523, 0.4873],
              [-0.1128, -0.0988, -0.0848, -0.1017, -1.7758], [-0.0909, -0.0846, -0.0563, -0.0912, 0.3626]]),
    np.array([-0.0914, -0.0784, -0.0613, -0.0760, -0.2383]), np.array([0.0136, 0.0175, 0.0138, 0.0209, 0.9077]),
    np.array([0.0007, 0.0022, 0.0023, 0.0040, np.nan]),
)  # fmt: skip
SECOND = (
    np.array([[-0.0138, -0.0106, -0.0244, -0.0275, -0.8235], [-0.0315, -0.0465, -0.0248, -0.0177, -1.5209],
              [-0.0393, 0.0001, -0.0119, -0.0211, -1.1184], [-0.0299, -0.0309, -0.0109, -0.0357, -0.3909]]),
    np.array([-0.0286, -0.0220, -0.0178, -0.0264, -0.9634]), np.array([0.0093, 0.0180, 0.0058, 0.0071, 0.4130]),
    np.array([0.0064, 0.0625, 0.0064, 0.0038, 0.0136]),
)  # fmt: skip


@pytest.mark.parametrize("old, new, printed", [(SINGLE, HIERARCHY_RAW, FIRST), (FEED_FORWARD, HIERARCHY, SECOND)])
def test_his_p_values_come_back_from_his_tables(old, new, printed):
    _, mean, spread, p = printed
    for k, one in enumerate(map(compare_differences, (new - old).T)):
        slack = 0.02 if k == 4 else 2e-4  # the impact of subject 3 in table 8.4 is not that of 8.1 and 8.2
        assert one.mean == pytest.approx(mean[k], abs=slack)
        assert one.spread == pytest.approx(spread[k], abs=slack)
        assert one.test == "t"
        if np.isfinite(p[k]):
            assert one.p == pytest.approx(p[k], rel=0.02, abs=6e-5)


def test_his_p_values_come_back_from_his_differences_but_for_the_left_leg_of_8_7():
    for (differences, _, _, p), wrong in ((FIRST, ()), (SECOND, (2,))):
        for k in range(5):
            one = compare_differences(differences[:, k])
            if np.isfinite(p[k]):
                assert (one.p == pytest.approx(p[k], abs=1.1e-4)) == (k not in wrong)


def test_planted_differences_are_found_and_none_where_there_are_none():
    rng = np.random.default_rng(3)
    old = rng.normal(0.1, 0.02, 12)
    better = compare_differences(old - 0.01 + rng.normal(0.0, 0.004, 12) - old)
    assert better.p < 0.025 and better.test == "t" and better.mean < 0.0
    assert compare_differences(old + 0.01 + rng.normal(0.0, 0.004, 12) - old).p > 0.025
    assert np.isnan(compare_differences(old - old).p)
    chances = [compare_differences(rng.normal(0.0, 1.0, 4)).t_p < 0.025 for _ in range(400)]
    assert 0.005 < np.mean(chances) < 0.05


def test_ranks_stand_in_where_normality_is_rejected():
    off = -np.array([1.0, 1.1, 0.9, 1.05, 0.95, 1.0, 1.02, 40.0])
    one = compare_differences(off)
    assert one.normal < 0.05 and one.test == "Wilcoxon" and one.p == one.wilcoxon_p == one.least_p == 2.0**-8
    assert one.p < 0.025 and not np.isclose(one.t_p, one.p)
    few = compare_differences(np.array([-1.0, -1.0001, -1.0002, -9.0]))
    assert few.test == "Wilcoxon" and few.least_p == 0.0625 and few.p > 0.025


def test_throws_beyond_three_standard_deviations_are_left_out():
    values = np.array([*np.full(30, 0.5) + np.linspace(0.0, 0.1, 30), 9.0, np.nan])
    assert find_inliers(values).tolist() == [True] * 30 + [False, False]
    assert find_inliers(np.array([0.0] * 9 + [100.0])).all()  # ten can have none beyond three
    assert not find_inliers(np.array([np.nan])).any()


def test_planted_deviations():
    wanted = np.random.default_rng(0).normal(size=(20, 4, 3))
    off = np.array([0.01, 0.02, 0.03, 0.04])[:, None] * [0.6, 0.0, 0.8]
    assert measure_deviations(wanted + off, wanted) == pytest.approx([0.01, 0.02, 0.03, 0.04])


def hand_and_grip(made):
    return identify_joints(made.motion.skeleton).right.hand, made.grip


def test_a_ball_is_let_go_with_its_own_velocity_even_at_30_frames_a_second():
    # the hand turns by up to 140 degrees from one of 30 frames a second to the next
    for fps, slack, off in ((240.0, 0.01, 0.003), (30.0, 0.045, 0.01)):
        made = build_throw((18.0, 0.0, 1.0), 25.0, fps=fps)
        place, velocity = release_ball(made.motion, *hand_and_grip(made), made.release * fps)
        assert np.linalg.norm(place - made.position) < off
        assert np.linalg.norm(velocity - made.velocity) < slack * 25.0


def test_floating_hands_carry_the_ball_along():
    made = build_throw((18.0, 0.0, 1.0), 25.0, fps=60.0)
    joint, grip = hand_and_grip(made)
    times = np.arange(len(made.motion))[:, None] / 60.0
    at = made.release * 60.0
    place, velocity = release_ball(made.motion, joint, grip, at)
    other, faster = release_ball(made.motion, joint, grip, at, times * [0.0, 2.0, -1.0] + [0.1, 0.0, 0.0])
    assert faster - velocity == pytest.approx([0.0, 2.0, -1.0], abs=1e-6)
    assert other - place == pytest.approx(
        np.array([0.1, 0.0, 0.0]) + made.release * np.array([0.0, 2.0, -1.0]), abs=1e-6
    )


def test_impact_is_where_the_plane_is_crossed_or_the_ground_met():
    vacuum = type(PAPER)("vacuum", 0.04, 0.1)
    found = find_impact((0.0, 0.0, 2.0), (20.0, 0.0, 1.0), (4.0, 0.0, 1.0), vacuum)
    assert found == pytest.approx([4.0, 0.0, 2.0 + 0.2 - 0.5 * 9.8 * 0.04], abs=2e-4)
    fall = np.sqrt(2.0 * 1.96 / 9.8)
    found = find_impact((0.0, 0.0, 2.0), (2.0, 0.5, 0.0), (4.0, 0.0, 1.0), vacuum)
    assert found == pytest.approx([2.0 * fall, 0.5 * fall, 0.04], abs=2e-4)
    found = find_impact((1.0, 1.0, 1.8), (0.0, 15.0, 2.0), (1.0, 5.0, 9.0), vacuum)
    assert found == pytest.approx([1.0, 5.0, 1.8 + 2.0 * 4 / 15 - 4.9 * (4 / 15) ** 2], abs=2e-4)


def test_a_made_throw_hits_what_it_was_aimed_at():
    made = build_throw((4.0, 0.3, 1.2), 16.0, fps=60.0)
    vacuum = type(BASEBALL)("vacuum", 0.0366, 0.145, 9.81)
    found = find_impact(*release_ball(made.motion, *hand_and_grip(made), made.release * 60.0), (4.0, 0.3, 1.2), vacuum)
    assert np.linalg.norm(found - (4.0, 0.3, 1.2)) < 0.05
