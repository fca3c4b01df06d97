"""A model of throws measured on motions: planted results of the generator come out as planted figures."""

import re
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError, UserCancelledError
from beyond_mocap.files.tables import to_plain
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.synthetic.throws import build_throw
from beyond_mocap.throws import evaluate_throws as recipe
from beyond_mocap.throws.evaluate_throws import FULL_OPTIONS, RAW_OPTIONS, evaluate_throws, select_of_each
from beyond_mocap.throws.networks.chains import find_chains
from beyond_mocap.throws.networks.example import build_example, mirror_example
from beyond_mocap.throws.networks.generate import GeneratedMotion
from beyond_mocap.throws.networks.limits import estimate_joint_limits
from beyond_mocap.throws.throws_page import build_throws_page, draw_strip


class Model:
    """As much of a model as is asked for here."""

    def __init__(self, example):
        self.skeleton, self.stature = example.motion.skeleton, example.stature
        self.joint_limits, self.examples = estimate_joint_limits(example.motion.rotations), (example,)


@pytest.fixture(scope="module")
def examples():
    out = []
    for subject, size in (("ann", 1.0), ("bob", 1.1)):
        bones = build_adult_skeleton()
        bones = replace(bones, offsets=bones.offsets * size, end_offsets=bones.end_offsets * size)
        for number, far in enumerate((8.0, 14.0)):
            made = build_throw((far, 1.0, 1.0), 20.0, skeleton=bones, fps=120.0)
            out.append(
                build_example(f"{subject}{number}", subject, made.motion, "right_hand", made.release, (far, 1.0, 1.0))
            )
    return out


def generating(monkeypatch, by):
    """Has the generator make `by(example)`, the motions in the order of the examples."""
    made = iter(by)

    def generate(model, description, options=None):
        motion, off = next(made)
        places = forward_kinematics(motion)[0][:, list(find_chains(motion.skeleton).effectors)]
        nothing = np.zeros((len(motion), len(motion.skeleton)))
        return GeneratedMotion(motion=motion, effectors=places, predicted=places + off, requested=description.effectors,
                               over=nothing, floating=None, iterations=3, seconds=0.05)

    monkeypatch.setattr(recipe, "generate_motion", generate)


def test_the_truth_is_off_by_nothing(examples, monkeypatch):
    own = [*examples[:2], mirror_example(examples[0])]
    generating(monkeypatch, [(example.motion, 0.0) for example in own])
    found = evaluate_throws(Model(own[0]), own)
    for one in found.motions:
        assert one.deviation == pytest.approx(np.zeros(4), abs=1e-9)
        assert one.impact == pytest.approx(0.0, abs=1e-9) == one.far_impact and one.head == pytest.approx(0.0, abs=1e-6)
        assert one.facing == pytest.approx(0.0, abs=1e-9) and one.head_mean > 5.0  # a thrower looks about
        assert one.jerk == pytest.approx(1.0) and one.head_share == pytest.approx(1.0) and one.bones == 0.0
        assert one.own_impact < 0.15  # the drag that the planted throw knows nothing of
    assert found.motions[0].beyond == 0.0
    left, right = found.motions[2], found.motions[0]  # of those who use the other side the mean head is mirrored
    assert left.head_mean == pytest.approx(right.head_mean, abs=1e-6)


def test_what_is_planted_comes_out(examples, monkeypatch):
    example = examples[0]
    motion = example.motion
    moved = replace(motion, root_positions=motion.root_positions + [0.0, 0.03, 0.04])
    head = identify_joints(motion.skeleton).head
    rotations = motion.rotations.copy()
    rotations[:, head] = quaternion.multiply(
        rotations[:, head], quaternion.from_axis_angle([0.0, 0.0, 1.0], np.radians(20.0))
    )
    stiff = motion.rotations.copy()
    stiff[:, head] = stiff[0, head]
    generating(monkeypatch, [(moved, 0.02), (replace(motion, rotations=rotations), 0.0),
                             (replace(motion, rotations=stiff), 0.0)])
    found = evaluate_throws(Model(example), [example] * 3, RAW_OPTIONS)
    assert found.deviations[0] == pytest.approx(np.full(4, 0.05))
    assert found.motions[0].network == pytest.approx(np.full(4, np.linalg.norm([0.02, 0.05, 0.06])))
    assert 0.045 < found.impacts[0] < 0.06 and 0.045 < found.motions[0].far_impact < 0.06
    assert found.motions[1].head == pytest.approx(20.0) and found.motions[1].impact == pytest.approx(0.0, abs=1e-9)
    assert found.motions[2].head_share < 0.7


