"""Nothing pokes through: cloth below other cloth stays below it, no shirt tears, and faces do not turn inside out."""

import pathlib

import numpy as np
import pytest
from scipy.spatial import cKDTree

from beyond_mocap.appearance.body import build_body
from beyond_mocap.appearance.look import Look
from beyond_mocap.appearance.mesh import HAIR, SHIRT, SHORTS, SKIN, BodyMesh, deform_body
from beyond_mocap.appearance.stance import build_lifted_stance
from beyond_mocap.files.bvh import bvh
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.motion import forward_kinematics

ROOT = pathlib.Path(__file__).parents[3]
SAMPLE, MOCAP = ROOT / "sample_blend" / "library", ROOT / "../shared/data/mocap"
POSES = 10  # of each clip
FOLDED = 0.25  # share of the shorts below the shirt that a body bent double may bare
TORN = 2.25  # times its length: the 99th percentile of a shirt's edges (double for a body bent double)
SAMPLE_CLIPS = ("kick_low_top", "kick_low_inside", "throw_in", "getting_up", "header", "celebration", "sprinting_8_6",
                "running_turn_left", "receive_foot", "jogging_back")
RECORDED = ("keeper/GK01_trial04_dive_left.bvh", "keeper/GK02_trial03_dive_right.bvh",
            "lafan1/fightAndSports1_subject1_joy_filtered.bvh", "lafan1/fallAndGetUp1_subject1_jog_filtered.bvh",
            "lmd/Player1/P1_S17_volley.bvh", "lmd/Player1/P1_S05_free_kick.bvh", "cmu_jumps/118_01.bvh",
            "sprinter/run0350cms.bvh", "bandai/dataset-1_dash_active_001.bvh", "getup/humanoid3d_getup_faceup.bvh")


def split(faces) -> np.ndarray:
    """The triangles (T, 3) of faces."""
    return np.array([(face[0], face[i], face[i + 1]) for face in faces for i in range(1, len(face) - 1)])


def compute_normals(vertices, triangles):
    """Unit normals (T, 3) of triangles, and their areas (T,)."""
    normal = np.cross(vertices[triangles[:, 1]] - vertices[triangles[:, 0]],
                      vertices[triangles[:, 2]] - vertices[triangles[:, 0]])
    size = np.linalg.norm(normal, axis=1)
    return normal / np.maximum(size, 1e-12)[:, None], size / 2.0


def cast_rays(starts, ways, corners, reach=0.12):
    """Distance (N,) m from starts (N, 3) along ways (N, 3) to the nearest of triangles (T, 3, 3), inf for none."""
    middle = corners.mean(axis=1)
    near = cKDTree(middle).query_ball_point(starts + 0.5 * reach * ways, reach)
    found = np.full(len(starts), np.inf)
    for index, chosen in enumerate(near):
        a, b, c = corners[chosen].transpose(1, 0, 2)
        first, second, offset = b - a, c - a, starts[index] - a
        across = np.cross(ways[index], second)
        scale = np.sum(first * across, axis=1)
        scale = np.where(np.abs(scale) < 1e-12, np.inf, scale)
        u = np.sum(offset * across, axis=1) / scale
        other = np.cross(offset, first)
        v, distance = other @ ways[index] / scale, np.sum(second * other, axis=1) / scale
        hits = distance[(u >= -1e-6) & (v >= -1e-6) & (u + v <= 1.0 + 1e-6) & (distance > 1e-5)]
        found[index] = hits.min(initial=np.inf)
    return found


