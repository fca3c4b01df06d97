"""How a body's mass moves, on planted courses: every figure finds the acceleration, force and lean that was planted."""

import math
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.appearance.body import build_body
from beyond_mocap.appearance.boots import build_boots
from beyond_mocap.appearance.mesh import MATERIALS, deform_body
from beyond_mocap.evaluation.body_physics import measure_body_physics, summarize_physics
from beyond_mocap.evaluation.boots import measure_boot_heights, measure_lowest_point
from beyond_mocap.evaluation.html import build_physics_section
from beyond_mocap.evaluation.naturalness import measure_course
from beyond_mocap.evaluation.physics import (
    MassCourse,
    compute_bounce,
    measure_flights,
    measure_leans,
    measure_pushes,
    measure_steps,
)
from beyond_mocap.evaluation.physics_figures import measure_physics
from beyond_mocap.evaluation.report import evaluate, evaluate_played, flatten_report
from beyond_mocap.evaluation.sprint_form import measure_knee_flexion, measure_trunk_lean
from beyond_mocap.evaluation.view import View
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.lean import Lean
from beyond_mocap.motion.motion import forward_kinematics, place_motion
from beyond_mocap.motion.supports import Stances
from beyond_mocap.motion.track import Track
from beyond_mocap.synthesis.quality.playback import playback_from_tables
from beyond_mocap.synthetic.gait import build_gait

FPS, COUNT = 30.0, 300
TIMES = np.arange(COUNT) / FPS


def build_course(centre=None, height=0.0, speed=5.0, stances=((), (), ()), lean=None, crouch=None) -> MassCourse:
    """A body of 10 s whose feet are at one height, with planted stances (sides, starts, stops)."""
    side, start, stop = (np.array(values, kind) for values, kind in zip(stances, (int, float, float)))
    still = Lean(np.zeros((len(side), 2)), np.ones(len(side)), np.zeros((len(side), 2)), np.zeros((len(side), 2)))
    return MassCourse(
        centre=np.zeros((COUNT, 3)) if centre is None else centre, speed=np.full(COUNT, speed),
        crouch=np.zeros(COUNT) if crouch is None else crouch,
        foot_height=np.stack([np.broadcast_to(height, COUNT)] * 2, axis=1),
        stances=Stances(side, start, stop), lean=lean or still)


def run(step=10.0, contact=5.0, count=8, first=20.0):
    """Stances of a run, steps and contacts in frames."""
    start = first + step * np.arange(count)
    return np.arange(count) % 2, start, start + contact


