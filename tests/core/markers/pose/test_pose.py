"""The pose in every frame: planted markers give the planted motion back."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError, UserCancelledError
from beyond_mocap.markers.model.model import MarkerModel, build_freedom
from beyond_mocap.markers.pose import pose
from beyond_mocap.markers.pose.pose import HeldBall, PoseSettings, solve_poses
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthetic.gait import build_gait
from beyond_mocap.synthetic.ground_truth.synthetic_markers import build_trial


def model_of(known):
    """The true model of planted markers."""
    skeleton, markers = known.motion.skeleton, known.markers
    kept = [markers.labels.index(label) for label in known.trial.labels]
    joint, places = np.array(markers.joint)[kept], np.array(markers.places)[kept]
    counts = {name: int(np.sum(joint == index)) for index, name in enumerate(skeleton.names)}
    freedom, stiffness = build_freedom(skeleton.names, skeleton.parents, counts)
    usual, unsure = np.full(len(kept), 0.005), np.full(len(skeleton), 0.01)
    return MarkerModel(skeleton=skeleton, markers=known.trial.labels, joint=joint, places=places, sigma=usual,
                       edge_sigma=np.full(len(kept), 0.03), freedom=freedom, stiffness=stiffness, centre_sigma=unsure)


@pytest.fixture(scope="module")
def run():
    """A run of two seconds with markers on bone, seen exactly."""
    return build_trial(build_gait(3.0, 2.0, fps=100.0), "driveline", seed=1, noise=0.0, softness=0.0)


@pytest.fixture(scope="module")
def soft():
    """The same with skin, noise and hidden markers."""
    return build_trial(build_gait(3.0, 2.0, fps=100.0), "driveline", seed=1, occlusion=0.05)


def joint_errors(known, solved):
    """How far joints lie from the true ones, (T, J) m, where markers tell: without toes."""
    told = [i for i, name in enumerate(known.motion.skeleton.names) if "Toe" not in name]
    return np.linalg.norm(forward_kinematics(solved.motion)[0] - known.centres, axis=-1)[:, told]


def world_errors(known, solved, part):
    """Degrees between the true and the solved world rotations of joints whose name ends so."""
    told = [i for i, name in enumerate(known.motion.skeleton.names) if name.endswith(part)]
    a, b = (forward_kinematics(motion)[1][:, told] for motion in (known.motion, solved.motion))
    return np.degrees(np.linalg.norm(
        quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(a), b)), axis=-1))


def test_markers_on_bone_give_the_motion_back(run):
    solved = solve_poses(model_of(run), run.trial)
    assert np.sqrt(np.mean(joint_errors(run, solved) ** 2)) < 1e-3
    assert np.nanmax(solved.residual) < 2e-3 and np.nanmean(solved.residual) < 3e-4
    assert max(world_errors(run, solved, part).max() for part in ("Hips", "UpLeg", "ForeArm", "Head")) < 1.0
    assert solved.iterations.min() > 0


def test_skin_and_hidden_markers_are_borne(soft):
    solved = solve_poses(model_of(soft), soft.trial)
    assert np.sqrt(np.mean(joint_errors(soft, solved) ** 2)) < 6e-3
    assert np.isnan(solved.residual).sum() == np.isnan(soft.trial.positions[..., 0]).sum()
    # one segment alone is laid nearer to its own markers than the whole chain can be
    both = np.isfinite(solved.single)
    assert solved.single[both].mean() < solved.residual[both].mean() < 6e-3


def test_the_same_input_gives_the_same_bits(soft):
    model = model_of(soft)
    one, two = solve_poses(model, soft.trial), solve_poses(model, soft.trial)
    assert np.array_equal(one.motion.rotations, two.motion.rotations)


def test_frames_that_show_nothing_lie_between_those_beside_them(run):
    positions = run.trial.positions.copy()
    positions[80:90] = np.nan
    solved = solve_poses(model_of(run), replace(run.trial, positions=positions))
    assert np.all(solved.iterations[80:90] == 0) and any("10 of" in note for note in solved.notes)
    way = solved.motion.root_positions[79:91]
    assert np.allclose(np.diff(way, 2, axis=0), 0.0, atol=1e-9)


def test_an_unknown_label_is_no_harm_but_a_strange_trial_is_refused(run):
    model = model_of(run)
    more = replace(run.trial, labels=(*run.trial.labels[:-1], "stick"))
    assert np.isnan(solve_poses(model, more).residual[:, -1]).all()
    strange = replace(run.trial, labels=tuple(f"x{label}" for label in run.trial.labels))
    with pytest.raises(InputError, match="0 of the model's"):
        solve_poses(model, strange)
    with pytest.raises(UserCancelledError):
        solve_poses(model, run.trial, cancelled=lambda: True)


def test_a_held_ball_turns_a_hand_that_its_markers_leave_open(run):
    model = model_of(run)
    hand = run.motion.skeleton.index("RightHand")
    centre, radius = np.array([0.02, -0.09, -0.05]), 0.0366
    joints, turns = forward_kinematics(run.motion)
    on_surface = joints[:, hand] + quaternion.rotate(turns[:, hand], centre + np.array([0.0, 0.0, -radius]))
    hidden = run.trial.positions.copy()
    hidden[:, np.isin(run.trial.labels, [label for label, on in run.segments.items() if on == "RightHand"])] = np.nan
    trial = replace(run.trial, positions=hidden)
    ball = HeldBall(joint="RightHand", centre=centre, radius=radius, seen=on_surface,
                    held=np.ones(len(hidden), dtype=bool))
    without, held = solve_poses(model, trial), solve_poses(model, trial, PoseSettings(ball=ball))
    joints, turns = forward_kinematics(held.motion)
    distance = np.linalg.norm(joints[:, hand] + quaternion.rotate(turns[:, hand], centre) - on_surface, axis=-1)
    assert np.abs(distance - radius).max() < 2e-3
    assert world_errors(run, held, "RightHand").mean() < 0.7 * world_errors(run, without, "RightHand").mean()


def test_a_spine_that_is_too_long_does_not_flip(run):
    model = model_of(run)
    offsets = model.skeleton.offsets.copy()
    chest = model.skeleton.index("Chest")
    offsets[chest] *= 1.0 + 0.015 / np.linalg.norm(offsets[chest])
    solved = solve_poses(replace(model, skeleton=replace(model.skeleton, offsets=offsets)), run.trial)
    spine = [model.skeleton.index(name) for name in ("Spine", "Spine1", "Chest")]
    steps = quaternion.multiply(quaternion.inverse(solved.motion.rotations[:-1]), solved.motion.rotations[1:])
    turned = np.degrees(np.linalg.norm(quaternion.to_rotation_vector(steps[:, spine]), axis=-1))
    assert turned.max() < 3.0
    vectors = np.degrees(quaternion.to_rotation_vector(solved.motion.rotations[:, spine]))
    assert np.linalg.norm(vectors - vectors.mean(axis=1, keepdims=True), axis=-1).max() < 20.0


def test_a_joint_whose_markers_are_hidden_goes_on_between_its_neighbours(run):
    positions = run.trial.positions.copy()
    arm = ("LeftForeArm", "LeftHand")
    hidden = [index for index, label in enumerate(run.trial.labels) if run.segments[label] in arm]
    positions[60:75, hidden] = np.nan
    solved = solve_poses(model_of(run), replace(run.trial, positions=positions))
    errors = world_errors(run, solved, "LeftForeArm")[:, 0]
    assert errors[60:75].max() < 15.0 and errors[:58].max() < 1.0 and errors[77:].max() < 1.0
    arm = solved.motion.rotations[58:78, run.motion.skeleton.index("LeftForeArm")]
    steps = quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(arm[:-1]), arm[1:]))
    assert np.degrees(np.linalg.norm(steps, axis=-1)).max() < 6.0


def test_a_short_flip_is_solved_again_from_the_frames_around(run, monkeypatch):
    model = model_of(run)
    arm = run.motion.skeleton.index("LeftArm")
    right, flipped = pose._PoseSolver._resolve_flips, []

    def flip_first(solving, known):
        """Turn the arm out for three frames, as if that cost no more."""
        turned = solving.poses.local[arm, :, 60:63]
        solving.poses.local[arm, :, 60:63] = quaternion.multiply(
            turned.T, quaternion.from_rotation_vector(np.array([0.0, 1.8, 0.0]))).T
        flipped.append(known)
        right(solving, known)

    monkeypatch.setattr(pose._PoseSolver, "_resolve_flips", flip_first)
    solved = solve_poses(model, run.trial)
    assert flipped and world_errors(run, solved, "LeftArm")[59:64].max() < 1.0
