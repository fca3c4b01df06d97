"""Bodies from joints: near the truth under noise and gaps, bones of fixed length, confusions repaired."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.cli.main import main
from beyond_mocap.files.bvh.bvh import read_bvh
from beyond_mocap.files.joints.joint_feed import JointFeed, PlayerJoints
from beyond_mocap.files.joints.landmarks import LANDMARKS
from beyond_mocap.library.build import build_library
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.skeleton import Skeleton
from beyond_mocap.skeletal import joint_examples
from beyond_mocap.skeletal.body_figures import list_fitted
from beyond_mocap.skeletal.bridge_gaps import bridge_gaps
from beyond_mocap.skeletal.joint_examples import COMPARED, find_root, mirror_joints, read_examples
from beyond_mocap.skeletal.reconstruct_bodies import KnownElsewhere, reconstruct_bodies
from beyond_mocap.skeletal.repair_joints import repair_identities, repair_sides, spread_landmarks
from beyond_mocap.skeletal.smooth_joints import fill_gaps, smooth_joints
from tests.core.joint_feeds import NAMES, SAMPLE, sample_joints, write_table


def add_noise(joints, metres, seed=1):
    """Noise whose distance has that root mean square."""
    return joints + np.random.default_rng(seed).normal(0.0, metres / np.sqrt(3.0), joints.shape)


def build_feed(people, fps, begin=0.0):
    return JointFeed(tuple(PlayerJoints(id=str(number), team="", landmarks=NAMES, positions=joints,
                                        times=begin + np.arange(len(joints)) / fps)
                           for number, joints in enumerate(people)), fps, ())


def measure_error(body, truth, frames=slice(None)):
    """Distances (T, K) m of the body's joints from the true ones."""
    fitted = list_fitted(NAMES, body.motion)
    places, _ = forward_kinematics(body.motion)
    return np.linalg.norm(places[:, list(fitted.values())] - truth[:, list(fitted)], axis=2)[frames]


def measure_tips(motion):
    """Heights (T, 2) m of the tips of the feet."""
    places, world = forward_kinematics(motion)
    body = identify_joints(motion.skeleton)
    return np.stack([(places[:, limb.toe] + quaternion.rotate(world[:, limb.toe], motion.skeleton.tip_offset(limb.toe))
                      )[:, 2] for limb in (body.left, body.right)], axis=1)


@pytest.mark.parametrize("clip", ["kick_low_inside", "walking_1_2", "jog_run_jog"])
@pytest.mark.parametrize(("fps", "noise", "most"), [(50.0, 0.0, 0.02), (50.0, 0.05, 0.03), (25.0, 0.05, 0.033),
                                                    (50.0, 0.10, 0.05)])
def test_joints_are_near_the_truth(clip, fps, noise, most):
    truth = sample_joints(clip, fps)
    (body,), notes = reconstruct_bodies(build_feed([add_noise(truth, noise)], fps))
    assert not notes and len(body.motion) == len(truth)
    assert measure_error(body, truth).mean() < most
    places, _ = forward_kinematics(body.motion)
    bones = [np.linalg.norm(places[:, joint] - places[:, parent], axis=1)
             for joint, parent in enumerate(body.motion.skeleton.parents) if parent >= 0]
    assert max(map(np.ptp, bones)) < 1e-9
    figures = body.measure()
    assert (measure_tips(body.motion) < -0.02).mean() < 0.01  # of stiff toes 8 %
    assert figures["slide_m_s"] < 0.13 and figures["jerk_m_s3"]["body"] < 1500.0  # raw: up to 90,000


def test_a_short_gap_is_filled_by_the_rest_of_the_body():
    truth = sample_joints("walking_1_2", 50.0)
    seen = add_noise(truth, 0.03)
    wrist, knee = NAMES.index("left_wrist"), NAMES.index("right_knee")
    seen[60:100, wrist] = np.nan
    seen[130:160, knee] = np.nan
    (body,), _ = reconstruct_bodies(build_feed([seen], 50.0))
    fitted = list(list_fitted(NAMES, body.motion))
    error = measure_error(body, truth)
    assert error[60:100, fitted.index(wrist)].mean() < 0.08 and error[130:160, fitted.index(knee)].mean() < 0.08


