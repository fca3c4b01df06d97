"""What networks are told and answer: truth through both comes back as the same pose, wherever the world lies."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.motion import Motion, forward_kinematics, place_motion
from beyond_mocap.motion.skeleton import Skeleton
from beyond_mocap.synthetic.throws import build_throw
from beyond_mocap.throws.networks import kinematics
from beyond_mocap.throws.networks.chains import HIERARCHY, LIMB_OF, find_chains
from beyond_mocap.throws.networks.description import build_windows, interpolate_positions, scale_description
from beyond_mocap.throws.networks.example import (
    Example,
    build_description,
    build_example,
    compute_poses,
    mirror_example,
)
from beyond_mocap.throws.networks.features import build_input, compute_phase, count_guides, count_widths
from beyond_mocap.throws.networks.model import ModelSettings
from beyond_mocap.throws.networks.network_output import (
    apply_output,
    build_output,
    compute_end_positions,
    split_single_output,
)
from beyond_mocap.throws.networks.training_set import add_mirror_images, build_steps, measure_leg_reach
from tests.core.linear_throws import build_training_set

TARGET = np.array([12.0, 3.0, 1.2])
KINDS, WRISTS, FRAMES = ("hierarchy", "single"), ("given", "inferred"), ("hip", "static")
ALL = [ModelSettings(kind=kind, wrist=wrist, frame=frame) for kind in KINDS for wrist in WRISTS for frame in FRAMES]


@pytest.fixture(scope="module")
def made():
    return build_throw(TARGET, 22.0, fps=120.0)


@pytest.fixture(scope="module")
def example(made):
    return build_example("t", "s", made.motion, "right_hand", made.release, TARGET, made.velocity)


def under_a_root(motion):
    """The same movement with a still joint above the hips and one between the hips and each upper leg."""
    skeleton = motion.skeleton
    legs = [i for i, name in enumerate(skeleton.names) if name.endswith("UpLeg")]
    names, parents, offsets, source = ["SimulationBone"], [-1], [np.zeros(3)], [None]
    at = {}
    for joint, name in enumerate(skeleton.names):
        parent = 0 if joint == 0 else at[skeleton.parents[joint]]
        if joint in legs:
            names.append(name.replace("UpLeg", "HipJoint"))
            parents.append(parent)
            offsets.append(skeleton.offsets[joint] * 0.0)
            source.append(None)
            parent = len(names) - 1
        at[joint] = len(names)
        names.append(name)
        parents.append(parent)
        offsets.append(np.array([0.0, 0.0, 0.9]) if joint == 0 else skeleton.offsets[joint])
        source.append(joint)
    rotations = quaternion.identity(len(motion), len(names))
    for new, old in enumerate(source):
        if old is not None:
            rotations[:, new] = motion.rotations[:, old]
    tips = [at[joint] for joint in skeleton.end_parents]
    other = Skeleton(names, parents, np.array(offsets), tips, skeleton.end_offsets)
    return Motion(other, motion.root_positions - [0.0, 0.0, 0.9], rotations, motion.fps)


def decoded(example, settings):
    """Every step's answer, made from the truth, put on a body out of the step before: (T - 1) poses, and the truth."""
    chains = find_chains(example.motion.skeleton)
    pose, truth, window = build_steps(example)
    after = pose
    for name in settings.networks:
        y = build_output(name, chains, settings, pose, truth)
        after = apply_output(name, chains, settings, y, pose, after, window)
    return after, truth, chains


@pytest.mark.parametrize("settings", ALL, ids=str)
@pytest.mark.parametrize("rig", ["plain", "under a root"])
def test_truth_comes_back(made, settings, rig):
    motion = made.motion if rig == "plain" else under_a_root(made.motion)
    example = build_example("t", "s", motion, "right_hand", made.release, TARGET)
    after, truth, chains = decoded(example, settings)
    assert np.abs(after.positions - truth.positions).max() < 1e-6
    assert np.abs(after.turns - truth.turns).max() < 1e-6
    again = kinematics.build_pose(example.motion.skeleton, after.root, after.local)
    assert np.abs(again.positions - truth.positions).max() < 1e-6


