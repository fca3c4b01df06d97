"""Throws measured and compared: his p-values come back from his own tables, planted deviations and impacts as
planted."""

import numpy as np
import pytest

from beyond_mocap.ball.physics import BASEBALL, PAPER
from beyond_mocap.evaluation.throws import fredriksson
from beyond_mocap.evaluation.throws.compare import compared, detectable, judged, kept, sidak
from beyond_mocap.evaluation.throws.deviation import deviations
from beyond_mocap.evaluation.throws.impact import impact, let_go
from beyond_mocap.evaluation.throws.subjects import comparisons, gathered
from beyond_mocap.evaluation.throws.tables import figure_table, test_table as rows_of_tests, verdicts
from beyond_mocap.motion.humanoid import identify
from beyond_mocap.motion.throws import throw


@pytest.mark.parametrize("old, new, printed", fredriksson.EXPERIMENTS.values(), ids=fredriksson.EXPERIMENTS)
def test_his_p_values_come_back_from_his_tables(old, new, printed):
    found = comparisons(new, old)
    for k, one in enumerate(found):
        slack = 0.02 if k == 4 else 2e-4  # the impact of subject 3 in table 8.4 is not that of 8.1 and 8.2
        assert one.mean == pytest.approx(printed.mean[k], abs=slack)
        assert one.spread == pytest.approx(printed.spread[k], abs=slack)
        assert one.test == "t"
        if np.isfinite(printed.p[k]):
            assert one.p == pytest.approx(printed.p[k], rel=0.02, abs=6e-5)
            assert one.rejected == (printed.p[k] < 0.025)


def test_his_p_values_come_back_from_his_differences_but_for_the_left_leg_of_8_7():
    for printed, wrong in ((fredriksson.FIRST, ()), (fredriksson.SECOND, (2,))):
        for k in range(5):
            one = judged(printed.differences[:, k])
            if np.isfinite(printed.p[k]):
                assert (one.p == pytest.approx(printed.p[k], abs=1.1e-4)) == (k not in wrong)


def test_where_his_tables_disagree_is_told():
    lines = fredriksson.disagreements()
    assert len(lines) == 8
    assert "tables 8.3, 8.4, subject 3, impact: printed -1.7758, by the figures -1.7940" in lines
    assert sum("8.7" in line and "leg" in line for line in lines) == 7


def test_planted_differences_are_found_and_none_where_there_are_none():
    rng = np.random.default_rng(3)
    old = rng.normal(0.1, 0.02, 12)
    better = compared(old - 0.01 + rng.normal(0.0, 0.004, 12), old)
    assert better.rejected and better.test == "t" and better.mean < 0.0
    assert not compared(old + 0.01 + rng.normal(0.0, 0.004, 12), old).rejected
    assert np.isnan(compared(old, old).p)
    chances = [judged(rng.normal(0.0, 1.0, 4)).t_p < 0.025 for _ in range(400)]
    assert 0.005 < np.mean(chances) < 0.05


def test_ranks_stand_in_where_normality_is_rejected():
    off = -np.array([1.0, 1.1, 0.9, 1.05, 0.95, 1.0, 1.02, 40.0])
    one = judged(off)
    assert one.normal < 0.05 and one.test == "Wilcoxon" and one.p == one.wilcoxon_p == one.least_p == 2.0**-8
    assert one.rejected and not np.isclose(one.t_p, one.p)
    few = judged(np.array([-1.0, -1.0001, -1.0002, -9.0]))
    assert few.test == "Wilcoxon" and few.least_p == 0.0625 and not few.rejected


def test_pairs_without_figures_are_left_out():
    one = compared(np.array([1.0, np.nan, 3.0]), np.array([2.0, 2.0, 5.0]))
    assert one.differences.tolist() == [-1.0, -2.0] and np.isnan(one.normal)
    assert np.isnan(compared(np.array([np.nan]), np.array([1.0])).mean)


def test_levels_and_power():
    assert sidak() == pytest.approx(0.0253, abs=5e-5)
    normal, student = detectable(4)
    assert normal == pytest.approx(1.62, abs=0.005)  # his figure: by the normal distribution
    assert student == pytest.approx(2.57, abs=0.1)


def test_throws_beyond_three_standard_deviations_are_left_out():
    values = np.array([*np.full(30, 0.5) + np.linspace(0.0, 0.1, 30), 9.0, np.nan])
    assert kept(values).tolist() == [True] * 30 + [False, False]
    assert kept(np.array([0.0] * 9 + [100.0])).all()  # ten can have none beyond three
    assert not kept(np.array([np.nan])).any()


