"""Bodies lean into bends, starts and stops by what they lack, and not where nothing pushes them."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.lean import (
    Lean,
    choose_angles,
    choose_crouch,
    choose_shifts,
    compute_footprint_shifts,
    lower_root,
    measure_lean,
    tilt_body,
)
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.motion.retargeting.neutral import build_neutral_stance
from beyond_mocap.motion.supports import GRAVITY, Stances

FPS, HEIGHT, MOST = 60.0, 1.0, 0.20  # frames per second; m of the centre of mass, and that a footprint moves at most
BODY = identify_joints(build_adult_skeleton())
REST = build_neutral_stance(build_adult_skeleton()).positions


def build_stances(seconds, first=0.0, step=0.3, contact=0.2):
    start = first + np.arange(0.0, seconds - contact, step)
    return Stances(np.arange(len(start)) % 2, start * FPS, (start + contact) * FPS)


def join_stances(*parts):
    return Stances(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("side", "start", "stop")))


def place_body(ground, stances, away=0.0):
    """Positions (T, J, 3) and centre (T, 3) m over the ground (T, 2) m; each foot stands below the middle of its
    stance, moved by `away` (S, 2) m."""
    at, centre = np.arange(len(ground)), np.column_stack([ground, np.full(len(ground), HEIGHT)])
    places = REST + np.column_stack([ground, np.zeros(len(ground))])[:, None]
    middle = np.stack([np.interp(stances.middle, at, column) for column in ground.T], axis=1) + away
    for foot, (side, start, stop) in zip(middle, zip(stances.side, stances.start, stances.stop)):
        limb = (BODY.left, BODY.right)[side]
        places[int(start) : int(np.ceil(stop)) + 1, [limb.foot, limb.toe_or_foot]] = [*foot, 0.0]
    return places, centre


def run_circle(speed, radius, seconds=4.0):
    angle = speed / radius * np.arange(int(seconds * FPS)) / FPS
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def run_straight(speed, seconds=4.0):
    times = np.arange(int(seconds * FPS)) / FPS
    return np.stack([speed * times, 0.0 * times], axis=1)


@pytest.mark.parametrize("speed, radius", [(4.0, 40.0), (5.0, 25.0), (6.0, 12.0)])
def test_a_runner_on_a_circle_gets_the_lean_it_lacks(speed, radius):
    ground, stances = run_circle(speed, radius), build_stances(4.0)
    lean = measure_lean(BODY, *place_body(ground, stances), stances, FPS)
    inner, wanted = slice(3, -3), HEIGHT * speed**2 / radius / GRAVITY
    middle = np.stack([np.interp(stances.middle, np.arange(len(ground)), column) for column in ground.T], axis=1)
    towards = -middle / np.linalg.norm(middle, axis=1, keepdims=True)
    assert np.sum(lean.missing * towards, axis=1)[inner] == pytest.approx(wanted, abs=0.01)
    shift = np.sum(choose_shifts(lean, np.ones(len(stances))) * towards, axis=1)[inner]
    assert shift == pytest.approx(MOST * np.tanh((wanted - 0.01) / MOST), abs=0.01) and np.all(shift < MOST)


@pytest.mark.parametrize("aside", [0.0, 0.005])
def test_a_straight_run_and_an_error_within_the_dead_zone_stay(aside):
    stances = build_stances(4.0)
    lean = measure_lean(BODY, *place_body(run_straight(6.0), stances, [0.0, aside]), stances, FPS)
    assert not choose_shifts(lean, np.ones(len(stances))).any()


def test_a_start_leans_ahead_and_a_stop_back():
    times, stances = np.arange(240) / FPS, build_stances(4.0)
    ground = np.column_stack([1.0 * times**2, 0.0 * times])  # 2 m/s^2
    shifts = [choose_shifts(measure_lean(BODY, *place_body(path, stances), stances, FPS), np.ones(len(stances)))
              for path in (ground, ground[::-1] * [-1.0, 1.0])]
    assert np.all(shifts[0][6:11, 0] > 0.08) and np.all(shifts[1][2:7, 0] < -0.08)
    assert np.abs(shifts).max() < MOST and np.abs(shifts)[..., 1].max() < 1e-9


def test_slow_bodies_and_stances_without_a_share_do_not_lean_more():
    ground, stances = run_circle(1.1, 2.0), build_stances(4.0)
    assert not choose_shifts(measure_lean(BODY, *place_body(ground, stances), stances, FPS),
                             np.ones(len(stances)))[2:-2].any()
    fast = measure_lean(BODY, *place_body(run_circle(6.0, 12.0), stances), stances, FPS)
    assert not choose_shifts(fast, np.zeros(len(stances))).any()
    half, whole = (choose_shifts(fast, np.full(len(stances), share)) for share in (0.5, 1.0))
    assert half == pytest.approx(0.5 * whole)


def test_a_turn_back_leans_while_the_body_rests_and_the_body_crouches():
    times, stances = np.arange(240) / FPS - 2.0, build_stances(4.0)
    ground = np.column_stack([2.5 * times**2, 0.0 * times])  # 5 m/s^2, at rest after 2 s
    lean = measure_lean(BODY, *place_body(ground, stances), stances, FPS)
    shifts = choose_shifts(lean, np.ones(len(stances)))
    middle = np.abs(stances.middle / FPS - 2.0).argmin()
    assert np.linalg.norm(lean.velocity[middle]) < 1.0 and shifts[middle, 0] > 0.1
    crouch = choose_crouch(lean, shifts)
    assert np.all(crouch >= 0.0) and crouch[4:-4].min() > 0.005
    assert not choose_crouch(lean, np.zeros_like(shifts)).any()  # who leans as the clip does sinks no further
    assert not choose_crouch(lean, -lean.offset).any()  # nor who comes to stand over the foot
    root = lower_root(np.ones((240, 3)), stances, np.full(len(stances), 0.1), np.ones(240), FPS)
    assert root[:, 2] == pytest.approx(0.9) and np.all(root[:, :2] == 1.0)


def test_a_body_that_hardly_moves_leans_as_it_is_pushed_whichever_way_it_creeps():
    creeps = 0.01 * np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0], [0.0, 0.0]])
    lean = Lean(np.zeros((5, 2)), np.ones(5), np.tile([5.0, 0.0], (5, 1)), creeps)
    shifts = choose_shifts(lean, np.ones(5))
    angles = choose_angles(lean, shifts)
    assert angles == pytest.approx(np.tile(angles[0], (5, 1)), abs=4e-3)
    assert angles[:, 0] == pytest.approx(0.8 * shifts[:, 0], rel=0.01) and shifts.min(axis=0)[0] > 0.1
    braking = replace(lean, velocity=np.tile([-3.0, 0.0], (5, 1)))
    assert choose_angles(braking, shifts)[:, 0] == pytest.approx(0.3 * shifts[:, 0], rel=0.01)


@pytest.mark.parametrize("rest, is_averaged", [(0.3, True), (2.0, False)])
def test_neighbours_are_averaged_within_a_run_only(rest, is_averaged):
    early, late = build_stances(2.0), build_stances(2.0, first=1.7 + 0.1 + rest)
    away = np.repeat([[0.0, 0.0], [0.0, 0.1]], [len(early), len(late)], axis=0)
    stances = join_stances(early, late)
    lean = measure_lean(BODY, *place_body(run_straight(5.0, 6.0), stances, away), stances, FPS)
    aside = lean.offset[len(early) - 1 : len(early) + 1, 1]
    assert aside == pytest.approx([-0.025, -0.075] if is_averaged else [0.0, -0.1], abs=1e-6)


def test_a_body_at_rest_or_without_stances_or_lying_is_no_error():
    stances = build_stances(4.0)
    lean = measure_lean(BODY, *place_body(np.zeros((240, 2)), stances), stances, FPS)
    assert np.isfinite(lean.missing).all() and not choose_shifts(lean, np.ones(len(stances))).any()
    none = Stances(np.zeros(0, int), np.zeros(0), np.zeros(0))
    empty = measure_lean(BODY, *place_body(np.zeros((240, 2)), none), none, FPS)
    assert choose_shifts(empty, np.zeros(0)).shape == (0, 2)
    places, centre = place_body(run_circle(5.0, 10.0), stances)
    lying = measure_lean(BODY, places, centre - [0.0, 0.0, HEIGHT], stances, FPS)
    shifts = choose_shifts(lying, np.ones(len(stances)))
    assert np.linalg.norm(shifts / lying.lever[:, None], axis=1).max() < 2.0 ** 0.5 * MOST / 0.5


def test_footprints_move_while_the_foot_swings_only():
    stances, shifts = build_stances(4.0), np.random.default_rng(0).normal(scale=0.05, size=(13, 2))
    moves = compute_footprint_shifts(stances, shifts, np.ones(240))
    for side, start, stop, shift in zip(stances.side, stances.start, stances.stop, shifts):
        stands = moves[int(np.ceil(start)) : int(stop) + 1, side]
        assert stands == pytest.approx(np.tile(-shift, (len(stands), 1)), abs=1e-9)
    assert np.abs(np.diff(moves, axis=0)).max() < 0.05


def test_no_footprint_moves_where_there_is_no_share():
    stances, share = build_stances(4.0), np.ones(240)
    share[70:131] = 0.0
    touches = (stances.stop > 69) & (stances.start < 131)
    shifts = np.where(touches[:, None], 0.0, [0.1, 0.05])
    moves = compute_footprint_shifts(stances, shifts, share)
    assert not moves[70:131].any() and np.abs(moves).max() == pytest.approx(0.1)


def test_a_body_tilts_by_half_the_angle_aside_by_more_ahead_and_by_less_as_it_brakes():
    stances = build_stances(4.0)
    lean = measure_lean(BODY, *place_body(run_straight(5.0), stances), stances, FPS)
    ahead, aside, back = (choose_angles(lean, np.tile(shift, (len(stances), 1)))[5]
                          for shift in ([0.15, 0.0], [0.0, 0.1], [-0.1, 0.0]))
    assert ahead == pytest.approx([0.12, 0.0], abs=1e-6) and aside == pytest.approx([0.0, 0.05], abs=1e-6)
    assert back == pytest.approx([-0.03, 0.0], abs=1e-6)
    rotations = np.tile(quaternion.identity(1, 3), (240, 1, 1))
    turned = tilt_body(rotations, stances, np.tile(ahead, (len(stances), 1)), np.ones(240), FPS)
    up = quaternion.rotate(turned[:, 0], np.array([0.0, 0.0, 1.0]))
    assert up == pytest.approx(np.tile([np.sin(0.12), 0.0, np.cos(0.12)], (240, 1)), abs=1e-6)
    assert np.array_equal(turned[:, 1:], rotations[:, 1:])


def test_a_body_that_comes_to_stand_straightens():
    run, stands = build_stances(2.0), Stances(np.array([0]), np.array([1.9 * FPS]), np.array([12.0 * FPS]))
    stances = join_stances(run, stands)
    angles = np.where(np.arange(len(stances)) < len(run), 0.1, 0.0)[:, None] * [1.0, 0.0]
    rotations = np.tile(quaternion.identity(1, 3), (720, 1, 1))
    turned = tilt_body(rotations, stances, angles, np.ones(720), FPS)
    angle = 2.0 * np.arccos(np.clip(turned[:, 0, 0], -1.0, 1.0))
    assert angle[60] == pytest.approx(0.1, abs=1e-3) and angle[int(2.3 * FPS) :].max() < 1e-6
