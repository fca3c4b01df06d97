"""The figures of touches on planted bodies: known ankle speeds, plant feet, strides, strikes and balls."""

import math
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.annotation import KeyMoment, Span, Timeline
from beyond_mocap.base.errors import line_spans
from beyond_mocap.evaluation import touch_figures, touches
from beyond_mocap.evaluation.html import build_touch_section
from beyond_mocap.evaluation.reference.reference_cache import load_reference
from beyond_mocap.evaluation.report import evaluate, flatten_report
from beyond_mocap.evaluation.touch_view import TouchView
from beyond_mocap.evaluation.touches import LegCourse
from beyond_mocap.evaluation.view import View
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import measure_leg_length
from beyond_mocap.motion.motion import Motion
from beyond_mocap.motion.track import BALL_RADIUS
from beyond_mocap.motion.track.ball_path import BallPath
from beyond_mocap.synthesis.quality.playback import playback_from_take

FPS = 30.0
KICK = KeyMoment(15.0, ("kick", "right"))  # 5 s after the start of a take of `cut`: the key frame of jog.bvh


def build_legs(run=0.0, kick=0.0, at=3.0, side=1, seconds=6.0, heading=0.0, speed=None) -> LegCourse:
    """A body that goes at `run` m/s along its heading; one ankle whips forward about second `at` at `kick` m/s.

    The whip lasts 0.2 s: the ankle's speed relative to the pelvis is a triangle with `kick` at its top.
    """
    times = np.arange(int(seconds * FPS)) / FPS
    whip = kick * np.clip(1.0 - np.abs(times - at) / 0.1, 0.0, None)
    shift = np.cumsum(whip) / FPS
    ahead = np.array([math.cos(heading), math.sin(heading), 0.0])
    left = np.array([-ahead[1], ahead[0], 0.0])
    pelvis = run * times[:, None] * ahead + [0.0, 0.0, 0.9]
    ankles = np.stack([pelvis + sign * 0.1 * left - [0.0, 0.0, 0.8] for sign in (1.0, -1.0)], axis=1)
    ankles[:, side] += shift[:, None] * ahead
    pace = np.full(len(times), run if speed is None else speed)
    return LegCourse(pelvis, ankles, ankles + 0.15 * ahead, np.full(len(times), heading), pace,
                     np.ones((len(times), 2), bool), 1.0)


@pytest.mark.parametrize("away, expected", [(0.0, 25 / 6), (0.12, 25 / 6), (0.16, 2.5), (0.25, 0.0)])
def test_a_reception_has_its_fastest_ankle_within_130_ms(away, expected):
    """A whip of 5 m/s: its top counts up to 0.13 s away, then only its slope. Differences over two frames flatten the
    top by a sixth.
    """
    legs = build_legs(run=2.0, kick=5.0, heading=0.7)
    assert touches.measure_reception(legs, 3.0 + away, 1) == pytest.approx(expected, abs=1e-6)
    assert touches.measure_reception(legs, 3.0 + away, None) == touches.measure_reception(legs, 3.0 + away, 1)
    assert touches.measure_reception(legs, 3.0, 0) == pytest.approx(0.0, abs=1e-9)
    assert math.isnan(touches.measure_reception(legs, 9.0, 1))


@pytest.mark.parametrize("fps", [30.0, 60.0])
def test_other_parts_are_measured_against_the_pelvis(kicker, fps):
    """A chest that moves back at 1.5 m/s while the whole body drifts; the head moves along with it at twice that."""
    skeleton, body = kicker.motion.skeleton, playback_from_take(kicker).body
    times = np.arange(int(4 * fps)) / fps
    positions = np.zeros((len(times), len(skeleton), 3)) + times[:, None, None] * [3.0, 0.0, 0.0]
    positions[:, body.chest, 0] -= 1.5 * times
    positions[:, body.head_or_neck, 0] -= 3.0 * times
    scale = 0.86 / measure_leg_length(skeleton)
    parts = ("thigh", "chest", "head")
    speeds = [touches.measure_body_reception(skeleton, positions, fps, part, 2.0) for part in parts]
    assert speeds == pytest.approx([0.0, 1.5 * scale, 3.0 * scale], abs=1e-9)


