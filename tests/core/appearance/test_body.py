"""The body: one closed surface, weighted, and whole on any skeleton and in bent poses."""

import pathlib
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.appearance.body import build_body
from beyond_mocap.appearance.boots import build_boots
from beyond_mocap.appearance.look import BUILDS, HAIR_STYLES, Look, choose_look
from beyond_mocap.appearance.mesh import BOOTS, EYES, GLOVES, HAIR, MATERIALS, PUPILS, SKIN, SOLES, deform_body
from beyond_mocap.files.bvh import bvh
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import compute_pose, forward_kinematics
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.motion.retargeting.neutral import build_neutral_stance
from beyond_mocap.synthetic.gait import build_gait

MOCAP = pathlib.Path(__file__).parents[3] / "../shared/data/mocap"


def stand(body, skeleton, example=None):
    """The body's vertices in the neutral stance."""
    neutral = build_neutral_stance(skeleton, example)
    return deform_body(body, skeleton, neutral.positions, neutral.rotations)


def measure_volume(vertices, faces) -> float:
    """Signed volume of a closed mesh, cubic metres."""
    triangles = np.array([(face[0], b, c) for face in faces for b, c in zip(face[1:], face[2:])])
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    return np.sum(a * np.cross(b, c)) / 6.0


def list_surface(body):
    """The faces of the one surface: all but hair and eyes."""
    return [face for face, part in zip(body.faces, body.material) if part not in (HAIR, EYES, PUPILS)]


@pytest.mark.parametrize("light, least, most", [(False, 11000, 17000), (True, 2000, 3500)])
def test_one_closed_surface_that_faces_outwards(light, least, most):
    body = build_body(build_adult_skeleton(), look=Look(hair="bald"), light=light)
    faces = list_surface(body)
    edges = Counter((face[i], face[(i + 1) % len(face)]) for face in faces for i in range(len(face)))
    assert all(edges[b, a] == count for (a, b), count in edges.items())
    assert sum(count > 1 for count in edges.values()) < 0.01 * len(edges)
    neighbours = {}
    for a, b in edges:
        neighbours.setdefault(a, []).append(b)
    reached, ahead = set(), [faces[0][0]]
    while ahead:
        here = ahead.pop()
        if here not in reached:
            reached.add(here)
            ahead += neighbours[here]
    assert reached == set(neighbours)  # it hangs together
    assert least < len(body.faces) < most
    assert 0.075 < measure_volume(stand(body, build_adult_skeleton()), faces) < 0.115  # m^3, in wide clothes


def test_weights_sum_to_one_and_all_materials_are_used():
    body = build_body(build_adult_skeleton(), look=Look(gloves=True))
    assert np.allclose(body.weights.sum(axis=1), 1.0) and np.all(body.weights >= 0.0)
    assert np.all(body.weights[:, 0] >= body.weights.max(axis=1))
    assert set(body.material) == set(range(len(MATERIALS)))
    assert len(body.material) == len(body.faces) and body.joints.shape[1] <= 4


@pytest.mark.parametrize("stature", [1.60, 1.80, 1.95])
def test_as_tall_as_asked_and_on_the_ground(stature):
    skeleton = build_adult_skeleton(stature)
    standing = stand(build_body(skeleton), skeleton)
    assert standing[:, 2].min() == pytest.approx(0.0, abs=0.002)
    assert stature < standing[:, 2].max() < stature + 0.04  # the hair stands up
    assert np.ptp(standing[:, 1]) < 0.36 * stature


@pytest.mark.parametrize("build, wider", [("slim", -1), ("strong", 1), ("woman", -1)])
def test_builds_differ_in_girth_not_in_height(build, wider):
    skeleton = build_adult_skeleton()
    usual, other = (stand(build_body(skeleton, look=Look(build=name)), skeleton) for name in ("normal", build))
    assert other[:, 2].max() == pytest.approx(usual[:, 2].max(), abs=0.002)
    waist = np.abs(usual[:, 2] - 1.1) < 0.02
    assert np.sign(np.ptp(other[waist, 0]) - np.ptp(usual[waist, 0])) == wider


def test_hair_and_gloves_are_put_on():
    skeleton = build_adult_skeleton()
    tops = {style: stand(build_body(skeleton, look=Look(hair=style)), skeleton)[:, 2].max() for style in HAIR_STYLES}
    assert tops["bald"] < tops["crop"] < tops["short"] < tops["curly"]
    bare, gloved = (build_body(skeleton, look=Look(gloves=worn)) for worn in (False, True))
    hands = np.flatnonzero(gloved.material == GLOVES)
    assert len(hands) > 500 and np.all(bare.material[hands] == SKIN)
    move = np.linalg.norm(gloved.vertices - bare.vertices, axis=1)
    touched = np.unique([v for i in hands for v in gloved.faces[i]])
    assert 0.002 < np.median(move[touched]) < 0.01 and np.all(move[np.setdiff1d(np.arange(len(move)), touched)] == 0.0)


def test_a_player_always_looks_the_same_and_players_differ():
    looks = [choose_look(f"player{number}") for number in range(40)]
    assert looks == [choose_look(f"player{number}") for number in range(40)]
    assert len(set(looks)) > 15 and {look.hair for look in looks} == set(HAIR_STYLES)
    assert all(look.build in BUILDS for look in looks)
    assert choose_look("a", women=True).build == "woman" and choose_look("a", gloves=True).gloves


