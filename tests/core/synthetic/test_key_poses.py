"""Synthetic actions of key poses: flights fall freely, feet stand, nothing is below the ground, hands meet the ball."""

import numpy as np
import pytest

from beyond_mocap.annotation.labels import read_labels
from beyond_mocap.annotation.vocabulary import SIDES
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.mass import compute_centre_of_mass
from beyond_mocap.motion.mirror import mirror
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.synthetic.actions.action import ActionSetting
from beyond_mocap.synthetic.actions.ball_poses import BALL_POSES
from beyond_mocap.synthetic.actions.body_gestures import GESTURES
from beyond_mocap.synthetic.actions.celebrations import CELEBRATIONS
from beyond_mocap.synthetic.actions.keeper_dives import DIVES
from beyond_mocap.synthetic.actions.keeper_saves import SAVES
from beyond_mocap.synthetic.actions.keeper_throws import THROWS
from beyond_mocap.synthetic.actions.key_poses import build_key_poses, mirror_foot
from beyond_mocap.synthetic.actions.table import ACTIONS
from beyond_mocap.synthetic.lying import iter_surface
from beyond_mocap.synthetic.performers import build_body

FPS = 60.0
RECIPES = {**SAVES, **DIVES, **THROWS, **CELEBRATIONS, **GESTURES, **BALL_POSES}
STANDING = [name for name, recipe in RECIPES.items() if not any(speed for _, speed in recipe.speeds)]
BODY = identify_joints(build_adult_skeleton())
FEET = [BODY.left.foot, BODY.left.toe, BODY.right.foot, BODY.right.toe]


class Built:
    """An action of the adult, with its joints' positions."""

    def __init__(self, name):
        self.recipe, self.gesture = RECIPES[name], build_key_poses(RECIPES[name], fps=FPS)
        self.motion = self.gesture.motion
        self.places, self.world = forward_kinematics(self.motion)
        self.times = np.arange(len(self.motion)) / FPS - self.gesture.key

    def at(self, time):
        """Positions (J, 3) at a time from the key moment."""
        return self.places[int(round((time + self.gesture.key) * FPS))]


@pytest.fixture(scope="module")
def build():
    known = {}
    return lambda name: known[name] if name in known else known.setdefault(name, Built(name))


@pytest.mark.parametrize("name", RECIPES)
def test_no_part_of_the_body_is_below_the_ground(build, name):
    one = build(name)
    heights = [place[:, 2].min() for _, place, _ in iter_surface(one.motion.skeleton, one.places, one.world)]
    assert min(heights) > -0.02  # as deep as the eye forgives a boot (`boots.below_share`)
    trunk = {BODY.hips, *BODY.spine, BODY.head}
    assert min(one.places[:, joint, 2].min() for joint in trunk) > 0.06


@pytest.mark.parametrize("name", RECIPES)
def test_an_action_begins_and_ends_as_its_gait_does(build, name):
    one = build(name)
    low = one.places[:, FEET, 2]
    for frame in (0, -1) if name in STANDING else ():
        assert low[frame].max() < low[0].max() + 0.005
        rest = [BODY.hips, BODY.head, BODY.left.hand, BODY.right.hand, *FEET]  # straight knees magnify the hips' sway
        speed = np.linalg.norm((one.places[frame] - one.places[frame - 1 if frame else 1])[rest], axis=1).max() * FPS
        assert speed < 0.1
    upright = one.places[[0, -1], BODY.head, 2] - one.places[[0, -1], BODY.hips, 2]
    assert upright.min() > 0.55


@pytest.mark.parametrize("name", STANDING)
def test_feet_that_rest_on_the_ground_stand_still(build, name):
    one = build(name)
    for side, rows in ((BODY.left, one.recipe.left_foot), (BODY.right, one.recipe.right_foot)):
        for before, after in zip(rows or (), (rows or ())[1:]):
            stays = before[1:4] == after[1:4] and before[3] == 0 and abs(before[6]) < 10 and before[4] <= 42 >= after[4]
            if stays and after[0] - before[0] > 0.1:
                inside = (one.times > before[0] + 0.02) & (one.times < after[0] - 0.02)
                turned = 0.11 * np.radians(abs(after[5] - before[5]))  # on the spot, about the ankle
                assert np.ptp(one.places[inside, side.toe], axis=0).max() < 0.012 + turned, (name, before, after)


FLIGHTS = [(name, flight) for name, recipe in RECIPES.items() for flight in recipe.flights]


@pytest.mark.parametrize("name, flight", FLIGHTS)
def test_the_centre_of_mass_falls_freely_in_a_flight(build, name, flight):
    one = build(name)
    centre = compute_centre_of_mass(BODY, one.places)
    inside = (one.times > flight[0] + 0.03) & (one.times < flight[1] - 0.03)
    fit = np.polyfit(one.times[inside], centre[inside], 2)
    assert -10.1 < 2.0 * fit[0, 2] < -9.2
    assert np.abs(fit[0, :2]).max() < 0.8


@pytest.mark.parametrize("name", [name for name in (*SAVES, *DIVES) if "catch" in name or "punch" in name])
def test_both_hands_are_a_ball_apart_at_the_key_moment(build, name):
    one = build(name)
    places = one.at(0.0)
    left, right = places[BODY.left.hand], places[BODY.right.hand]
    apart = 0.12 if "punch" in name else 0.24
    assert np.linalg.norm(left - right) == pytest.approx(apart, abs=0.01)
    height = 0.5 * (left + right)[2]
    low, high = {"low": (0.1, 0.35), "chest": (1.0, 1.35), "high": (1.55, 2.5), "punch": (2.0, 2.5)}[
        next(word for word in ("chest", "punch", "low", "high") if word in name)]
    assert low < height < high


