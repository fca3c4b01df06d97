"""A picture of a pose: the body is in it, right way up, the same at every place and facing."""

from pathlib import Path

import numpy as np
import pytest

from beyond_mocap.appearance.picture import COLOURS, fill_faces, render_pose
from beyond_mocap.files.bvh import bvh
from beyond_mocap.motion.motion import place_motion

SAMPLE = Path(__file__).resolve().parents[3] / "sample_blend" / "library"


@pytest.fixture(scope="module")
def motion():
    return bvh.read_bvh(SAMPLE / "standing_1.bvh").motion


def like(picture, part):
    """Rows of opaque pixels that have a part's tone, whatever the light."""
    tone = np.array(COLOURS[part]) / np.linalg.norm(COLOURS[part])
    colour = picture[..., :3] / np.maximum(np.linalg.norm(picture[..., :3], axis=-1, keepdims=True), 1e-9)
    return np.argwhere((colour @ tone > 0.997) & (picture[..., 3] > 0.9))[:, 0]


def test_a_standing_body_has_its_feet_below_its_shirt(motion):
    picture = render_pose(motion, 30)
    assert picture.shape == (256, 256, 4) and picture.min() >= 0.0 and picture.max() <= 1.0
    assert like(picture, "socks").mean() < like(picture, "shirt").mean()
    assert 0.03 < np.mean(picture[..., 3] > 0.9) < 0.5 and picture[-3:, :, 3].max() == 0.0


def test_it_is_the_same_wherever_the_body_is(motion):
    one, other = render_pose(motion, 30), render_pose(place_motion(motion, 2.3, (40.0, -7.0, 0.0)), 30)
    assert np.mean(np.abs(one[..., 3] - other[..., 3])) < 0.05


def test_any_size(motion):
    assert render_pose(motion, 0, 64).shape == (64, 64, 4)


def test_each_pixel_shows_what_is_nearest():
    square = np.tile([[[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]]], (2, 1, 1))
    rising, colours = np.array([[0.0, 1.0, 1.0, 0.0], [1.0, 0.0, 0.0, 1.0]]), np.array([[1.0], [2.0]])
    for order in ([0, 1], [1, 0]):
        canvas = np.zeros((8, 8, 1))
        fill_faces(canvas, np.full((8, 8), -np.inf), square, rising[order], colours[order])
        assert (canvas[:, :4] == 2.0).all() and (canvas[:, 4:] == 1.0).all()
