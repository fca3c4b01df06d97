"""Made strikes out of standing: who strikes stands before and after, on a foot that does not slide,
above the ground."""

import numpy as np
import pytest

from beyond_mocap.annotation import VOCABULARY
from beyond_mocap.ball.contact import find_striking_surface, sample_strike_surface
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthetic.volleys import AFTER, BEFORE, VOLLEYS, build_volley

# part, and the least and most m/s of its middle over the ground at the touch
STRUCK = {
    "toss": ("foot", 1.5, 5.0), "pass": ("foot", 3.0, 9.0), "attack": ("foot", 4.5, 15.0),
    "receive": ("foot", 0.0, 1.0), "head": ("head", 1.0, 4.0), "chest": ("chest", 0.0, 0.6),
    "hand": ("hand", 1.0, 8.0), "racquet": ("tool", 8.0, 25.0),
}  # fmt: skip


@pytest.fixture(scope="module", params=sorted(VOLLEYS))
def made(request):
    return request.param, build_volley(request.param, fps=60.0)


def test_begins_and_ends_as_who_stands(made):
    _, gesture = made
    places, _ = forward_kinematics(gesture.motion)
    edge = int(0.5 * 60)
    for part in (places[: min(edge, int(60 * gesture.start))], places[-edge:]):
        assert np.linalg.norm(np.diff(part, axis=0), axis=-1).max() * 60 < 0.35
    assert abs(gesture.motion.duration - BEFORE - AFTER) < 0.02 and gesture.start < gesture.key < gesture.end


def test_strikes_at_its_key_with_the_speed_of_its_kind(made):
    kind, gesture = made
    part, least, most = STRUCK[kind]
    surface = find_striking_surface(gesture.motion.skeleton, part, "" if part in ("head", "chest") else "right")
    struck = sample_strike_surface(gesture.motion, np.array([gesture.key * 60.0]), surface)
    assert least <= np.linalg.norm(struck.velocity) <= most
    assert struck.start[0, 0] > (-0.2 if part in ("chest", "head") else 0.1)


def test_the_standing_foot_stays_and_nothing_goes_through_the_ground(made):
    _, gesture = made
    places, _ = forward_kinematics(gesture.motion)
    body = identify_joints(gesture.motion.skeleton)
    assert np.ptp(places[:, body.left.toe_or_foot, :2], axis=0).max() < 0.005
    assert places[..., 2].min() > -0.005


def test_knees_do_not_pop(made):
    """The leg's speed of stretching changes by no more than a body's can."""
    _, gesture = made
    places, _ = forward_kinematics(gesture.motion)
    body = identify_joints(gesture.motion.skeleton)
    for limb in (body.left, body.right):
        length = np.linalg.norm(places[:, limb.foot] - places[:, limb.upper_leg], axis=1)
        assert np.abs(np.diff(length, 2)).max() * 60**2 < 160.0


def test_the_factor_on_speed_keeps_the_touch():
    slow, fast = build_volley("pass", fps=60.0), build_volley("pass", fps=60.0, speed=1.5)
    assert slow.key == fast.key and fast.end < slow.end
    for at in (slow, fast):
        assert at.motion.skeleton.has_same_bones(slow.motion.skeleton)


def test_words_say_an_action_or_are_told_apart():
    known = set(VOCABULARY["discrete"]) | {"hand", "stroke"}
    assert all(known & set(recipe.labels.split()) for recipe in VOLLEYS.values())