def test_labels_say_what_is_measured():
    feet = (("receive", "foot", "low"), ("trap",), ("receive",))
    assert all(touches.is_foot_reception(words) and not touches.is_kick(words) for words in feet)
    assert touches.is_body_reception(("receive", "body", "high")) and not touches.is_body_reception(("catchb",))
    assert all(touches.is_kick(words) for words in (("kick", "right"), ("pass",), ("volley", "kick")))
    assert not any(touches.is_kick(words) for words in (("header",), ("throwb", "high"), ("dribble",)))
    named = (("left",), ("right", "low"), ("left", "right"), ())
    assert [touches.find_side(words) for words in named] == [0, 1, None, None]


def build_kick(side=1, heading=0.4):
    """A body at 3 m/s with stances of plant, kicking and plant foot 0.6 and 1.2 m apart, kick at 3 s (frame 90).

    The plant foot stands 0.26 m beside and 0.11 m ahead of the kicking ankle then; the foot swings at 12 m/s.
    """
    legs = build_legs(run=3.0, heading=heading)
    ahead = np.array([math.cos(heading), math.sin(heading), 0.0])
    out = np.array([-ahead[1], ahead[0], 0.0]) * (1.0 if side else -1.0)  # towards the plant foot's side
    planted, ankles, plant = np.zeros((180, 2), bool), legs.ankles.copy(), 1 - side
    place = legs.ankles[90, side] + 0.26 * out + 0.11 * ahead
    planted[60:66, plant] = planted[70:76, side] = planted[84:100, plant] = True
    ankles[80:, plant] = place
    ankles[55:80, plant] = place - 1.8 * ahead
    swing = (np.arange(86, 95) - 90)[:, None] / FPS * (3.0 + 12.0) * ahead  # relative to the pelvis: 12 m/s
    ankles[86:95, side] = legs.ankles[90, side] + swing
    ankles[66:80, side] = place - 1.2 * ahead
    return LegCourse(legs.pelvis, ankles, ankles + 0.15 * ahead, legs.heading, legs.speed, planted, 0.9)


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("heading", [0.4, -2.5])
def test_a_kick_is_measured(side, heading):
    kick = touches.measure_kick(build_kick(side, heading), 3.0, side)
    assert kick.ankle_speed == pytest.approx(12.0, rel=1e-6)
    assert kick.foot_speed == pytest.approx(15.0 / 0.9, rel=1e-6)  # of the body as it is, before scaling
    assert (kick.plant_beside, kick.plant_ahead) == pytest.approx((0.26, 0.11), abs=1e-6)
    assert kick.stride_ratio == pytest.approx(1.2 / 0.6, rel=1e-6)
    assert kick.run_up == pytest.approx(3.0)


def test_a_kick_from_a_stand_has_no_stride():
    legs = build_kick()
    standing = replace(legs, planted=legs.planted & (np.arange(180) > 80)[:, None])
    in_the_air = replace(legs, planted=legs.planted & (np.arange(180) < 80)[:, None])
    assert math.isnan(touches.measure_kick(standing, 3.0, 1).stride_ratio)
    assert math.isnan(touches.measure_kick(in_the_air, 3.0, 1).stride_ratio)


def test_kicks_in_range():
    kicks = [touches.Kick(ankle_speed=speed, foot_speed=15.0, plant_beside=beside, plant_ahead=ahead,
                          stride_ratio=ratio, run_up=3.0) for speed, beside, ahead, ratio in
             ((9.0, 0.26, 0.11, 1.5), (11.0, 0.15, 0.11, math.nan), (13.0, 0.26, -0.3, 1.7), (10.0, 0.37, -0.05, 1.6))]
    found = touches.summarize_kicks(kicks)
    assert found["kicks"] == 4 and found["plant_in_range_share"] == 0.5
    assert found["ankle_speed_m_s_median"] == 10.5 and found["stride_ratio_median"] == pytest.approx(1.6)
    assert math.isnan(touches.summarize_kicks([])["plant_in_range_share"])


@pytest.mark.parametrize("kick, speed, strikes", [
    (6.5, 1.0, 1), (5.5, 1.0, 0), (9.0, 4.5, 0), (14.0, 4.5, 1), (-9.0, 1.0, 0)])
