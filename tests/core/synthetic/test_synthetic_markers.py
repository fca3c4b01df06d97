"""Planted markers: the truth stays the recording's, and what is said to be done to the trial is done."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.motion import compute_pose, forward_kinematics
from beyond_mocap.synthetic.gait import build_gait
from beyond_mocap.synthetic.ground_truth.marker_places import SETS, compute_rigid_markers
from beyond_mocap.synthetic.ground_truth.synthetic_ball import BallRequest
from beyond_mocap.synthetic.ground_truth.synthetic_body import to_marker_axes
from beyond_mocap.synthetic.ground_truth.synthetic_markers import build_trial, measure_trial_error, mirror_trial
from beyond_mocap.synthetic.throws import build_throw


@pytest.fixture(scope="module")
def walk():
    return build_gait(1.4, 3.0, fps=100.0)


@pytest.fixture(scope="module")
def known(walk):
    return build_trial(walk, "driveline", seed=3, occlusion=0.05, swaps=2, jumps=4, unlabeled=2)


def test_joints_keep_their_places(walk):
    truth = to_marker_axes(walk)
    before, _ = forward_kinematics(walk)
    after, _ = forward_kinematics(truth)
    for side in ("Left", "Right"):
        for part in ("Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot", "ToeBase"):
            apart = before[:, walk.skeleton.index(side + part)] - after[:, truth.skeleton.index(side + part)]
            assert np.abs(apart).max() < 1e-6, side + part


def test_rests_in_a_t_pose_facing_x(walk):
    skeleton = to_marker_axes(walk).skeleton
    places, _ = compute_pose(skeleton, np.zeros((1, 3)), quaternion.identity(1, len(skeleton)))
    at = dict(zip(skeleton.names, places[0]))
    for side, sign in (("Left", 1.0), ("Right", -1.0)):
        upper, lower = at[side + "ForeArm"] - at[side + "Arm"], at[side + "Hand"] - at[side + "ForeArm"]
        for bone in (upper, lower):
            np.testing.assert_allclose(bone / np.linalg.norm(bone), [0.0, sign, 0.0], atol=1e-6)
        shank = at[side + "Foot"] - at[side + "Leg"]
        np.testing.assert_allclose(shank / np.linalg.norm(shank), [0.0, 0.0, -1.0], atol=1e-6)
        assert (at[side + "ToeBase"] - at[side + "Foot"])[0] > 0.05


def test_knees_and_elbows_bend_about_one_axis(walk):
    truth = to_marker_axes(walk)
    for joint, axis in (("LeftLeg", 1), ("RightLeg", 1)):
        bend = quaternion.to_rotation_vector(truth.rotations[:, truth.skeleton.index(joint)])
        assert np.abs(np.delete(bend, axis, axis=1)).max() < 0.02
        assert bend[:, axis].max() > 0.5


def test_wrists_do_not_twist(walk):
    truth = to_marker_axes(walk)
    hand = truth.rotations[:, truth.skeleton.index("RightHand")]
    assert np.abs(hand[:, 2]).max() < 1e-9


def test_markers_on_bone_are_rigid(walk):
    known = build_trial(walk, "plug_in_gait", noise=0.0, softness=0.0)
    np.testing.assert_allclose(known.trial.positions, compute_rigid_markers(known.motion, known.markers), atol=1e-12)
    for places in (known.trial.positions, known.static.positions):
        thigh = [known.trial.index_of(label) for label in ("LTHI", "LKNE")]
        apart = np.linalg.norm(places[:, thigh[0]] - places[:, thigh[1]], axis=1)
        assert np.ptp(apart) < 1e-9


def test_skin_shifts_thighs_more_than_feet(walk):
    known = build_trial(walk, "plug_in_gait", noise=0.0)
    off = np.linalg.norm(known.clean - compute_rigid_markers(known.motion, known.markers), axis=-1).max(axis=0)
    of = dict(zip(known.markers.labels, off))
    assert 0.004 < of["LTHI"] < 0.03 and of["LHEE"] < 0.006 and of["LFHD"] < 0.005


def test_faults_are_where_they_are_told(known):
    kinds = [fault.kind for fault in known.faults]
    assert kinds.count("swap") == 2 and kinds.count("jump") == 4 and kinds.count("unlabeled") == 2
    for fault in known.faults:
        frames = slice(fault.start, fault.stop)
        mine = [known.trial.index_of(label) for label in fault.labels]
        if fault.kind == "gap":
            assert np.isnan(known.trial.positions[frames, mine]).all()
        if fault.kind == "swap":
            np.testing.assert_array_equal(known.trial.positions[frames, mine], known.clean[frames, mine[::-1]])
        if fault.kind == "jump":
            stray = known.trial.positions[fault.start, mine[0]] - known.clean[fault.start, mine[0]]
            assert np.linalg.norm(stray) > 0.015
        if fault.kind == "unlabeled":
            np.testing.assert_array_equal(known.trial.positions[frames, mine[1]], known.clean[frames, mine[0]])
    gaps = sum(fault.stop - fault.start for fault in known.faults if fault.kind == "gap")
    assert 0.04 < gaps / known.clean[..., 0].size < 0.07


def test_all_else_is_untouched(known):
    touched = np.zeros(known.clean.shape[:2], bool)
    for fault in known.faults:
        for label in fault.labels:
            if not label.startswith("*"):
                touched[fault.start : fault.stop, known.trial.index_of(label)] = True
    own = known.trial.positions[:, : known.clean.shape[1]]
    np.testing.assert_array_equal(own[~touched], known.clean[~touched])


def test_same_seed_same_trial(walk):
    one, two, other = (build_trial(walk, seed=seed, occlusion=0.02).trial.positions for seed in (5, 5, 6))
    np.testing.assert_array_equal(one, two)
    assert not np.array_equal(one, other)


def test_static_stands_upright_with_all_markers(known):
    at = dict(zip(known.static.labels, known.static.positions.mean(axis=0)))
    assert known.static.visibility.all()
    assert at["LSHO"][1] > at["RSHO"][1] and at["LTOE"][0] > at["LHEE"][0] + 0.1
    assert 0.0 < at["LTOE"][2] < 0.08 and abs(at["C7"][2] - at["LSHO"][2]) < 0.06 and at["LFHD"][2] > at["C7"][2] + 0.15


def test_sprinter_takes_markers_off_after_the_static_trial(walk):
    known = build_trial(walk, "sprinter")
    assert set(known.static.labels) - set(known.trial.labels) == {"LMEPI", "RMEPI", "LMMAL", "RMMAL"}


@pytest.mark.parametrize("name", sorted(SETS))
def test_every_label_finds_its_place(walk, name):
    assert set(build_trial(walk, name).static.labels) == set(SETS[name])


def test_mirrors(known):
    trial = known.static
    assert mirror_trial(trial).positions[0, 0, 1] == -trial.positions[0, 0, 1]


def test_unknown_set_is_told(walk):
    with pytest.raises(InputError, match="plug_in_gait"):
        build_trial(walk, "nothing")


class TestBall:
    @pytest.fixture(scope="class")
    def thrown(self):
        made = build_throw((15.0, 1.0, 1.0), 24.0, fps=240.0)
        return made, build_trial(made.motion, "driveline", ball=BallRequest(made.release, spin_rate=20.0), noise=0.0)

    def test_leaves_with_the_hands_velocity_and_hits_the_target(self, thrown):
        made, known = thrown
        np.testing.assert_allclose(known.ball.position, made.position, atol=0.015)
        np.testing.assert_allclose(known.ball.velocity, made.velocity, atol=1.0)
        seconds = (15.0 - known.ball.position[0]) / known.ball.velocity[0]
        landed = known.ball.position + seconds * known.ball.velocity - [0, 0, 0.5 * 9.81 * seconds**2]
        assert np.linalg.norm(landed - [15.0, 1.0, 1.0]) < 0.8

    def test_marker_stays_on_the_surface(self, thrown):
        ball = thrown[1].ball
        np.testing.assert_allclose(np.linalg.norm(ball.marker - ball.places, axis=1), 0.0366, atol=1e-9)
        steps = np.linalg.norm(np.diff(ball.places, axis=0), axis=1) * 240.0
        assert np.abs(np.diff(steps)).max() < 3.0

    def test_falls_freely_after_release(self, thrown):
        made, known = thrown
        after = np.arange(len(known.motion)) / 240.0 > made.release + 0.01
        pull = np.diff(known.ball.places[after], 2, axis=0) * 240.0**2
        np.testing.assert_allclose(pull[:40], np.broadcast_to([0, 0, -9.81], (40, 3)), atol=1e-4)

    def test_is_seen_for_a_while(self, thrown):
        made, known = thrown
        seen = known.trial.visibility[:, known.trial.index_of("BALL")]
        assert seen[: int((made.release + 0.29) * 240)].all() and not seen[int((made.release + 0.32) * 240) :].any()

    def test_air_slows_it(self, thrown):
        made, _ = thrown
        slow = build_trial(made.motion, "lower_body", ball=BallRequest(made.release, drag=0.01)).ball
        free = build_trial(made.motion, "lower_body", ball=BallRequest(made.release)).ball
        frame = int((made.release + 0.3) * 240)
        flown = free.places[frame] - free.position
        assert 0.02 < np.linalg.norm(flown - (slow.places[frame] - slow.position)) / np.linalg.norm(flown) < 0.06

    def test_release_outside_is_told(self, thrown):
        with pytest.raises(InputError, match="release"):
            build_trial(thrown[0].motion, "lower_body", ball=BallRequest(60.0))


class TestError:
    def test_the_truth_has_none(self, known):
        error = measure_trial_error(known, known.motion)
        assert error.centre < 1e-9 and error.angle < 1e-6 and error.raw_angle < 1e-6

    def test_a_constant_turn_of_a_segments_axes_is_raw_error_only(self, known):
        skeleton = known.motion.skeleton
        leg = skeleton.index("LeftLeg")
        turned = known.motion.rotations.copy()
        twist = quaternion.from_axis_angle([0.0, 0.0, 1.0], 0.2)
        turned[:, leg] = quaternion.multiply(turned[:, leg], twist)
        foot = skeleton.index("LeftFoot")
        turned[:, foot] = quaternion.multiply(quaternion.inverse(twist), turned[:, foot])
        error = measure_trial_error(known, replace(known.motion, rotations=turned))
        assert abs(error.raw["LeftLeg"] - 0.2) < 1e-6 and error.angles["LeftLeg"] < 1e-6

    def test_shift_and_wobble_are_measured(self, known):
        moved = replace(known.motion, root_positions=known.motion.root_positions + [0.003, 0.004, 0.0])
        assert abs(measure_trial_error(known, moved).centre - 0.005) < 1e-9
        knee = known.motion.skeleton.index("RightLeg")
        turned = known.motion.rotations.copy()
        sway = 0.1 * np.where(np.arange(len(turned)) % 2, 1.0, -1.0)
        turned[:, knee] = quaternion.multiply(turned[:, knee], quaternion.from_axis_angle([0.0, 1.0, 0.0], sway))
        assert abs(measure_trial_error(known, replace(known.motion, rotations=turned)).angles["RightLeg"] - 0.1) < 0.002
