"""A ball that is held goes with the hands, one that is punched or parried does not."""

import numpy as np
import pytest

from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.motion.track import BALL_RADIUS
from beyond_mocap.synthesis.construct.held_ball import HandTouch, carry_in_hands, hold_in_spans
from beyond_mocap.synthetic.actions.action import ActionSetting
from beyond_mocap.synthetic.actions.table import ACTIONS

FPS = 60.0
SKELETON = build_adult_skeleton()
BODY = identify_joints(SKELETON)
REACH = 0.16  # m from a hand's joint to the centre of a ball that it touches


def play(name, words, passes=False, at=(0.35, 0.0, 1.1), low=0.0):
    """An action with the feed's ball at the player: ball, key frame, hands (T, 2, 3), and when it is held.

    at: m, the ball from the pelvis' place on the ground; low: s before the key at which the clip begins, 0 all of it.
    """
    action = next(one for one in ACTIONS if one.name == name)
    gesture = action.build(ActionSetting(skeleton=SKELETON, fps=FPS))
    places, _ = forward_kinematics(gesture.motion)
    hands, key = places[:, [BODY.left.hand, BODY.right.hand]], round(gesture.key * FPS)
    feed = places[:, BODY.hips] * [1.0, 1.0, 0.0] + at
    if passes:
        feed = feed + np.outer(np.arange(len(feed)) - key, [-8.0 / FPS, 0.0, 0.0])
    in_hand = hands[key, 1] + [0.0, 0.0, REACH] if "out " in words else hands[key].mean(axis=0)
    meets = places[key, BODY.right.toe] + [0.1, 0.0, 0.1] if name == "punt" else in_hand
    feed[key] = meets
    touch = HandTouch(frames=(key, key), words=tuple(words.split()), high=len(feed) - 1,
                      low=key - round(low * FPS) if low else 0)
    ball, held = carry_in_hands(gesture.motion, feed, [touch])
    assert np.array_equal(ball[key], meets)
    return ball, feed, key, hands, held


@pytest.mark.parametrize("name, words, seconds", [
    ("throw-in with a run-up", "throwb high", -0.3), ("chest throw", "throwb middle", -0.4),
    ("catch chest", "catchb middle", 0.6), ("catch low", "catchb low", 0.6),
    ("dive long low catch", "catchb dive low right", 0.5), ("catch slide", "catchb low slide", 0.6),
])  # fmt: skip
def test_a_held_ball_touches_both_hands(name, words, seconds):
    ball, _, key, hands, held = play(name, words)
    at = key + round(seconds * FPS)
    assert any(first <= at <= last for first, last in held)
    away = np.linalg.norm(hands[at] - ball[at], axis=1)
    assert REACH - 0.01 < away.min() and away.max() < REACH + 0.12  # a trunk or a knee may be between them


BESIDE = [("throw-in", "throwb high", 0.3), ("throw out", "throwout right", 0.3), ("roll out", "rollout right", 0.3),
          ("punt", "punt foot top right", 0.45)]


@pytest.mark.parametrize("name, words, seconds", BESIDE)
def test_who_throws_or_punts_has_a_ball_that_the_feed_leaves_on_the_line(name, words, seconds):
    ball, feed, key, hands, held = play(name, words, at=(0.3, 2.3, BALL_RADIUS))
    at = key - round(seconds * FPS)
    assert len(held) == 1 and held[0][0] <= at
    away = np.linalg.norm(hands[at] - ball[at], axis=1).min()
    assert away < REACH + 0.12
    _, far, *_, held = play(name, words, at=(0.3, 2.8, BALL_RADIUS))
    assert held == []


def test_a_ball_comes_into_the_hands_before_the_clip_that_holds_it():
    ball, *_, key, _, held = play("throw-in", "throwb high", at=(0.3, 2.3, BALL_RADIUS), low=0.5)
    assert held == [(key - round(0.5 * FPS), key)]
    assert np.linalg.norm(np.diff(ball[: held[0][0] + 1], axis=0), axis=1).max() * FPS < 6.0


def test_a_ball_that_is_thrown_overarm_swings_with_the_hand():
    ball, _, key, hands, _ = play("throw out", "throwout right")
    at = slice(key - round(0.3 * FPS), key)
    away = np.linalg.norm(ball[at] - hands[at, 1], axis=1)
    assert np.ptp(away) < 0.08 and np.linalg.norm(np.diff(ball[at], axis=0), axis=1).max() * FPS > 5.0


def test_the_ball_of_a_punt_falls_from_the_hands_to_the_foot():
    ball, _, key, _, held = play("punt", "punt foot top right")
    (_, last), = held
    assert last == key
    fall = np.diff(ball[key - round(0.12 * FPS) : key + 1, 2], 2) * FPS**2
    assert fall == pytest.approx(-9.81, abs=0.05)


@pytest.mark.parametrize("name, words", [("punch", "punch high jump"), ("parry", "stomp middle"),
                                         ("catch chest", "catchb middle")])
def test_a_ball_that_comes_and_goes_is_not_held(name, words):
    ball, feed, *_, held = play(name, words, passes=True)
    assert held == [] and np.array_equal(ball, feed)


@pytest.mark.parametrize("name", ["holding the ball", "sitting with the ball"])
def test_a_ball_is_held_while_a_span_shows_it(name):
    action = next(one for one in ACTIONS if one.name == name)
    gesture = action.build(ActionSetting(skeleton=SKELETON, fps=FPS))
    motion = gesture.motion
    feed = motion.root_positions * [1.0, 1.0, 0.0] + [0.4, 0.0, BALL_RADIUS]
    ball, held = hold_in_spans(motion, feed, [(round(gesture.start * FPS), round(gesture.end * FPS))])
    (first, last), = held
    hands = forward_kinematics(motion)[0][:, [BODY.left.hand, BODY.right.hand]]
    middle = (first + last) // 2
    assert np.linalg.norm(hands[middle] - ball[middle], axis=1) == pytest.approx(REACH, abs=0.02)
    assert np.linalg.norm(np.diff(ball, axis=0), axis=1).max() * FPS < 6.0
    unknown = np.full_like(feed, np.nan)
    assert np.isnan(hold_in_spans(motion, unknown, [(0, 50)])[0]).all()