class Layers:
    """Faces of a body that other cloth covers in the stance with lifted arms: shorts by the shirt, thighs by shorts."""

    def __init__(self, body, standing):
        surface = [(face, part) for face, part in zip(body.faces, body.material) if part != HAIR]
        self.faces = split([face for face, _ in surface])
        self.part = np.array([part for face, part in surface for _ in range(len(face) - 2)])
        self.normals, sizes = compute_normals(standing, self.faces)
        self.solid = sizes > 2e-6
        middle = standing[self.faces].mean(axis=1)
        self.hidden = []
        for below, above in ((SHORTS, SHIRT), (SKIN, SHORTS)):
            cover = np.flatnonzero(self.part == above)
            low, high = middle[cover, 2].min() + 0.01, middle[cover, 2].max()
            inner = np.abs(middle[:, 1]) < np.abs(middle[self.part == SHORTS, 1]).max()
            chosen = (self.part == below) & self.solid & inner & (middle[:, 2] > low) & (middle[:, 2] < min(high, 1.0))
            faces = np.flatnonzero(chosen)
            self.hidden.append(faces[np.isfinite(self.measure_cover(standing, faces, cover, 0.05))])

    def measure_cover(self, vertices, faces, cover, reach):
        """Distance (N,) m from the middles of faces outwards to the nearest of the faces `cover`, inf for none."""
        normals, _ = compute_normals(vertices, self.faces[faces])
        return cast_rays(vertices[self.faces[faces]].mean(axis=1), normals, vertices[self.faces[cover]], reach)

    def measure_seen(self, vertices) -> float:
        """Share of the hidden faces with nothing of the body before them in a pose: what pokes through or is bared."""
        everything = np.flatnonzero(self.solid)
        distances = self.measure_cover(vertices, np.concatenate(self.hidden), everything, 0.12)
        return float(np.mean(np.isinf(distances)))

    def measure_turned(self, vertices, turn) -> float:
        """Share of the faces that are inside out; `turn` (V, 4) says how the first joint of a vertex has rotated."""
        normals, _ = compute_normals(vertices, self.faces[self.solid])
        expected = quaternion.rotate(turn[self.faces[self.solid, 0]], self.normals[self.solid])
        return float(np.mean(np.sum(normals * expected, axis=1) < -0.5))


def test_a_ray_finds_the_triangle_ahead():
    corner = np.array([[[0.05, -0.02, -0.02], [0.05, 0.02, -0.02], [0.05, 0.0, 0.04]]])
    starts, ahead = np.zeros((2, 3)), np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    assert np.allclose(cast_rays(starts, ahead, corner), [0.05, np.inf])


def measure_stretch(body: BodyMesh, standing, moved) -> float:
    """The 99th percentile of how much longer the edges of the lower shirt become."""
    shirt = [face for face, part in zip(body.faces, body.material) if part == SHIRT]
    edges = np.array([(face[i - 1], face[i]) for face in shirt for i in range(len(face))])
    length = np.linalg.norm(standing[edges[:, 0]] - standing[edges[:, 1]], axis=1)
    chosen = (standing[edges, 2].mean(axis=1) < 1.1) & (length > 0.01)
    now = np.linalg.norm(moved[edges[:, 0]] - moved[edges[:, 1]], axis=1)
    return float(np.percentile(now[chosen] / length[chosen], 99))


def check_poses(clip, most_seen, most_turned):
    motion = bvh.read_bvh(clip).motion
    body = build_body(motion.skeleton, example=motion, look=Look(hair="bald"), light=True)
    stance = build_lifted_stance(motion.skeleton, motion)
    standing = deform_body(body, motion.skeleton, stance.positions, stance.rotations)
    layers = Layers(body, standing)
    assert len(layers.hidden[0]) > 80
    places, world = forward_kinematics(motion)
    for frame in np.linspace(0, len(motion) - 1, POSES).astype(int):
        moved = deform_body(body, motion.skeleton, places[frame], world[frame])
        turn = quaternion.multiply(world[frame], quaternion.inverse(stance.rotations))[body.joints[:, 0]]
        seen, turned = layers.measure_seen(moved), layers.measure_turned(moved, turn)
        assert seen < most_seen and turned < most_turned, (frame, seen, turned)
        assert measure_stretch(body, standing, moved) < (2.0 if most_seen == FOLDED else 1.0) * TORN, frame


@pytest.mark.parametrize("clip", SAMPLE_CLIPS)
def test_nothing_pokes_through_in_the_sample(clip):
    check_poses(SAMPLE / f"{clip}.bvh", FOLDED if clip == "getting_up" else 0.05, 0.015)


@pytest.mark.parametrize("clip", RECORDED)
def test_nothing_pokes_through_in_recordings(clip):
    if not (MOCAP / clip).exists():
        pytest.skip(f"needs {MOCAP / clip}")
    check_poses(MOCAP / clip, FOLDED if clip.startswith(("getup", "keeper")) else 0.10, 0.02)