def test_strikes_are_faster_than_a_runner_and_forward(kick, speed, strikes):
    found = touches.find_strikes(build_legs(kick=kick * 1.2, speed=speed, at=2.0, side=0, heading=1.2))
    assert len(found) == strikes
    assert all(side == 0 and abs(second - 2.0) < 0.05 for second, side in found)


def test_locomotion_has_no_strikes(library):
    assert all(not find_clip_strikes(clip) for clip in library.clips)


def find_clip_strikes(clip):
    from beyond_mocap.evaluation.naturalness import measure_course
    from beyond_mocap.motion.motion import forward_kinematics

    positions, _ = forward_kinematics(clip.motion)
    course = measure_course(clip.motion.skeleton, positions, clip.motion.fps)
    legs = touches.measure_legs(clip.motion.skeleton, positions, clip.motion.fps, clip.contacts, course)
    return touches.find_strikes(legs)


def lead_ball(take, places) -> BallPath:
    """A ball at places {frame: (3,)}, linear between them."""
    times = take.start_time + np.arange(len(take.motion)) / FPS
    frames = sorted(places)
    path = [np.interp(np.arange(len(times)), frames, [places[frame][axis] for frame in frames]) for axis in range(3)]
    return BallPath(times, np.stack(path, axis=1), np.ones(len(times), bool))


def raise_thigh(take, at, reach=6) -> Motion:
    """The take's motion with its right thigh turned forward by 1.2 rad about a frame: the knee whips up."""
    body = playback_from_take(take).body
    rotations = take.motion.rotations.copy()
    for frame in range(at - reach, at + reach + 1):
        turn = quaternion.from_rotation_vector(np.array([0.0, -1.2 * (1 - abs(frame - at) / reach), 0.0]))
        rotations[frame, body.right.upper_leg] = quaternion.multiply(turn, rotations[frame, body.right.upper_leg])
    return replace(take.motion, rotations=rotations)


@pytest.fixture(scope="module")
def kicker(cut):
    """A jog whose key moment is asked for at 15 s, output frame 150, and played there."""
    return cut(("jog.bvh", 0, 300), requested=(KICK,))


def test_a_ball_through_a_thigh(kicker, library, track_of):
    """In frames 60 to 69 the ball's middle lies in the middle of the left thigh; elsewhere it is 3 m away."""
    played = playback_from_take(kicker)
    body = played.body
    thigh = 0.5 * (played.positions[:, body.left.upper_leg] + played.positions[:, body.left.lower_leg])
    inside = (np.arange(300) >= 60) & (np.arange(300) < 70)
    path = BallPath(played.times, np.where(inside[:, None], thigh, thigh + [0.0, 3.0, 0.0]), np.ones(300, bool))
    report = evaluate(replace(kicker, ball=path), track_of(kicker), library)
    found = report["touches"]["ball_inside"]
    assert (found["ball_frames"], found["inside_frames"]) == (300, 10)
    assert found["inside_share"] == pytest.approx(1 / 30, rel=1e-3)
    assert found["depth_mm_max"] == pytest.approx(1000 * (0.0675 + BALL_RADIUS), rel=0.01)
    (line,) = [line for line in report["warnings"] if "inside the body" in line]
    assert line.startswith("12.0-12.3 s: the ball is up to 17") and line.endswith("(thigh)")
    assert line_spans(line) == ((pytest.approx(12.0), pytest.approx(12.3)),)


def test_without_a_ball_nothing_is_inside_or_fits(kicker, library, track_of):
    report = evaluate(kicker, track_of(kicker), library)
    found = report["touches"]
    assert found["ball_inside"]["ball_frames"] == 0 and found["ball_inside"]["inside_frames"] is None
    assert report["unknown"]["touches.ball_inside.inside_frames"] == "no ball"
    assert report["unknown"]["touches.fast_kick.ankle_speed_m_s_median"] == "no ball leaves a kick faster than 18 m/s"
    assert found["fit"] == {"touches": 0, "fit_share": None, "part_fit_share": None, "side_fit_share": None}
    assert found["kick"]["kicks"] == 1 and found["fast_kick"]["kicks"] == 0


