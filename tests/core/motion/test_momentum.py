"""A planned centre of mass flies on parabolas, is pushed only by feet on the ground, and stays near what it was."""

import numpy as np
import pytest

from beyond_mocap.motion.momentum import FRICTION, STRENGTH, MomentumPlanner
from beyond_mocap.motion.supports import GRAVITY

STEP, CONTACT, SECONDS = 0.309, 0.16, 4.0  # s of a runner at 6 m/s (Weyand 2000)


def build_run(fps, contact=CONTACT, bounce=0.05):
    """Phases of support (P, 2) frames and a centre of mass (T, 3) m that surges and bounces too much in the air."""
    times, middles = np.arange(int(round(SECONDS * fps)) + 1) / fps, np.arange(0.0, SECONDS + STEP, STEP)
    phases = np.clip(np.stack([middles - 0.5 * contact, middles + 0.5 * contact], axis=1), 0.0, SECONDS) * fps
    turn = 2.0 * np.pi * times / STEP
    ground = [6.0 * times + 0.0135 * np.sin(turn), 0.01 * np.sin(0.5 * turn)]
    centre = np.column_stack([*ground, 1.0 - bounce * np.cos(turn)])
    return phases[phases[:, 1] > phases[:, 0]], centre


def plan(phases, centre, fps, share=1.0, strength=STRENGTH):
    planner = MomentumPlanner(phases, len(centre), fps, np.broadcast_to(share, len(centre)), strength)
    height, force = planner.plan_height(centre[:, 2])
    return np.column_stack([planner.plan_ground(centre[:, :2], force), height]), force


def list_flight_frames(phases, count):
    """Frames whose second difference sees no contact."""
    at = np.arange(1, count - 1)
    return at[np.all([(at <= start - 1.0) | (at >= stop + 1.0) for start, stop in phases], axis=0)]


@pytest.mark.parametrize("fps", [25.0, 30.0, 60.0, 120.0])
@pytest.mark.parametrize("contact", [CONTACT, 0.115])
def test_flights_are_parabolas(fps, contact):
    phases, centre = build_run(fps, contact)
    planned, _ = plan(phases, centre, fps)
    free = list_flight_frames(phases, len(centre))
    second = np.diff(planned, 2, axis=0)[free - 1] * fps**2
    before = np.diff(centre, 2, axis=0)[free - 1] * fps**2
    assert len(free) > 20 and second == pytest.approx(np.tile([0.0, 0.0, -GRAVITY], (len(free), 1)), abs=0.25)
    assert np.abs(before + [0.0, 0.0, GRAVITY]).max() > 3.0


def test_the_curve_moves_little_and_keeps_its_track():
    phases, centre = build_run(30.0)
    move = plan(phases, centre, 30.0)[0] - centre
    blocks = np.stack([move[first : first + 23].mean(axis=0) for first in range(0, len(move) - 23, 5)])
    assert np.abs(move).max() < 0.03 and np.abs(move).max() > 0.005 and np.abs(blocks).max() < 0.01


def test_forces_push_only_and_within_the_legs_strength():
    phases, centre = build_run(30.0, 0.1)
    force, gentle = plan(phases, centre, 30.0)[1], plan(phases, centre, 30.0, strength=3.0)[1]
    assert force.min() > -0.1 and 3.2 * GRAVITY < force.max() < 1.02 * STRENGTH * GRAVITY
    assert gentle.max() < 3.1 * GRAVITY


def test_level_forces_stay_near_the_friction_of_the_ground():
    phases, centre = build_run(30.0)
    times = np.arange(len(centre)) / 30.0
    braking = np.column_stack([9.0 * times - 0.5 * 12.0 * np.maximum(times - 2.0, 0.0) ** 2, centre[:, 1]])
    planner = MomentumPlanner(phases, len(centre), 30.0, np.ones(len(centre)))
    _, force = planner.plan_height(centre[:, 2])
    planned = planner.plan_ground(braking, force)
    push = np.diff(planned, 2, axis=0)[:, 0] * 900.0
    assert push.min() > -1.3 * FRICTION * force.max()  # friction is soft: a track may ask for more
    assert np.abs(planned - braking).max() < 0.13