def test_others_are_scaled_by_height(examples, monkeypatch):
    ann, bob = examples[0], examples[2]
    motion = bob.motion
    smaller = replace(motion, skeleton=ann.motion.skeleton, root_positions=motion.root_positions / 1.1)
    generating(monkeypatch, [(smaller, 0.0), (smaller, 0.0)])
    model = Model(ann)
    found = evaluate_throws(model, [bob])
    assert found.deviations[0] == pytest.approx(np.zeros(4), abs=1e-3) and found.impacts[0] < 0.02
    assert evaluate_throws(model, [bob], by_height=False).deviations[0].min() > 0.02


def test_kicks_have_no_impact_and_failures_are_told(examples, monkeypatch):
    kick = replace(examples[0], limb=3)
    generating(monkeypatch, [(kick.motion, 0.0)])
    found = evaluate_throws(Model(kick), [kick])
    assert np.isnan(found.impacts).all() and to_plain(found.build_report())["impact_m"] is None

    monkeypatch.setattr(recipe, "generate_motion", fails)
    none = evaluate_throws(Model(kick), [kick])
    assert none.motions == () and none.left_out == (f"{kick.name}: description: 25 frames per second",)
    with pytest.raises(UserCancelledError):
        evaluate_throws(Model(kick), [kick], cancelled=lambda: True)


def fails(*_, **__):
    raise InputError("description", "25 frames per second")


def test_some_of_each_subject(examples):
    assert [e.name for e in select_of_each(examples, 1)] == ["ann0", "bob0"]
    assert select_of_each(examples, None) == examples and len(select_of_each(examples, 9)) == 4


def test_the_report_and_its_page(examples, monkeypatch):
    named = replace(examples[0], name="<b>one", subject="ann & bob")
    generating(monkeypatch, [(named.motion, 0.01)])
    report = to_plain({"model": "w<x>.npz", "trained_on": "ann",
                       **evaluate_throws(Model(named), [named], FULL_OPTIONS).build_report()})
    assert report["deviation_m"]["left_hand"] == pytest.approx(0.0, abs=1e-9)
    assert report["network_deviation_m"]["right_foot"] == pytest.approx(0.01 * 3**0.5)
    page = build_throws_page(report)
    assert "<b>one" not in page and "&lt;b&gt;one" in page and ">1.73<" in page and "ann &amp; bob" in page
    assert ">5.53<" in page  # cm, his mean of the left arm in table 8.6
    assert page.count("<circle") == 8 and "NaN" not in page and ">nan" not in page


def test_a_page_leaves_out_what_nothing_was_measured_of(examples, monkeypatch):
    kick = replace(examples[0], limb=3)
    generating(monkeypatch, [(kick.motion, 0.01)])
    raw = build_throws_page(to_plain(evaluate_throws(Model(kick), [kick], RAW_OPTIONS).build_report()))
    assert "wall" not in raw and "impact" not in raw and "by the networks alone" in raw
    assert raw.count("<circle") == 4  # nothing was corrected: one line for each hand and foot
    monkeypatch.setattr(recipe, "generate_motion", fails)
    empty = build_throws_page(to_plain(evaluate_throws(Model(kick), [kick]).build_report()))
    assert "<svg" not in empty and "No motions" in empty and "25 frames per second" in empty


def test_all_dots_lie_on_their_axis():
    made = draw_strip([("one", "network", [(0.0, "a"), (7000.0, "b"), (2.9, "c")])], 3.0, "cm")
    across = [float(x) for x in re.findall(r'cx="([-0-9.]+)"', made)]
    assert across[0] == 210.0 and 210.0 < across[2] < across[1] <= 890.0