@pytest.mark.parametrize("settings", ALL, ids=str)
def test_places_of_the_world_do_not_matter(made, settings):
    turned = place_motion(made.motion, 0.7, (3.0, -2.0, 0.0))
    target = quaternion.rotate(quaternion.from_up_angle(np.array(0.7)), TARGET) + (3.0, -2.0, 0.0)
    sets = [build_training_set([build_example("t", "s", motion, 1, made.release, aim)], settings)
            for motion, aim in ((made.motion, TARGET), (turned, target))]  # fmt: skip
    for name in settings.networks:
        for mine, theirs in zip(*(found[name] for found in sets)):
            assert np.abs(mine - theirs).max() < 1e-6


def test_chains_see_nothing_of_the_world(example):
    """Body and limbs are told in frames of the body: a body elsewhere, turned any way, is told the same."""
    chains, settings = find_chains(example.motion.skeleton), ModelSettings()
    pose, after, window = build_steps(example)
    turn = quaternion.to_matrix(quaternion.from_rotation_vector(np.array([0.3, -0.8, 1.1])))
    shift = np.array([1.0, 2.0, 3.0])

    def moved(one):
        local = one.local.copy()
        local[:, 0] = turn @ local[:, 0]
        return kinematics.build_pose(example.motion.skeleton, one.root @ turn.T + shift, local)

    elsewhere = window._replace(
        points=window.points @ turn.T + shift, deltas=window.deltas @ turn.T, next=window.next @ turn.T + shift,
        hands_next=turn @ window.hands_next, impact=window.impact @ turn.T + shift,
    )  # fmt: skip
    for name in HIERARCHY[1:]:
        here = build_input(name, chains, settings, pose, after, window)
        there = build_input(name, chains, settings, moved(pose), moved(after), elsewhere)
        assert np.abs(here - there).max() < 1e-9


def test_the_input_follows_the_paper(example):
    """Lengths of §7.3 with this body's joints, and the places where single values stand."""
    chains = find_chains(example.motion.skeleton)
    body, reach = len(chains.members["body"]), measure_leg_reach([example])
    found = count_widths(chains, ModelSettings())
    assert found["hip"] == (2 + 3 + 4 * 54 + 14 * 9, 9)
    assert found["body"] == (2 + 3 + 2 * 54 + 2 * 3 + 6 + body * 6 + 8 * 9, body * 6)
    assert found["left_arm"] == (2 + 54 + 3 + 6 + 6 + 1 + 12 + body * 3 + (body + 1) * 6, 12)
    assert found["right_leg"] == (54 + 3 + 6 + 1 + 4 * 6 + 3 * 3 + len(chains.leg_inputs) * 6, 4 * 6)
    assert count_widths(chains, ModelSettings(wrist="inferred"))["left_arm"] == (found["left_arm"][0], 18)
    joints = len(chains.joints)
    assert count_widths(chains, ModelSettings(kind="single"))["single"] == (2 + 3 + 4 * 54 + joints * 12, joints * 9)
    pose, after, window = build_steps(example)
    arm = build_input("right_arm", chains, ModelSettings(), pose, after, window)
    socket = after.positions[:, chains.sockets[1]]
    assert np.all(arm[:, :2] == (0.0, 1.0))
    assert np.allclose(arm[:, 2 + 54 + 3 + 6 + 6], np.linalg.norm(window.next[:, 1] - socket, axis=-1))
    phase = compute_phase("left_leg", chains, after, window, reach)
    distance = np.linalg.norm(window.next[:, 2] - after.positions[:, chains.sockets[2]], axis=-1)
    assert np.allclose(phase, (distance - reach["left"][0]) / np.ptp(reach["left"]))


def test_windows_look_back_and_ahead(example):
    description = build_description(example)
    window = build_windows(description)
    assert window.points.shape == window.deltas.shape == (len(description), 4, 9, 3)
    assert np.allclose(window.points[30, :, 2], description.effectors[30])
    assert np.allclose(window.points[30, :, 0], description.effectors[24])
    assert np.allclose(window.points[30, :, 8], description.effectors[48])
    assert np.allclose(window.deltas[30, :, 3], description.effectors[34] - description.effectors[33])
    assert np.allclose(window.next[30], description.effectors[31])
    assert np.allclose(window.hands_next[30], description.hands[31])
    assert np.all(window.points[0, :, 0] == description.effectors[0])
    assert np.all(window.deltas[-1, :, 2:] == 0.0)