@pytest.mark.parametrize("speed, is_fast, is_compared", [(6.0, False, True), (20.0, True, True), (4.0, False, False)])
def test_the_balls_speed_after_a_kick(kicker, library, track_of, speed, is_fast, is_compared):
    """The ball lies still until the kick in frame 150 and then leaves at a known speed."""
    start = playback_from_take(kicker).positions[150, 0] + [0.5, -0.2, -0.6]
    ball = lead_ball(kicker, {0: start, 150: start, 160: start + [speed / 3.0, 0.0, 0.0], 299: start})
    take = replace(kicker, ball=ball)
    (kick,) = TouchView(View(playback_from_take(take), None, take.timeline, library)).measure_kicks()
    assert kick.ball_speed == pytest.approx(speed, rel=1e-6)
    report = evaluate(take, track_of(take), library)["touches"]
    assert (report["fast_kick"]["kicks"], report["ball_speed"]["kicks"]) == (is_fast, is_compared)


def test_ball_speed_over_foot_speed():
    """6 m/s of ball after feet of 5, 6 and 3 m/s: 1.2, 1.0 and 2.0, one of which is in range; a nudge is none."""
    kick = touches.measure_kick(build_kick(), 3.0, 1, 6.0)
    kicks = [replace(kick, foot_speed=foot) for foot in (5.0, 6.0, 3.0)] + [replace(kick, ball_speed=3.0)]
    found = touch_figures.summarize_ball_speeds(kicks)
    assert found == {"kicks": 3, "ratio_median": pytest.approx(1.2), "ratio_in_range_share": pytest.approx(1 / 3)}
    assert math.isnan(touch_figures.summarize_ball_speeds([])["ratio_median"])


@pytest.mark.parametrize("height, across, part_fits, side_fits", [
    (0.11, -0.2, 1.0, 1.0), (0.11, 0.1, 1.0, 1.0), (0.11, 0.4, 1.0, 0.0), (1.4, -0.2, 0.0, 1.0), (1.4, 0.4, 0.0, 0.0)])
def test_part_and_side_fit_the_ball(kicker, library, track_of, height, across, part_fits, side_fits):
    """A right kick fits a ball up to the hips on the right, not one at the head or 0.4 m on the left."""
    played = playback_from_take(kicker)
    view = View(played, None, None, library)
    heading = view.course.heading[150]
    to_ball = quaternion.rotate_level(np.array([0.4, across]), heading)
    ball = np.array([*(played.pelvis[150] + to_ball), height])
    take = replace(kicker, ball=lead_ball(kicker, {0: ball, 299: ball}))
    found = evaluate(take, track_of(take), library)["touches"]
    assert found["fit"] == {"touches": 1, "fit_share": part_fits * side_fits, "part_fit_share": part_fits,
                            "side_fit_share": side_fits}


@pytest.mark.parametrize("asked, at, unasked, second", [
    ((), 160, 1, 0),  # nothing is asked for
    ((KeyMoment(15.0, ("receive", "foot")),), 152, 0, 0),  # the reception's own foot
    ((KeyMoment(15.0, ("receive", "foot")),), 190, 1, 1),  # 1.3 s after a reception
    ((KeyMoment(15.0, ("receive", "foot")),), 240, 1, 0),  # 3 s after it
    ((KeyMoment(15.0, ("receive", "foot")), KeyMoment(16.4, ("kick", "right"))), 190, 0, 0),  # a kick is asked for
])
def test_second_strikes_are_those_that_nothing_asks_for(cut, library, monkeypatch, asked, at, unasked, second):
    take = cut(("walk.bvh", 0, 300), timeline=Timeline(keys=asked))
    monkeypatch.setattr(touches, "find_strikes", lambda legs: [(at / FPS, 1)])
    view = TouchView(View(playback_from_take(take), None, take.timeline, library))
    assert (len(view.strikes), len(view.second_strikes)) == (unasked, second)
    lines = [line for line in touch_figures.list_touch_messages(view) if "nothing asks for" in line]
    assert [line_spans(line) for line in lines] == [((pytest.approx(10 + at / 30),) * 2,)] * unasked


def test_strikes_below_a_label_of_the_foot_are_asked_for(cut, library, monkeypatch):
    monkeypatch.setattr(touches, "find_strikes", lambda legs: [(5.0, 1)])
    count = {}
    for words in (("juggling",), ("dribble", "running"), ("walking",)):
        take = cut(("walk.bvh", 0, 300), timeline=Timeline(spans=(Span(14.0, 16.0, words),)))
        count[words[0]] = len(TouchView(View(playback_from_take(take), None, take.timeline, library)).strikes)
    assert count["dribble"] == count["walking"] == 1