def test_dives_go_as_far_as_their_labels_say(build):
    far = {name: np.ptp(build(name).places[:, BODY.hips, 1]) for name in DIVES}
    assert far["dive_long_high_push"] > 2.4 > 2.0 > far["dive_short_high_push"] > 1.2
    assert far["dive_long_low_push"] > 2.2 > 1.2 > far["dive_short_low_push"] > 0.8
    assert all(build(name).places[:, BODY.hips, 1].min() < -0.8 for name in DIVES)  # to the right
    speed = np.gradient(build("dive_long_high_push").places[:, BODY.hips, 1], 1.0 / FPS)
    assert 2.7 < -speed.min() < 4.5  # recorded: 3.4 to 4.4 m/s


def test_a_dive_lands_on_its_side_and_gets_up(build):
    one = build("dive_long_high_catch")
    shoulders = [one.at(0.6)[side.upper_arm, 2] for side in (BODY.left, BODY.right)]
    assert shoulders[0] > shoulders[1] + 0.2 and one.at(0.6)[BODY.hips, 2] < 0.25
    assert one.places[-1, BODY.hips, 2] == pytest.approx(one.places[0, BODY.hips, 2], abs=0.02)


def test_the_mirrored_dive_goes_to_the_other_side(build):
    one = build("dive_short_low_push")
    places, _ = forward_kinematics(mirror(one.motion))
    swapped = one.places[:, list(BODY.mirror)] * [1.0, -1.0, 1.0]
    np.testing.assert_allclose(places, swapped, atol=1e-3)


def test_hands_end_where_gestures_need_them(build):
    def hands(name, time):
        places = build(name).at(time)
        return places, places[[BODY.left.hand, BODY.right.hand]]

    places, both = hands("calling", 0.5)
    assert np.linalg.norm(both - places[BODY.head], axis=1).max() < 0.3
    places, both = hands("drinking", 0.6)
    assert np.linalg.norm(both[1] - places[BODY.head]) < 0.3 < np.linalg.norm(both[0] - places[BODY.head])
    places, both = hands("resting", 0.5)
    assert np.abs(both[:, 2] - places[BODY.hips, 2]).max() < 0.2
    assert np.abs(both[:, 1] - places[BODY.hips, 1]).max() < 0.3
    places, both = hands("tying", 0.5)
    assert np.linalg.norm(both - places[BODY.left.foot], axis=1).max() < 0.35
    places, both = hands("pointing", 0.1)
    assert both[1, 0] - places[BODY.hips, 0] > 0.5 and abs(both[1, 2] - places[BODY.right.upper_arm, 2]) < 0.15
    apart = [np.linalg.norm(np.subtract(*hands("clapping", time)[1])) for time in (0.0, 0.15)]
    assert max(apart) - min(apart) > 0.15


def test_the_set_position_is_low_and_wide(build):
    places, leg = build("ready").at(0.6), build("ready").places[0, BODY.hips, 2]
    apart = places[BODY.left.foot, 1] - places[BODY.right.foot, 1]
    assert leg / 3.0 < apart < leg / 2.0 and leg - places[BODY.hips, 2] == pytest.approx(0.14, abs=0.02)


def test_celebrations_differ():
    names = [name for name, recipe in CELEBRATIONS.items() if "celebration" in recipe.labels.split()]
    assert len(names) >= 6 and len({CELEBRATIONS[name].labels for name in names}) == len(names)


@pytest.mark.parametrize("height", [2.25, 2.5])
def test_a_jump_to_the_ball_is_as_high_as_the_ball(height):
    action = next(action for action in ACTIONS if action.name == "catch high")
    gesture = action.build(ActionSetting(skeleton=build_adult_skeleton(), fps=FPS, height=height))
    places, _ = forward_kinematics(gesture.motion)
    frame = int(round(gesture.key * FPS))
    hands = places[:, [BODY.left.hand, BODY.right.hand], 2].mean(axis=1)
    assert hands[frame] == pytest.approx(height - 0.1, abs=0.03)
    centre = compute_centre_of_mass(BODY, places)[:, 2]
    assert abs(int(centre.argmax()) - frame) <= 2


@pytest.mark.parametrize("name", ["catch_low", "dive_short_low_catch", "dive_long_high_push", "knee_slide", "tying"])
def test_a_small_body_with_other_proportions_stays_above_the_ground(name):
    skeleton = build_body(1.62, np.random.default_rng(3))
    motion = build_key_poses(RECIPES[name], skeleton, fps=FPS).motion
    places, world = forward_kinematics(motion)
    assert min(place[:, 2].min() for _, place, _ in iter_surface(skeleton, places, world)) > -0.03
    assert places[-1, BODY.hips, 2] == pytest.approx(places[0, BODY.hips, 2], abs=0.02)


def test_every_recipe_is_an_action_of_its_own_name():
    names = [action.name for action in ACTIONS]
    assert len(set(names)) == len(names)
    assert {name.replace("_", " ") for name in RECIPES} <= set(names)
    assert {action.is_span for action in ACTIONS if action.name in ("punch", "pointing")} == {True, False}


def test_every_label_of_a_recipe_is_in_the_vocabulary():
    known = set(read_labels())
    assert {word for recipe in RECIPES.values() for word in recipe.labels.split()} - known - set(SIDES) == set()


def test_the_same_recipe_gives_the_same_bits():
    again = [build_key_poses(RECIPES["punch"], fps=30.0).motion.rotations for _ in range(2)]
    assert (again[0] == again[1]).all()


def test_rows_of_a_foot_are_mirrored():
    assert mirror_foot(((0.0, 1, 2, 3, 4, 5, 6),)) == ((0.0, 1, -2, 3, 4, -5, -6),)