def test_what_lies_beyond_the_ends_is_seen(made):
    whole = build_example("t", "s", made.motion, 1, made.release, TARGET)
    part = build_example("t", "s", made.motion, 1, made.release, TARGET, span=(0.5, 3.0))
    assert part.before is not None and part.after is not None
    assert len(part.motion) == 76 and part.release == pytest.approx(whole.release - 15.0)
    for beyond in (-4.0, 83.0):
        here = interpolate_positions(build_description(part), np.array([beyond]))
        there = interpolate_positions(build_description(whole), np.array([15.0 + beyond]))
        ways = np.linalg.norm(here - interpolate_positions(build_description(part), np.array([0.0])), axis=-1)
        theirs = np.linalg.norm(there - interpolate_positions(build_description(whole), np.array([15.0])), axis=-1)
        assert np.allclose(ways, theirs, atol=1e-9)


def test_the_example_stands_in_the_normalised_frame(example, made):
    chains = find_chains(example.motion.skeleton)
    places, _ = forward_kinematics(example.motion)
    assert np.allclose(places[0, chains.hips, :2], 0.0) and example.impact[1] == pytest.approx(0.0, abs=1e-12)
    assert example.impact[0] > 10.0 and example.impact[2] == pytest.approx(TARGET[2])
    assert np.linalg.norm(example.launch) == pytest.approx(np.linalg.norm(made.velocity))
    assert example.release == pytest.approx(made.release * 30.0)


def test_mirrored_twice_is_the_same(example):
    once, again = mirror_example(example), mirror_example(mirror_example(example))
    assert once.limb == 0 and again.limb == 1
    assert np.abs(again.motion.rotations - example.motion.rotations).max() < 1e-9
    mine, theirs = build_description(example), build_description(once)
    assert np.abs(theirs.effectors[:, [1, 0, 3, 2]] * (1.0, -1.0, 1.0) - mine.effectors).max() < 1e-6
    assert len(add_mirror_images([example])) == 2


def test_scaling_scales_everything(example):
    description, larger = build_description(example), scale_description(build_description(example), 1.1)
    assert np.allclose(build_windows(larger).points, 1.1 * build_windows(description).points)
    assert np.allclose(larger.impact, 1.1 * description.impact)


@pytest.mark.parametrize("settings", [ALL[0], ALL[2], ALL[4]], ids=str)
def test_ends_of_the_truth_are_where_the_joints_are(example, settings):
    chains = find_chains(example.motion.skeleton)
    pose, after, _ = build_steps(example)
    for name in settings.networks:
        found = compute_end_positions(name, chains, settings, build_output(name, chains, settings, pose, after))
        joints = {"hip": chains.sockets[2:], "body": (*chains.sockets[:2], chains.head), "single": chains.effectors}
        wanted = after.positions[:, list(joints.get(name) or [chains.effectors[LIMB_OF.index(name)]])]
        if name in LIMB_OF or name == "body":
            frame = chains.references[name]
            wanted = (wanted - after.positions[:, None, frame]) @ after.turns[:, frame]
        else:
            wanted = wanted - pose.positions[:, None, chains.hips] * (1.0, 1.0, 0.0)
        assert np.abs(found - wanted).max() < 1e-6


def test_the_single_network_floats(example):
    chains, settings = find_chains(example.motion.skeleton), ModelSettings(kind="single")
    pose, after, _ = build_steps(example)
    y = build_output("single", chains, settings, pose, after)
    places, turns = split_single_output(chains, settings, y, pose)
    assert np.abs(places - after.positions[:, list(chains.joints)]).max() < 1e-9
    assert np.abs(turns - after.turns[:, list(chains.joints)]).max() < 1e-9


