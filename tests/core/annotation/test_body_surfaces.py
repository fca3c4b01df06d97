"""The ball in a body: how deep it lies in the part aimed at; one that touches a striking surface is outside."""

import numpy as np
import pytest

from beyond_mocap.annotation.body_solid import BodySolid
from beyond_mocap.annotation.body_surfaces import build_body_surfaces
from beyond_mocap.annotation.striking import build_part_surfaces
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.track import BALL_RADIUS
from beyond_mocap.synthetic.gait import build_gait


@pytest.fixture(scope="module")
def stand():
    """A standing body that faces +x: skeleton, positions (1, J, 3) and rotations (1, J, 4) of one frame, joints."""
    motion = build_gait(0.0, 0.5, 30.0)
    positions, rotations = forward_kinematics(motion)
    return motion.skeleton, positions[:1], rotations[:1], identify_joints(motion.skeleton)


def find_deepest(stand, ball):
    """The deepest (depth m, part, side) of a ball at `ball` (3,)."""
    skeleton, positions, rotations, _ = stand
    surfaces = build_body_surfaces(skeleton)
    depths = BodySolid.from_pose(surfaces, positions, rotations).measure_depths(np.asarray(ball)[None])[0]
    deepest = int(np.argmax(depths))
    return float(depths[deepest]), surfaces[deepest].part, surfaces[deepest].side


@pytest.mark.parametrize("part, first, last, radius", [
    ("thigh", "upper_leg", "lower_leg", 0.0675), ("shank", "lower_leg", "foot", 0.0465),
    ("upper arm", "upper_arm", "lower_arm", 0.0425), ("forearm", "lower_arm", "hand", 0.0325)])
def test_a_ball_beside_the_middle_of_a_bone(stand, part, first, last, radius):
    """120 mm to the left of the middle of a bone, whose radius there is the mean of its ends'."""
    _, positions, _, body = stand
    ends = [positions[0, getattr(body.left, name)] for name in (first, last)]
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    out = np.cross(along, [1.0, 0.0, 0.0])
    out *= np.sign(out[1]) / np.linalg.norm(out)  # away from the body's middle
    depth, found, side = find_deepest(stand, np.mean(ends, axis=0) + 0.12 * out)
    assert (found, side) == (part, "left")
    assert depth == pytest.approx(radius + BALL_RADIUS - 0.12, abs=1e-9)


def test_a_ball_in_the_belly_and_one_far_away(stand):
    _, positions, _, body = stand
    hips, chest = positions[0, body.hips], positions[0, body.chest]
    assert find_deepest(stand, 0.5 * (hips + chest))[:2] == (pytest.approx(0.105 + BALL_RADIUS), "trunk")
    assert find_deepest(stand, hips + [1.0, 0.0, 0.0])[0] < -0.5


@pytest.mark.parametrize("part", ["foot", "head", "hand"])
def test_a_ball_that_touches_a_striking_surface_is_not_inside(stand, part):
    """Ahead of the foot, above the head, beside the hand: the gap to the surface is 0, nothing else is near."""
    skeleton, positions, rotations, _ = stand
    surface = build_part_surfaces(skeleton, part)[0]
    end = surface.compute_line(positions, rotations)[1][0]
    way = {"foot": [1.0, 0.0, 0.0], "head": [0.0, 0.0, 1.0], "hand": [0.0, 1.0, 0.0]}[part]
    depth, found, _ = find_deepest(stand, end + (surface.radius + BALL_RADIUS) * np.array(way))
    assert found == part and depth == pytest.approx(0.0, abs=1e-9)


def test_no_ball_has_no_depth(stand):
    skeleton, positions, rotations, _ = stand
    solid = BodySolid.from_pose(build_body_surfaces(skeleton), positions, rotations)
    depths = solid.measure_depths(np.full((1, 3), np.nan))
    assert np.isnan(depths).all()
