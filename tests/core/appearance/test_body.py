"""The low-poly body: closed, weighted, and whole on any skeleton and in bent poses."""

import pathlib
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.appearance.body import MATERIALS, build_body, deform_body
from beyond_mocap.files.bvh import bvh
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.motion import compute_pose, forward_kinematics
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.motion.retargeting.neutral import build_neutral_stance
from beyond_mocap.synthetic.gait import build_gait

MOCAP = pathlib.Path(__file__).parents[3] / "../shared/data/mocap"


def volume(vertices, faces) -> float:
    """Signed volume of a closed mesh, cubic metres."""
    total = 0.0
    for face in faces:
        a = vertices[face[0]]
        total += sum(np.dot(a, np.cross(vertices[b], vertices[c])) for b, c in zip(face[1:], face[2:])) / 6.0
    return total


def parts(faces) -> list[list]:
    """Faces of each piece that hangs together."""
    owner = {}

    def root(v):
        while owner.setdefault(v, v) != v:
            v = owner[v]
        return v

    for face in faces:
        for v in face[1:]:
            owner[root(v)] = root(face[0])
    found: dict = {}
    for face in faces:
        found.setdefault(root(face[0]), []).append(face)
    return list(found.values())


def test_closed_volumes_that_face_outwards():
    body = build_body(build_adult_skeleton())
    edges = Counter((face[i], face[(i + 1) % len(face)]) for face in body.faces for i in range(len(face)))
    assert set(edges.values()) == {1} and all(edges[b, a] == 1 for a, b in edges)
    neutral = build_neutral_stance(build_adult_skeleton())
    standing = deform_body(body, neutral.skeleton, neutral.positions, neutral.rotations)
    assert all(volume(standing, piece) > 0 for piece in parts(body.faces))
    assert 0.06 < volume(standing, body.faces) < 0.11  # 60 to 110 litres with overlaps


def test_weights_sum_to_one_and_all_materials_are_used():
    body = build_body(build_adult_skeleton())
    assert np.allclose(body.weights.sum(axis=1), 1.0) and np.all(body.weights >= 0.0)
    assert set(body.material) == set(range(len(MATERIALS)))
    assert len(body.material) == len(body.faces) and len(body.vertices) < 3000


def test_as_tall_as_asked_and_on_the_ground():
    skeleton = build_adult_skeleton()
    neutral = build_neutral_stance(skeleton)
    standing = deform_body(build_body(skeleton), skeleton, neutral.positions, neutral.rotations)
    assert standing[:, 2].min() == pytest.approx(0.0, abs=0.01)
    assert 1.76 < standing[:, 2].max() < 1.86
    assert np.ptp(standing[:, 1]) < 0.6


def test_moves_rigidly_with_the_root():
    motion = build_gait(3.0, 1.0)
    body = build_body(motion.skeleton)
    places, world = forward_kinematics(motion)
    turn = quaternion.from_up_angle(np.full(len(motion), 1.1))
    local = motion.rotations.copy()
    local[:, 0] = quaternion.multiply(turn, local[:, 0])
    turned = compute_pose(motion.skeleton, quaternion.rotate(turn, motion.root_positions), local)
    expected = quaternion.rotate(turn[:, None], deform_body(body, motion.skeleton, places, world))
    assert np.allclose(deform_body(body, motion.skeleton, *turned), expected, atol=1e-9)


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
    neutral = build_neutral_stance(motion.skeleton)
    standing = deform_body(body, motion.skeleton, neutral.positions, neutral.rotations)
    # 1.3 to 2.1 m tall, wider across than 0.3 m, and no vertex torn away from its joint
    assert 1.3 < np.ptp(standing[:, 2]) < 2.1 and 0.3 < np.ptp(standing[:, 1]) < 0.9
    places, world = forward_kinematics(motion.frames(0, 1))
    posed = deform_body(body, motion.skeleton, places, world)[0]
    leader = np.take_along_axis(body.joints, np.argmax(body.weights, axis=1)[:, None], axis=1)[:, 0]
    near = np.linalg.norm(posed - places[0][leader], axis=1)
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