@pytest.mark.parametrize(("clip", "most"), [("run_stop_run", 0.065), ("jog_run_jog", 0.065)])
def test_a_gap_without_any_joint_is_bridged_as_others_move(clip, most, sample_cache):
    """0.8 s in which a third difference alone leads half a metre astray."""
    library = build_library(SAMPLE, cache_dir=sample_cache)
    others = replace(library, clips=tuple(one for one in library.clips if clip not in one.path))
    truth = sample_joints(clip, 50.0)
    seen, gap = add_noise(truth, 0.05), slice(len(truth) // 2 - 20, len(truth) // 2 + 20)
    seen[gap] = np.nan
    known = KnownElsewhere(examples=read_examples(others))
    (body,), _ = reconstruct_bodies(build_feed([seen], 50.0), known=known)
    assert measure_error(body, truth, gap).mean() < most
    (again,), _ = reconstruct_bodies(build_feed([seen], 50.0), known=known)
    assert again.motion.rotations.tobytes() == body.motion.rotations.tobytes()


@pytest.mark.parametrize("clip", ["walking_1_2", "jog_run_jog", "kick_low_inside"])
def test_heels_rise_where_toes_are_not_seen(clip):
    """Feet that follow their shanks have their balls more than 1 cm in the ground in 14 to 23 % of the frames."""
    truth = sample_joints(clip, 50.0)
    toes, ankles = ([NAMES.index(f"{side}_{part}") for side in ("left", "right")] for part in ("big_toe", "ankle"))
    seen = add_noise(truth, 0.05)
    seen[:, toes] = np.nan
    (body,), _ = reconstruct_bodies(build_feed([seen], 50.0))
    places, _ = forward_kinematics(body.motion)
    fitted = identify_joints(body.motion.skeleton)
    ball, ankle = (places[:, [getattr(limb, part) for limb in (fitted.left, fitted.right)], 2]
                   for part in ("toe", "foot"))
    lead = ball - ankle - truth[:, toes, 2] + truth[:, ankles, 2]
    assert np.abs(lead - np.median(lead, axis=0)).mean() < 0.013 and (ball < -0.01).mean() < 0.005


def test_a_part_of_a_large_library_has_both_twins_and_one_without_arms_is_refused(sample_cache, monkeypatch):
    library = build_library(SAMPLE, cache_dir=sample_cache)
    monkeypatch.setattr(joint_examples, "_MOST_FRAMES", len(library.frames) // 2)
    examples = read_examples(library)
    twins = np.split(examples.joints, np.unique(examples.first)[1:])
    assert 0.4 < len(examples.joints) / len(library.frames) < 0.6
    for own, twin in zip(twins[::2], twins[1::2], strict=True):
        assert np.allclose(mirror_joints(own), twin, atol=1e-4)
    legs = Skeleton(("hips", "lthigh", "lshin", "lfoot", "rthigh", "rshin", "rfoot"), (-1, 0, 1, 2, 0, 4, 5),
                    [(0, 0, 0.9), *(each for y in (0.1, -0.1) for each in ((0, y, 0), (0, 0, -0.4), (0, 0, -0.4)))])
    with pytest.raises(InputError, match="a skeleton without arms"):
        read_examples(SimpleNamespace(skeleton=legs, folder=SAMPLE))


@pytest.mark.parametrize("part", ["wrist", "elbow"])
def test_a_gap_between_glimpses_and_without_an_arm_is_smoothed_over_or_bridged(part):
    """Too short for examples of the person's own; and a limb that is seen on one side alone."""
    truth = sample_joints("walking_1_2", 50.0)
    seen = truth.copy()
    seen[:, NAMES.index(f"right_{part}")] = np.nan
    for length, gap in ((100, slice(35, 60)), (300, slice(140, 170))):
        hidden = seen[:length].copy()
        hidden[gap] = np.nan
        (body,), _ = reconstruct_bodies(build_feed([hidden], 50.0))
        assert np.isfinite(body.motion.rotations).all() and len(body.motion) == length


def test_a_gap_follows_where_another_tracking_has_the_person():
    truth = sample_joints("jogging_weave", 50.0)
    gap = np.arange(len(truth)) // 30 == 6
    column = [NAMES.index(name) for name in COMPARED]
    path = find_root(truth[:, column]) + (0.3, -0.2)  # of another point of the body
    path[gap] += (0.0, 0.3) * np.sin(np.linspace(0.0, np.pi, gap.sum()))[:, None]
    alone, led = (find_root(bridge_gaps(truth[:, column], gap, 50.0, None, line)) for line in (None, path))
    assert 0.1 < (led - alone)[gap, 1].max() < 0.3 and np.abs((led - alone)[gap, 0]).max() < 0.1
    assert np.array_equal(led[~gap], alone[~gap])


def test_a_joint_that_is_told_by_others_needs_no_line_through_its_gap():
    """A point that moves with others comes back through a gap in which it turned round."""
    time = np.arange(200) / 50.0
    others = np.stack([np.column_stack([np.sin(5 * time + phase), np.cos(3 * time + phase), 0 * time + phase])
                       for phase in range(5)], axis=1)
    own = 0.5 * others[:, 0] - 0.3 * others[:, 1]
    points = np.concatenate([others, own[:, None]], axis=1)
    gap = points.copy()
    gap[80:130, 5] = np.nan
    names = ("nose", "head", "neck", "left_knee", "right_knee", "left_wrist")
    assert np.abs(fill_gaps(names, gap) - points).max() < 0.05


def test_smoothing_keeps_an_even_swing_and_takes_the_noise():
    time = np.arange(300) / 50.0
    swing = 0.4 * np.sin(2 * np.pi * 1.5 * time)
    truth = np.stack([np.column_stack([swing, time, np.full(300, float(z))]) for z in range(4)], axis=1)
    names = ("left_hip", "right_hip", "left_knee", "right_knee")
    out = smooth_joints(names, add_noise(truth, 0.05))
    assert np.linalg.norm(out - truth, axis=2).mean() < 0.02
    assert np.abs(smooth_joints(names, truth) - truth).max() < 0.01


def test_exchanged_sides_are_repaired():
    truth = spread_landmarks(NAMES, sample_joints())
    other = {"left": "right", "right": "left"}
    mirrored = [LANDMARKS.index("_".join(other.get(word, word) for word in name.split("_"))) for name in LANDMARKS]
    confused = truth.copy()
    confused[40:55] = truth[40:55][:, mirrored]
    repaired, count = repair_sides(LANDMARKS, confused)
    assert count == 15 and np.array_equal(repaired, truth, equal_nan=True)
    assert repair_sides(LANDMARKS, truth)[1] == 0
    assert np.array_equal(repair_sides(LANDMARKS, truth[:, mirrored])[0], truth, equal_nan=True)


def test_exchanged_people_are_repaired():
    one = spread_landmarks(NAMES, sample_joints())
    people = np.stack([one, one + (2.0, 3.0, 0.0), one + (9.0, 0.0, 0.0)])
    confused = people.copy()
    confused[[0, 1], 30:80] = people[[1, 0], 30:80]
    repaired, swaps = repair_identities(confused)
    assert np.array_equal(repaired, people, equal_nan=True) and [frame for frame, *_ in swaps] == [30, 80]


def test_a_person_who_leaves_is_two_stretches_and_a_glimpse_none():
    joints = sample_joints()
    seen = joints.copy()
    seen[60:130] = np.nan
    bodies, notes = reconstruct_bodies(build_feed([seen, joints[:10]], 50.0, begin=100.0))
    assert [(body.id, body.start, len(body.motion)) for body in bodies][0] == ("0", 100.0, 60)
    assert bodies[1].start == pytest.approx(102.6) and "1: from 100.00 s left out, only 0.20 s" in notes


def test_half_the_joints_are_told(tmp_path, capsys):
    legs = [number for number, name in enumerate(NAMES) if "shoulder" not in name]
    path = write_table(tmp_path / "a.csv", {"7": sample_joints()[:, legs]}, 50.0, [NAMES[number] for number in legs])
    assert main(["bodies", "--joints", str(path), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert "left shoulder is hardly seen" in error and error.count("\n") == 1 and not (tmp_path / "out").exists()


def test_the_command_writes_a_body_for_each_person(tmp_path, capsys):
    people = {"7": add_noise(sample_joints(), 0.03), "A/9": sample_joints()[:80] + (5.0, 0.0, 0.0)}
    path = write_table(tmp_path / "a.csv", people, 50.0)
    assert main(["bodies", "--joints", str(path), "--out", str(tmp_path / "out")]) == 0
    assert "2 bodies, joints" in capsys.readouterr().out
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert [row["file"] for row in report["bodies"]] == ["7.bvh", "A_9.bvh"]
    assert report["bodies"][0]["joint_error_m"]["mean"] < 0.05 and report["bodies"][0]["team"] == "home"
    assert len(read_bvh(tmp_path / "out" / "7.bvh").motion) == len(people["7"])
    again = tmp_path / "again"
    assert main(["bodies", "--joints", str(path), "--out", str(again)]) == 0
    assert (again / "7.bvh").read_bytes() == (tmp_path / "out" / "7.bvh").read_bytes()
    assert main(["bodies", "--joints", str(path), "--out", str(again)]) == 2  # not over other files
    assert main(["bodies", "--joints", str(path), "--out", str(tmp_path / "new"), "--unit", "1"]) == 2  # of no library
