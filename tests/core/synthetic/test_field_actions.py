"""Field players' actions: on the ground, at the ball, in free fall while in the air, and back on their feet."""

from __future__ import annotations

import numpy as np
import pytest

from beyond_mocap.annotation import VOCABULARY
from beyond_mocap.annotation.ball_contact import choose_part_by_height
from beyond_mocap.library.missing_actions import ActionMoment, find_action
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.mass import compute_centre_of_mass
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.motion.supports import GRAVITY
from beyond_mocap.synthesis.search.candidate_index import ACTING
from beyond_mocap.synthetic.actions.action import ActionSetting
from beyond_mocap.synthetic.actions.field_table import FIELD_ACTIONS
from beyond_mocap.synthetic.actions.kick_table import KICK_ACTIONS

FPS = 60.0
ADULT = ActionSetting(skeleton=build_adult_skeleton(), fps=FPS)
BODY = identify_joints(ADULT.skeleton)
ROWS = {action.name: action for action in (*FIELD_ACTIONS, *KICK_ACTIONS)}
SPANS_WITHOUT_BODY = {("hold", "sitting")}
WITHOUT_BODY = {
    ("getting_up", "with"),  # the thesis lost the second half of this label
    ("catchb", "slide"),
}  # fmt: skip


def build(name: str, speed: float = 0.0, height: float | None = None):
    setting = ActionSetting(skeleton=ADULT.skeleton, fps=FPS, speed=speed, height=height, neutral=ADULT.neutral)
    gesture = ROWS[name].build(setting)
    return gesture, forward_kinematics(gesture.motion)[0]


def measure_fall(height: np.ndarray) -> np.ndarray:
    return np.diff(height, 2) * FPS**2


@pytest.mark.parametrize("name", sorted(ROWS))
def test_an_action_stays_above_the_ground_and_begins_and_ends_on_its_feet(name):
    action = ROWS[name]
    speed = action.speeds[:2][-1] if action.speeds else 0.0
    gesture, places = build(name, speed, float(np.mean(action.heights)) if action.heights else None)
    assert np.isfinite(places).all() and places[..., 2].min() > -0.01
    assert gesture.start < gesture.end <= gesture.motion.duration + 1e-6
    assert action.is_span or gesture.start < gesture.key < gesture.end
    stands = places[[0, -1], BODY.hips, 2] > 0.8
    assert stands[1] and (stands[0] or "getting_up" in action.labels or action.is_span)


@pytest.mark.parametrize("name, speed", [("jumping header", 0.0), ("running header", 4.4)])
@pytest.mark.parametrize("height", [2.05, 2.3])
def test_a_header_meets_the_ball_at_its_height_in_free_fall(name, speed, height):
    gesture, places = build(name, speed, height)
    key = round(gesture.key * FPS)
    assert places[key, BODY.head, 2] == pytest.approx(height - 0.09, abs=0.05)
    assert places[key - 8 : key + 9, [BODY.left.toe, BODY.right.toe], 2].min() > 0.1
    assert measure_fall(places[key - 8 : key + 9, BODY.hips, 2]) == pytest.approx(-GRAVITY, abs=0.6)


@pytest.mark.parametrize("height", [0.5, 0.8, 1.2])
def test_a_dive_is_level_at_the_ball_and_lands_on_the_front(height):
    gesture, places = build("diving header", 4.4, height)
    key = round(gesture.key * FPS)
    head, hips = places[key, BODY.head], places[key, BODY.hips]
    assert head[2] == pytest.approx(height, abs=0.2) and head[0] - hips[0] > 0.45
    lying = places[key + 28 : key + 42]
    assert lying[:, BODY.hips, 2].max() < 0.3 and lying[:, BODY.head, 2].max() < 0.5


@pytest.mark.parametrize("name, speed", [("diving header", 4.4), ("overhead kick", 0.0), ("half overhead kick", 0.0),
                                         ("flight after a tackle", 4.4)])
def test_the_centre_of_mass_falls_freely_whatever_the_limbs_do(name, speed):
    gesture, places = build(name, speed, float(np.mean(ROWS[name].heights)) if ROWS[name].heights else None)
    key = round(gesture.key * FPS)
    centre = compute_centre_of_mass(BODY, places)[key - 9 : key + 4]
    fall = 2.0 * np.polyfit(np.arange(len(centre)) / FPS, centre, 2)[0]
    assert fall[2] == pytest.approx(-GRAVITY, abs=2.0) and np.abs(fall[:2]).max() < 1.0, fall


def test_a_half_overhead_kick_lies_on_its_side_and_an_overhead_kick_on_its_back():
    def look_up(name):
        gesture, places = build(name, 0.0, 1.45)
        now = places[round(gesture.key * FPS)]
        across = now[BODY.left.upper_leg] - now[BODY.right.upper_leg]
        return abs(across[2]) / np.linalg.norm(across)

    assert look_up("half overhead kick") > 0.7 > 0.3 > look_up("overhead kick")


@pytest.mark.parametrize("name", ["getting up from the front", "getting up from the back"])
def test_a_get_up_shows_how_the_body_got_to_the_ground(name):
    gesture, places = build(name)
    hips = places[:, BODY.hips, 2]
    assert hips[0] > 0.8 and hips[: round(gesture.key * FPS)].min() < 0.3
    assert np.abs(np.diff(hips)).max() * FPS < 3.5  # no snap


def test_a_slide_reaches_ahead_near_the_ground_and_slows_down_as_grass_lets_it():
    gesture, places = build("slide tackle", 5.6)
    key = round(gesture.key * FPS)
    foot, hips = places[key, BODY.right.foot], places[key, BODY.hips]
    assert foot[0] - hips[0] > 0.7 and foot[2] < 0.2 and hips[2] < 0.35
    speed = np.gradient(places[:, BODY.hips, 0]) * FPS
    slowing = np.diff(speed[key : key + 45]) * FPS
    assert -7.0 < np.median(slowing) < -4.0


def walk(tree, above=()):
    for word, below in tree.items():
        yield (*above, word)
        yield from walk(below, (*above, word))


def test_every_label_of_a_span_that_is_no_gait_has_a_body():
    acting = {words for words in walk(VOCABULARY["continuous"]) if words[0] in ACTING}
    lacking = {words for words in acting if find_action(ActionMoment(labels=frozenset(words), is_span=True)) is None}
    assert lacking <= SPANS_WITHOUT_BODY


@pytest.mark.parametrize("words", ["receive body high", "receive thigh high", "receive foot high inside", "block slide",
                                   "block", "slide", "tackle slide", "intercept slide"])
@pytest.mark.parametrize("height", [0.11, 0.6, 1.3])
def test_labels_across_branches_have_a_body_at_any_height(words, height):
    labels = choose_part_by_height(words.split(), height)
    action = find_action(ActionMoment(labels=frozenset(labels), speed=4.0, height=height))
    assert action is not None and ("slide" not in words or "slide" in action.labels)


def test_players_who_move_are_not_dragged_through_a_move_from_a_stand():
    names = [find_action(ActionMoment(labels=frozenset(words.split()), speed=speed)).name
             for words in ("scissors", "tackle block", "intercept") for speed in (0.0, 2.0)]
    assert names == ["scissors feint", "scissors feint on the way", "block tackle", "block tackle on the way",
                     "interception", "interception on the way"]


def test_every_label_of_a_key_moment_has_a_body():
    lacking = {words for words in walk(VOCABULARY["discrete"]) if find_action(ActionMoment(labels=frozenset(words)))
               is None}
    assert lacking <= WITHOUT_BODY