@pytest.mark.parametrize("fall, level", [(-9.81, 0.0), (-14.4, 4.0), (-2.0, 1.5)])
def test_the_acceleration_in_flight_is_that_of_its_parabola(fall, level):
    centre = np.stack([3.0 * TIMES + 0.4 * level * TIMES**2, 0.3 * level * TIMES**2, 0.5 * fall * TIMES**2], axis=1)
    flights = measure_flights(build_course(centre, np.where((np.arange(COUNT) // 7) % 2, 0.05, 0.02)))
    assert len(flights) == 21 and np.all(np.isin(flights.middle % 14, [10]))
    assert flights.vertical == pytest.approx(fall) and flights.level == pytest.approx(level, abs=1e-9)
    assert flights.path[1:-1] == pytest.approx(level, abs=0.02)


@pytest.mark.parametrize("frames, height, found", [(5, 0.031, 1), (4, 0.2, 0), (5, 0.029, 0)])
def test_a_flight_has_5_frames_with_both_feet_3_cm_up(frames, height, found):
    up = np.where((np.arange(COUNT) >= 100) & (np.arange(COUNT) < 100 + frames), height, 0.0)
    body = build_course(height=up)
    assert len(measure_flights(body)) == found
    one = replace(body, foot_height=np.stack([up, np.zeros(COUNT)], axis=1))
    assert len(measure_flights(one)) == 0


def test_a_step_has_the_mean_force_that_carries_the_body_over_it():
    steps = measure_steps(build_course(speed=6.0, stances=run(step=9.3, contact=4.8)))
    assert len(steps) == 7 and steps.force == pytest.approx(9.3 / 4.8)
    assert steps.usual == pytest.approx(1.93, abs=0.1)  # .309 s over .160 s


@pytest.mark.parametrize("stances, speed", [
    (run(), 1.9),  # a walk
    (run(step=30.0), 5.0),  # a second a step
    ((np.zeros(8), *run()[1:]), 5.0),  # hops on one foot
    (([0, 1], [0.0, 9.0], [6.0, 15.0]), 5.0),  # cut off by the take's beginning
])
def test_what_is_no_step_of_a_run_has_no_force(stances, speed):
    assert len(measure_steps(build_course(speed=speed, stances=stances))) == 0


@pytest.mark.parametrize("travel", [0.0, 2.0])
@pytest.mark.parametrize("side, fore, pull_side, pull_fore", [(0.2, -0.1, 0.4, -0.3), (-0.3, 0.25, -0.3, 0.25)])
def test_leans_are_sideways_and_forward_of_the_travel(travel, side, fore, pull_side, pull_fore):
    ahead, left = np.array([math.cos(travel), math.sin(travel)]), np.array([-math.sin(travel), math.cos(travel)])

    def spread(vector):
        return np.tile(vector, (8, 1))

    lean = Lean(spread(0.9 * (side * left + fore * ahead)), np.full(8, 0.9),
                9.81 * spread(pull_side * left + pull_fore * ahead), spread(4.0 * ahead))
    found = measure_leans(build_course(stances=run(), lean=lean))
    assert len(found) == 7  # the last stance is followed by no step
    assert found.angle == pytest.approx(np.tile([side, fore], (7, 1)), abs=0.02)
    assert found.wanted == pytest.approx(np.tile([pull_side, pull_fore], (7, 1)), abs=0.03)


@pytest.mark.parametrize("speed", [0.5, 5.0])
def test_pushes_lack_what_they_lean_less_than_their_acceleration_asks_and_crouch(speed):
    push = np.array([2.0, 3.1, 5.0, 8.0, 8.0])[:, None] * [0.6, 0.8]
    lean = Lean(0.9 * np.array([0.0, 0.1, 0.2, 0.9, 0.9])[:, None] * [0.6, 0.8],
                np.array([0.9, 0.9, 0.9, 0.9, 0.3]), push, np.tile([speed, 0.0], (5, 1)))
    crouch = np.where(TIMES > 45.0 / FPS, 0.2, 0.0) + np.where(TIMES == 40.0 / FPS, 0.1, 0.0)
    found = measure_pushes(build_course(speed=speed, stances=run(count=5), lean=lean, crouch=crouch))
    assert found.middle.tolist() == [32, 42, 52]  # neither the soft push nor the body that lies
    asked = np.arctan(np.array([3.1, 5.0, 8.0]) / 9.81)
    assert found.missing == pytest.approx(asked - np.arctan([0.1, 0.2, 0.9])) and found.missing[2] < 0.0
    assert found.crouch == pytest.approx([0.0, 0.1, 0.2])


def measure(motion):
    positions, rotations = forward_kinematics(motion)
    course = measure_course(motion.skeleton, positions, motion.fps)
    boots = build_boots(motion.skeleton, example=motion)
    return measure_body_physics(motion, positions, rotations, course, boots)


def summarize(motion):
    body = measure(motion)
    return summarize_physics([body], [np.ones(len(body.boots), bool)])


def test_a_run_in_a_bend_asks_for_the_lean_of_its_circle():
    found = measure(build_gait(5.0, 6.0, FPS, turn_rate=0.6)).leans
    middle = np.degrees(found.wanted[3:-3])
    assert np.median(middle[:, 0]) == pytest.approx(math.degrees(math.atan(5.0 * 0.6 / 9.81)), abs=1.0)
    assert np.median(middle[:, 1]) == pytest.approx(0.0, abs=1.5)


@pytest.mark.parametrize("step, contact", [(0.372, 0.25), (0.284, 0.143)])
def test_the_bounce_is_that_of_a_mass_on_half_sines(step, contact):
    times = np.linspace(0.0, step, 20001)
    push = np.where(times < contact, 9.81 * step / contact * math.pi / 2 * np.sin(math.pi * times / contact), 0.0)
    rate = np.cumsum(push - 9.81) * times[1]
    height = np.cumsum(rate - rate.mean()) * times[1]
    assert compute_bounce(np.array([step]), np.array([contact]))[0] == pytest.approx(np.ptp(height), rel=1e-3)


def test_knee_and_trunk_angles():
    motion = build_gait(0.0, 2.0, FPS)
    body, positions = identify_joints(motion.skeleton), forward_kinematics(motion)[0].copy()
    left = body.left
    positions[:, left.lower_leg] = positions[:, left.upper_leg] - [0.0, 0.0, 0.4]
    bend = np.radians(130.0)
    positions[:, left.foot] = positions[:, left.lower_leg] - 0.4 * np.array([math.sin(bend), 0.0, math.cos(bend)])
    assert np.degrees(measure_knee_flexion(positions, left)) == pytest.approx(130.0)
    hips = 0.5 * (positions[:, left.upper_leg] + positions[:, body.right.upper_leg])
    for joint, aside in ((left.upper_arm, 0.2), (body.right.upper_arm, -0.2)):
        positions[:, joint] = hips + [-0.5 * math.sin(0.2), aside, 0.5 * math.cos(0.2)]
    assert measure_trunk_lean(positions, body, np.full(len(positions), np.pi)) == pytest.approx(0.2)
    assert measure_trunk_lean(positions, body, np.zeros(len(positions))) == pytest.approx(-0.2)


def test_sprint_strides_are_those_of_6_to_8_m_s():
    form = summarize(build_gait(7.0, 6.0, FPS))["sprint_form"]
    assert 14 <= form["strides"] <= 24 and 120.0 < form["knee_flexion_deg_median"] < 155.0
    assert 0.5 < form["ankle_lift_m_median"] < 0.9 and 0.02 < form["bounce_m_median"] < 0.14
    slow = summarize(build_gait(5.0, 6.0, FPS))["sprint_form"]
    assert slow["strides"] == 0 and math.isnan(slow["knee_flexion_deg_median"])


def test_boots_have_the_soles_of_the_drawn_body():
    motion = build_gait(4.0, 1.0, FPS)
    positions, rotations = forward_kinematics(motion)
    boots, body = build_boots(motion.skeleton, example=motion), build_body(motion.skeleton, example=motion)
    parts = [MATERIALS.index(name) for name in ("boots", "soles")]
    drawn = sorted({corner for face, part in zip(body.faces, body.material) if part in parts for corner in face})
    lowest = measure_lowest_point(boots, motion.skeleton.rest_positions, positions, rotations)
    skin = deform_body(body, motion.skeleton, positions, rotations)[:, drawn]
    np.testing.assert_allclose(lowest, skin[..., 2].min(axis=1), atol=3e-3)


@pytest.mark.parametrize("fps", [25.0, 30.0, 60.0])
def test_boots_below_the_ground_are_counted_at_any_rate(fps):
    motion = build_gait(0.0, 4.0, fps)
    heights = measure_boot_heights(build_boots(motion.skeleton, example=motion), motion, *forward_kinematics(motion))
    assert len(heights) == len(measure_course(motion.skeleton, forward_kinematics(motion)[0], fps).heading)
    assert heights == pytest.approx(0.0, abs=0.015)
    shifts = np.where((np.arange(len(motion)) / fps < 1.0)[:, None], [0.0, 0.0, -0.05], [0.0, 0.0, 0.0])
    sunk = place_motion(motion, offset=shifts)
    assert summarize(sunk)["boots"]["below_share"] == pytest.approx(0.25, abs=0.02)


def test_figures_need_three_events_and_count_used_frames():
    body = measure(build_gait(5.0, 6.0, FPS))
    half = np.arange(len(body.boots)) < len(body.boots) // 2
    whole, part, none = (summarize_physics([body, body], [mask, mask])
                         for mask in (np.ones(len(half), bool), half, np.zeros(len(half), bool)))
    assert 0 < part["step_force"]["4-6"]["steps"] < whole["step_force"]["4-6"]["steps"]
    assert whole["step_force"]["4-6"]["steps"] == 2 * len(body.steps)
    assert part["boots"]["frames"] == 2 * half.sum()
    assert none["flight"]["4-6"]["flights"] == 0 and math.isnan(none["flight"]["4-6"]["vertical_m_s2_median"])
    assert math.isnan(none["boots"]["below_share"]) and math.isnan(none["lean"]["side"]["lean_slope"])
    two = np.zeros(len(half), bool)
    two[body.steps.middle[:2]] = True
    few = summarize_physics([body], [two])["step_force"]["4-6"]
    assert few["steps"] == 2 and math.isnan(few["force_ratio_median"]) and math.isnan(few["force_in_range_share"])


def test_a_report_has_the_group_beside_the_recordings(cut, track_of, library):
    take = cut(("run.bvh", 0, 300))
    report = evaluate(take, track_of(take), library)
    physics = report["physics"]
    steps = physics["step_force"]["4-6"]
    assert steps["steps"] > 10 and abs(steps["source_steps"] - steps["steps"]) <= 2
    assert steps["source_force_ratio_median"] == pytest.approx(steps["force_ratio_median"], rel=0.03)
    assert physics["boots"]["source_frames"] == pytest.approx(physics["boots"]["frames"], abs=1)
    assert physics["boots"]["source_below_share"] == pytest.approx(physics["boots"]["below_share"], abs=0.02)
    unknown = report["unknown"]
    assert unknown["physics.flight.6+.vertical_m_s2_median"] == "fewer than 3 flights of 5 frames at that speed"
    assert unknown["physics.sprint_form.knee_flexion_deg_median"].endswith("between 6 and 8 m/s")
    page = build_physics_section(report)
    assert "Boots more than 2 cm below the ground" in page and f"{steps['steps']} steps" in page
    assert build_physics_section({}) == ""
    empty = [name for name, value in flatten_report(report).items() if name.startswith("physics") and value is None]
    assert empty and all(unknown.get(name, "") != "nothing to measure" for name in empty)


def test_a_taller_body_has_taller_boots(cut, library):
    """A body 1.2 times as large is as deep in the ground as the library's, 1.2 times as far."""
    take = cut(("jog.bvh", 0, 60))
    tall = replace(take.motion, skeleton=take.motion.skeleton.scale(1.2),
                   root_positions=1.2 * take.motion.root_positions)
    here, there = (measure_physics(View(playback_from_tables(motion), None, None, library))["physics"]["boots"]
                   for motion in (place_motion(take.motion, offset=(0.0, 0.0, -0.02)),
                                  place_motion(tall, offset=(0.0, 0.0, -0.02))))
    assert here["frames"] == there["frames"] and there["below_share"] == pytest.approx(here["below_share"], abs=0.1)


@pytest.mark.parametrize("radius, is_named", [(4.0, True), (30.0, False)])
def test_a_note_names_where_the_track_asks_for_more_than_the_ground_gives(radius, is_named):
    motion, times = build_gait(6.0, 4.0, FPS), np.arange(120) / FPS
    angle = 6.0 / radius * times  # 36 / 4 m/s^2 is .9 g
    track = Track(times, radius * np.stack([np.cos(angle), np.sin(angle)], axis=1))
    notes = evaluate_played(playback_from_tables(motion), track=track)["notes"]
    assert any("the track asks for up to 0.9 g" in note for note in notes) == is_named