@pytest.mark.parametrize("fps", [25.0, 60.0, 120.0])
def test_the_frame_rate_does_not_decide_the_curve(fps):
    phases, centre = build_run(30.0)
    slow = plan(phases, centre, 30.0)[0]
    fast = plan(*build_run(fps), fps)[0]
    step = int(np.gcd(30, int(fps)))  # both rates show every 1 / step s
    fast, slow = fast[:: int(fps) // step], slow[:: 30 // step]
    assert fast[step:-step] == pytest.approx(slow[step:-step], abs=0.003)


def test_a_curve_without_a_share_stays_bit_for_bit():
    phases, centre = build_run(30.0)
    share = np.ones(len(centre))
    share[40:80] = 0.0  # whole phases of support lie in it
    planned, _ = plan(phases, centre, 30.0, share)
    assert np.array_equal(planned[40:80], centre[40:80]) and np.abs(planned - centre)[:40].max() > 0.005
    assert np.array_equal(plan(phases, centre, 30.0, 0.0)[0], centre)


def test_what_lies_far_from_flights_hardly_moves():
    phases, centre = build_run(30.0)
    phases = np.concatenate([[[0.0, phases[6, 1]]], phases[7:]])
    move = np.abs(plan(phases, centre, 30.0)[0] - centre).max(axis=1)
    assert move[:20].max() < 0.005 and move[60:].max() > 0.005


def test_a_jump_that_falls_too_slowly_falls_as_gravity_has_it():
    times = np.arange(91) / 30.0
    away = np.maximum(np.abs(times - 1.25) - 0.25, 0.0)
    crouch = 0.25 * GRAVITY * away * np.maximum(1.0 - away / 0.35, 0.0) ** 2
    rise = 0.4 * GRAVITY * np.maximum((times - 1.0) * (1.5 - times), 0.0)  # a fifth too low
    centre = np.column_stack([0.0 * times, 0.0 * times, 1.0 + rise - crouch])
    planned, force = plan(np.array([[0.0, 30.0], [45.0, 90.0]]), centre, 30.0)
    before, after = (np.diff(curve[30:46, 2], 2)[1:-1] * 900.0 + GRAVITY for curve in (centre, planned))
    assert np.abs(after).max() < 0.1 * np.abs(before).min() and np.abs(planned - centre).max() < 0.07
    assert force.max() < 1.02 * STRENGTH * GRAVITY


@pytest.mark.parametrize("count", [1, 2, 3, 4, 7])
@pytest.mark.parametrize("first, last", [(0.0, 1.0), (0.0, 0.3), (0.4, 0.6), (0.5, 0.5 + 1e-9)])
def test_the_shortest_motions_and_contacts_are_planned(count, first, last):
    centre = np.column_stack([0.2 * np.arange(count), np.zeros(count), np.ones(count)])
    planned, force = plan(np.array([[first, last]]) * max(count - 1, 0.1), centre, 30.0)
    assert np.isfinite(planned).all() and np.isfinite(force).all() and np.abs(planned - centre).max() < 0.1


def test_a_body_that_no_foot_carries_falls():
    centre = np.column_stack([np.zeros((10, 2)), np.ones(10)])
    planned, force = plan(np.zeros((0, 2)), centre, 30.0)
    assert len(force) == 0 and np.diff(planned[:, 2], 2) * 900.0 == pytest.approx(-GRAVITY, abs=0.5)


def test_the_same_input_gives_the_same_bits():
    phases, centre = build_run(30.0)
    assert np.array_equal(plan(phases, centre, 30.0)[0], plan(phases, centre, 30.0)[0])


def test_a_planner_plans_another_round_as_a_new_one_does():
    phases, centre = build_run(30.0)
    planner = MomentumPlanner(phases, len(centre), 30.0, np.ones(len(centre)))
    force = planner.plan_height(centre[:, 2])[1]
    for ground, push in ((centre[:, :2], force), (centre[:, :2], 0.1 * force), (0.5 * centre[:, :2], force)):
        new = MomentumPlanner(phases, len(centre), 30.0, np.ones(len(centre)))
        assert np.array_equal(planner.plan_ground(ground, push), new.plan_ground(ground, push))