def test_a_knee_that_whips_is_found_in_a_whole_take(cut, library, track_of):
    take = cut(("stand.bvh", 0, 300))
    assert evaluate(take, track_of(take), library)["touches"]["unasked_strike_count"] == 0
    whipped = replace(take, motion=raise_thigh(take, 150, reach=4))
    report = evaluate(whipped, track_of(take), library)
    assert report["touches"]["unasked_strike_count"] == 1
    (line,) = [line for line in report["warnings"] if "a foot swings like a kick" in line]
    assert line_spans(line)[0][0] == pytest.approx(15.0, abs=0.15)


def test_substituted_and_synthetic_key_moments_are_listed(cut, library, track_of):
    take = cut(("jog.bvh", 0, 300), requested=(KICK, KeyMoment(17.0, ("header",))))
    found = evaluate(take, track_of(take), library)["touches"]
    assert (found["moment_count"], found["substituted_count"], found["synthetic_count"]) == (2, 1, 0)
    (row,) = found["substituted"]
    assert (row["time_s"], row["labels"], row["is_substituted"], row["is_synthetic"]) == (17.0, ["header"], True, False)
    assert row["clip"] == "jog.bvh" and "jogging" in row["shown"]
    renamed = replace(take, clips=(".beyond_mocap/made-gait/kick_top_3.7.bvh",))
    assert evaluate(renamed, track_of(take), library)["touches"]["synthetic_count"] == 2


def test_the_recordings_own_touches_are_those_of_the_whole_library(kicker, library, track_of):
    """jog.bvh has one labelled kick; the take's kick is that one, so both have the same foot."""
    report = evaluate(kicker, track_of(kicker), library)
    kick = report["touches"]["kick"]
    assert kick["kicks"] == kick["source_kicks"] == 1 and len(load_reference(library, FPS).kicks) == 1
    for leaf in ("ankle_speed_m_s_median", "plant_beside_m_median", "plant_ahead_m_median", "run_up_m_s_median"):
        assert kick[leaf] == pytest.approx(kick[f"source_{leaf}"], rel=1e-3, abs=2e-3)
    reason = "the library has no labelled reception with the foot"
    assert report["unknown"]["touches.reception.source_speed_m_s_median"] == reason


def test_pages_show_the_group(kicker, library, track_of):
    take = replace(kicker, timeline=Timeline(keys=(KICK, KeyMoment(17.0, ("header",)))))
    report = evaluate(take, track_of(take), library)
    text = str(build_touch_section(report))
    for name in ("At the ball", "Kicking foot&#x27;s speed, all kicks, m/s", "Second strikes", "1 kick", "header"):
        assert name in text
    assert "touches." not in text
    del report["touches"]
    assert not build_touch_section(report)
    assert all(f"touches.{name}" in flatten_report(evaluate(kicker, track_of(kicker), library))
               for name in touch_figures.TITLES)


@pytest.mark.parametrize("away, height, is_reachable", [(0.5, 0.11, True), (1.05, 0.11, True), (1.3, 0.11, False),
                                                        (0.5, 1.9, False)])
def test_only_balls_in_reach_have_to_be_met(kicker, library, track_of, away, height, is_reachable):
    """A running right kick reaches 1.1 m from its track, no ball above the head; the ball itself is met or not."""
    track = track_of(kicker)
    place = [np.interp(15.0, track.times, track.positions[:, axis]) for axis in (0, 1)]
    ball = np.array([place[0] + away, place[1], height])
    track = replace(track, ball=np.tile(ball, (len(track.times), 1)), ball_height_known=None)
    take = replace(kicker, ball=lead_ball(kicker, {0: ball, 299: ball}))
    report = evaluate(take, track, library)
    found = report["touches"]["contact"]
    assert report["keys"][0]["reachable"] is is_reachable
    assert (found["touches"], found["reachable_touches"]) == (1, int(is_reachable))
    met = float(report["keys"][0]["met_gap_m"] <= 0.005)
    assert (found["met_share"], found["reachable_met_share"]) == (met, met if is_reachable else None)