def test_planted_deviations():
    wanted = np.random.default_rng(0).normal(size=(20, 4, 3))
    off = np.array([0.01, 0.02, 0.03, 0.04])[:, None] * [0.6, 0.0, 0.8]
    assert deviations(wanted + off, wanted) == pytest.approx([0.01, 0.02, 0.03, 0.04])


def hand_and_grip(made):
    return identify(made.motion.skeleton).right.hand, made.grip


def test_a_ball_is_let_go_with_its_own_velocity_even_at_30_frames_a_second():
    for fps, slack in ((240.0, 0.01), (30.0, 0.03)):
        made = throw((18.0, 0.0, 1.0), 25.0, fps=fps)
        place, velocity = let_go(made.motion, *hand_and_grip(made), made.release * fps)
        assert np.linalg.norm(place - made.position) < 0.01
        assert np.linalg.norm(velocity - made.velocity) < slack * 25.0


def test_floating_hands_carry_the_ball_along():
    made = throw((18.0, 0.0, 1.0), 25.0, fps=60.0)
    joint, grip = hand_and_grip(made)
    times = np.arange(len(made.motion))[:, None] / 60.0
    at = made.release * 60.0
    place, velocity = let_go(made.motion, joint, grip, at)
    other, faster = let_go(made.motion, joint, grip, at, times * [0.0, 2.0, -1.0] + [0.1, 0.0, 0.0])
    assert faster - velocity == pytest.approx([0.0, 2.0, -1.0], abs=1e-6)
    assert other - place == pytest.approx(
        np.array([0.1, 0.0, 0.0]) + made.release * np.array([0.0, 2.0, -1.0]), abs=1e-6
    )


def test_impact_is_where_the_plane_is_crossed_or_the_ground_met():
    vacuum = type(PAPER)("vacuum", 0.04, 0.1)
    found = impact((0.0, 0.0, 2.0), (20.0, 0.0, 1.0), (4.0, 0.0, 1.0), vacuum)
    assert found == pytest.approx([4.0, 0.0, 2.0 + 0.2 - 0.5 * 9.8 * 0.04], abs=2e-4)
    fall = np.sqrt(2.0 * 1.96 / 9.8)
    found = impact((0.0, 0.0, 2.0), (2.0, 0.5, 0.0), (4.0, 0.0, 1.0), vacuum)
    assert found == pytest.approx([2.0 * fall, 0.5 * fall, 0.04], abs=2e-4)
    found = impact((1.0, 1.0, 1.8), (0.0, 15.0, 2.0), (1.0, 5.0, 9.0), vacuum)
    assert found == pytest.approx([1.0, 5.0, 1.8 + 2.0 * 4 / 15 - 4.9 * (4 / 15) ** 2], abs=2e-4)


def test_a_made_throw_hits_what_it_was_aimed_at():
    made = throw((4.0, 0.3, 1.2), 16.0, fps=60.0)
    vacuum = type(BASEBALL)("vacuum", 0.0366, 0.145, 9.81)
    found = impact(*let_go(made.motion, *hand_and_grip(made), made.release * 60.0), (4.0, 0.3, 1.2), vacuum)
    assert np.linalg.norm(found - (4.0, 0.3, 1.2)) < 0.05


def test_each_difference_stands_in_its_own_subjects_row():
    ways = []
    for name, off in (("new", 0.0), ("old", 0.01)):
        rows = [(who, np.full((12, 4), 0.1 * k + off), np.full(12, np.nan)) for k, who in enumerate("abc", 1)]
        ways.append(gathered(name, [("a", np.full((12, 4), 9.0), np.full(12, np.nan)), *rows[1:]]))
    rows = {line.split(" | ")[0].strip("| "): line for line in rows_of_tests(*ways)}
    assert "| - | - | - | - | - |" in rows["a"]  # lost all its bodies
    assert "-0.0100 | -0.0100 | -0.0100 | -0.0100 | - |" in rows["b"]
    assert "-0.0100" in rows["c"] and "-0.0100" in rows["avg."]


def test_tables_are_written():
    rng = np.random.default_rng(1)
    rows = [(name, rng.uniform(0.02, 0.05, (20, 4)), np.append(rng.uniform(0.5, 1.0, 19), 50.0)) for name in "abcd"]
    ours = gathered("ours", rows)
    worse = gathered("worse", [(name, d + rng.uniform(0.01, 0.03), np.full(20, np.nan)) for name, d, _ in rows])
    assert ours.culled.tolist() == [1] * 4 and np.all(ours.impact < 1.0) and np.isnan(worse.impact).all()
    text = "\n".join(figure_table(ours, fredriksson.HIERARCHY) + rows_of_tests(ours, worse, fredriksson.SECOND))
    assert "| his 1 | 0.0525 |" in text and "| his p | 0.0064 |" in text and "1 of 20" in text
    assert "better at 0.025 in none" not in verdicts(ours, worse)[0]