def test_moves_rigidly_with_the_root():
    motion = build_gait(3.0, 1.0)
    body = build_body(motion.skeleton, light=True)
    places, world = forward_kinematics(motion)
    turn = quaternion.from_up_angle(np.full(len(motion), 1.1))
    local = motion.rotations.copy()
    local[:, 0] = quaternion.multiply(turn, local[:, 0])
    turned = compute_pose(motion.skeleton, quaternion.rotate(turn, motion.root_positions), local)
    expected = quaternion.rotate(turn[:, None], deform_body(body, motion.skeleton, places, world))
    assert np.allclose(deform_body(body, motion.skeleton, *turned), expected, atol=1e-9)


@pytest.mark.parametrize("stature", [1.65, 1.80])
def test_the_drawn_soles_are_the_measured_ones(stature):
    """Within 4 mm in height through a run, and as long within 1 cm."""
    motion = build_gait(3.0, 1.0, skeleton=build_adult_skeleton(stature))
    places, world = forward_kinematics(motion)
    body, boots = build_body(motion.skeleton), build_boots(motion.skeleton)
    used = np.unique([v for face, part in zip(body.faces, body.material) if part in (BOOTS, SOLES) for v in face])
    drawn = deform_body(body, motion.skeleton, places, world)[:, used]
    plain = deform_body(boots, motion.skeleton, places, world)
    assert np.abs(drawn[..., 2].min(axis=1) - plain[..., 2].min(axis=1)).max() < 0.004
    assert np.abs(np.ptp(stand(body, motion.skeleton)[used, 0])
                  - np.ptp(stand(boots, motion.skeleton)[:, 0])).max() < 0.01


@pytest.mark.parametrize("joint, sign", [("lower_leg", 1.0), ("lower_arm", -1.0), ("upper_leg", -1.0)])
def test_a_bent_joint_keeps_its_volume(joint, sign):
    skeleton = build_adult_skeleton()
    body, parts = build_body(skeleton, look=Look(hair="bald")), identify_joints(skeleton)
    neutral = build_neutral_stance(skeleton)
    local = quaternion.identity(1, len(skeleton))
    for limb in (parts.left, parts.right):
        local[0, getattr(limb, joint)] = quaternion.from_axis_angle(np.array([0.0, sign, 0.0]), np.radians(110.0))
    bent = deform_body(body, skeleton, *(part[0] for part in compute_pose(skeleton, neutral.positions[:1], local)))
    faces = list_surface(body)
    assert measure_volume(bent, faces) > 0.94 * measure_volume(stand(body, skeleton), faces)


@pytest.mark.parametrize(
    "clip",
    ["cmu10/10_04.bvh", "lafan1/multipleActions1_subject1_walk_filtered.bvh", "runs15/sie_humanoid3d_run_forward00.bvh",
     "bandai/dataset-1_dash_active_001.bvh", "sprinter/run0350cms.bvh", "lmd/Player1/P1_S01_penalty_kick.bvh"],
)  # fmt: skip
def test_fits_recorded_skeletons(clip):
    if not (MOCAP / clip).exists():
        pytest.skip(f"needs {MOCAP / clip}")
    motion = bvh.read_bvh(MOCAP / clip, 0.05644 if "cmu10" in clip else None).motion
    body = build_body(motion.skeleton)
    standing = stand(body, motion.skeleton)
    # 1.3 to 2.1 m tall, wider across than 0.3 m, and no vertex torn away from its joint
    assert 1.3 < np.ptp(standing[:, 2]) < 2.1 and 0.3 < np.ptp(standing[:, 1]) < 0.9
    places, world = forward_kinematics(motion.frames(0, 1))
    posed = deform_body(body, motion.skeleton, places, world)[0]
    near = np.linalg.norm(posed - places[0][body.joints[:, 0]], axis=1)
    assert np.all(np.isfinite(posed)) and near.max() < 0.6


def bowed(degrees: float):
    """A walk of the adult skeleton whose head is bowed by `degrees` in every frame."""
    motion = build_gait(1.3, 3.0, 30.0, build_adult_skeleton())
    head = motion.skeleton.index("Head")
    rotations = motion.rotations.copy()
    turn = quaternion.from_axis_angle(np.array([0.0, 1.0, 0.0]), np.radians(degrees))
    rotations[:, head] = quaternion.multiply(rotations[:, head], np.tile(turn, (len(motion), 1)))
    return replace(motion, rotations=rotations)


def face_pitch(body, motion) -> float:
    """Degrees between the drawn face's gaze and that of a body drawn from the rest pose, in the first frame."""
    head = motion.skeleton.index("Head")
    mine = (body.joints[:, 0] == head) & (body.weights[:, 0] == 1.0)
    places, world = forward_kinematics(motion)
    shown = [
        deform_body(one, motion.skeleton, places[0], world[0])[mine] for one in (body, build_body(motion.skeleton))
    ]
    drawn, rest = (points - points.mean(axis=0) for points in shown)
    u, _, v = np.linalg.svd(drawn.T @ rest)
    forward = (u @ v) @ np.array([1.0, 0.0, 0.0])
    return float(np.degrees(np.arcsin(np.clip(forward[2], -1.0, 1.0))))


@pytest.mark.parametrize("degrees, least, most", [(28.0, 0.0, 1.0), (-25.0, 15.0, 30.0)])
def test_a_face_that_looks_down_in_the_example_is_drawn_so(degrees, least, most):
    """Kicks look down: the head's rest tells. Where the example looks up by its rest pose, the rest pose is bowed."""
    motion = bowed(degrees)
    assert least <= abs(face_pitch(build_body(motion.skeleton, example=motion), motion)) <= most