def test_six_numbers_of_any_length_are_a_rotation():
    values = np.random.default_rng(1).normal(size=(50, 6)) * 3.0
    turns = kinematics.from_six(values)
    assert np.allclose(turns @ np.swapaxes(turns, -1, -2), np.eye(3), atol=1e-9)
    assert np.allclose(np.linalg.det(turns), 1.0)
    assert np.allclose(kinematics.from_six(kinematics.to_six(turns)), turns, atol=1e-9)


def test_kinematics_are_those_of_motions(example):
    pose = compute_poses(example)
    places, turns = forward_kinematics(example.motion)
    assert np.abs(pose.positions - places).max() < 1e-9
    assert np.abs(pose.turns - quaternion.to_matrix(turns)).max() < 1e-9
    back = kinematics.to_motion(example.motion.skeleton, pose.root, pose.local, 30.0)
    assert np.abs(back.rotations - example.motion.rotations).max() < 1e-9


def test_a_body_without_hands_is_refused():
    skeleton = build_throw().motion.skeleton
    kept = [i for i, name in enumerate(skeleton.names) if "Hand" not in name]
    without = Skeleton([skeleton.names[i] for i in kept],
                       [-1 if skeleton.parents[i] < 0 else kept.index(skeleton.parents[i]) for i in kept],
                       skeleton.offsets[kept])  # fmt: skip
    with pytest.raises(InputError, match="left hand"):
        find_chains(without)


def test_examples_that_make_no_sense_are_refused(made):
    with pytest.raises(InputError, match="above or below"):
        build_example("t", "s", made.motion, 1, made.release, made.motion.root_positions[0])
    with pytest.raises(InputError, match="release"):
        build_example("t", "s", made.motion, 1, 9.0, TARGET)
    with pytest.raises(InputError):
        build_training_set([], ModelSettings())
    assert isinstance(build_example("t", "s", made.motion, 1, 0.0, TARGET), Example)


@pytest.mark.parametrize("wrist", WRISTS)
def test_a_guided_limb_is_told_how_to_reach(example, wrist):
    """The rotations it is told bring hand and foot to where they are wanted, from the body of the next frame."""
    chains, settings = find_chains(example.motion.skeleton), ModelSettings(wrist=wrist, guided=True)
    pose, truth, window = build_steps(example)
    for number, name in enumerate(LIMB_OF):
        x = build_input(name, chains, settings, pose, truth, window)
        plain = build_input(name, chains, ModelSettings(wrist=wrist), pose, truth, window)
        assert np.array_equal(x[:, : plain.shape[1]], plain)
        assert x.shape[1] - plain.shape[1] == count_guides(name, chains, settings)
        after = apply_output(name, chains, settings, x[:, plain.shape[1] :], pose, truth, window)
        off = np.linalg.norm(after.positions[:, chains.effectors[number]] - window.next[:, number], axis=-1)
        assert off.max() < 0.02 and np.median(off) < 1e-3
        moved = np.linalg.norm(pose.positions - truth.positions, axis=-1)[:, chains.effectors[number]]
        assert moved.max() > 0.05


def test_a_neck_without_a_head_is_of_the_body(made):
    skeleton = made.motion.skeleton
    without, _ = skeleton.select_joints([i for i, name in enumerate(skeleton.names) if name != "Head"])
    chains = find_chains(without)
    assert chains.head == chains.neck == without.index("Neck") and chains.neck in chains.members["body"]
    example = build_example("t", "s", under_a_root(made.motion), "right_hand", made.release, TARGET)
    chains = find_chains(example.motion.skeleton)
    names = [example.motion.skeleton.names[joint] for joint in (*chains.above, chains.hips, *chains.effectors)]
    assert names == ["SimulationBone", "Hips", "LeftHand", "RightHand", "LeftToeBase", "RightToeBase"]


def test_limbs_that_do_not_hang_together_are_named(made):
    skeleton = made.motion.skeleton
    hips = [0 if name == "LeftHand" else parent for name, parent in zip(skeleton.names, skeleton.parents)]
    loose = Skeleton(skeleton.names, hips, skeleton.offsets, skeleton.end_parents, skeleton.end_offsets)
    with pytest.raises(InputError, match="LeftHand .* does not hang below LeftForeArm"):
        find_chains(loose)
