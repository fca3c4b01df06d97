"""The chain of strikes and flights: balls leave bodies at the surface that strikes and come to the next one in time."""

import json
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.annotation.striking import measure_ball_gap
from beyond_mocap.ball.contact import find_striking_surface
from beyond_mocap.ball.flight import Launch, simulate_flight
from beyond_mocap.base.errors import InputError, NotInLibraryError, UserCancelledError
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import compute_heading_from_positions
from beyond_mocap.motion.motion import compute_pose, sample_frames
from beyond_mocap.passes import pass_choice
from beyond_mocap.passes.pass_problem import ON_TARGET
from beyond_mocap.passes.passes import build_ball, build_ball_path, plan_scene
from beyond_mocap.passes.scene_json import SAMPLES, parse_scene


def scene_of(name="three", **changes):
    """A sample's scene with some of its object replaced."""
    return parse_scene({**json.loads(json.dumps(SAMPLES[name])), **changes})


def two(far=5.0, **one):
    """Ann and Ben `far` metres apart, one pass each way."""
    players = [{"name": "Ann", "place": [0, 0]}, {"name": "Ben", "place": [far, 0]}]
    return parse_scene({"players": players, "passes": [{"from": "Ann", "to": "Ben", **one}]})


@pytest.fixture(scope="module")
def plans(strikes_library):
    """plans(name) -> (scene, plan) of a sample, each worked out once."""
    kept = {}

    def plan(name):
        if name not in kept:
            kept[name] = (scene_of(name), plan_scene(strikes_library, scene_of(name)))
        return kept[name]

    return plan


NAMES = pytest.mark.parametrize("name", sorted(SAMPLES))


@NAMES
def test_times_are_a_chain_of_travels_on_whole_frames(plans, name):
    scene, plan = plans(name)
    times = np.array([one.order.time for one in plan.strikes])
    assert np.allclose(np.diff(times), [one.travel for one in plan.strikes[:-1]])
    assert np.allclose(times * plan.fps, np.round(times * plan.fps))
    assert times[0] >= scene.lead_in and plan.seconds >= times[-1] + scene.lead_out - 1e-9
    assert [one.player for one in plan.strikes] == [scene.order[0].giver, *(one.receiver for one in scene.order)]
    assert plan.warnings == ()


@NAMES
def test_every_ball_comes_to_the_next_strike_with_its_bounces(plans, name):
    scene, plan = plans(name)
    for before, after in zip(plan.strikes, plan.strikes[1:]):
        flight = simulate_flight(Launch(0.0, before.order.ball, before.velocity_out, before.spin), build_ball(scene),
                                 before.travel)
        assert np.linalg.norm(flight.at([before.travel])[0] - after.order.ball) <= ON_TARGET
        assert np.sum(flight.bounces < before.travel - 2e-3) == before.bounces
        assert np.allclose(flight.velocity([before.travel - 2e-3])[0], after.velocity_in, atol=0.1)


@NAMES
def test_the_ball_is_on_the_surface_that_strikes(plans, strikes_library, name):
    scene, plan = plans(name)
    for one in plan.strikes:
        order, motion = one.order, strikes_library.clips[one.order.clip].motion
        surface = find_striking_surface(motion.skeleton, order.part, order.side, order.tool)
        places, world = laid(motion, order)
        gap = measure_ball_gap(surface.compute_line(places, world), surface.radius, np.array(order.ball),
                               build_ball(scene).radius)
        low = order.ball[2] <= build_ball(scene).radius + 1e-9  # there it lies on the ground
        assert abs(gap) < (0.1 if low else 1e-6)
        assert order.hit.first <= order.strike_frame <= order.hit.last


def laid(motion, order):
    """Joints' places (J, 3) m and rotations (J, 4) of a clip's pose as an order lays it on the pitch."""
    root, local = sample_frames(motion, np.array([order.strike_frame]))
    places, _ = compute_pose(motion.skeleton, root, local)
    turn = quaternion.from_up_angle(order.facing - compute_heading_from_positions(motion.skeleton, places))
    local[:, 0] = quaternion.multiply(turn, local[:, 0])
    places, world = compute_pose(motion.skeleton, np.array([[*order.place, root[0, 2]]]), local)
    return places[0], world[0]


@NAMES
def test_the_ball_is_pushed_away_from_the_part(plans, name):
    _, plan = plans(name)
    for one in plan.strikes[:-1]:
        push = one.velocity_out - one.velocity_in
        assert push @ np.array(one.order.normal) > 0.6 * np.linalg.norm(push)


@NAMES
def test_the_path_has_no_jumps_and_never_goes_under_ground(plans, name):
    scene, plan = plans(name)
    path = build_ball_path(plan)
    step = np.linalg.norm(np.diff(path.positions, axis=0), axis=1)
    fastest = max(np.linalg.norm([one.velocity_in, one.velocity_out], axis=1).max() for one in plan.strikes)
    assert step.max() * plan.fps < 1.2 * fastest + 1.0
    assert path.positions[:, 2].min() >= build_ball(scene).radius - 1e-6
    assert np.allclose(np.linalg.norm(path.rotations, axis=1), 1.0)
    for one in plan.strikes:
        frame = int(round(one.order.time * plan.fps))
        assert np.allclose(path.positions[frame], one.order.ball, atol=ON_TARGET)


def test_balls_go_over_the_net(plans):
    scene, plan = plans("volley_net")
    path, crossed = build_ball_path(plan).positions, 0
    for a, b in zip(path, path[1:]):
        if (a[0] > 0) != (b[0] > 0):
            share = a[0] / (a[0] - b[0])
            assert a[2] + share * (b[2] - a[2]) > scene.net.height + build_ball(scene).radius - 0.02
            crossed += 1
    assert crossed >= 5


def test_kinds_are_told_apart(plans):
    _, plan = plans("six")
    speed = {}
    for one in plan.strikes[:-1]:
        speed.setdefault(one.order.kind, []).append(np.linalg.norm(one.velocity_out[:2]))
    assert np.mean(speed["attack"]) > np.mean(speed["pass"]) > np.mean(speed["toss"])


def test_the_same_scene_is_the_same_bits(strikes_library):
    first, again = (plan_scene(strikes_library, scene_of("dropped")) for _ in range(2))
    assert build_ball_path(first).positions.tobytes() == build_ball_path(again).positions.tobytes()
    assert [one.order.clip for one in first.strikes] == [one.order.clip for one in again.strikes]


def test_strikes_vary_and_never_at_the_price_of_a_much_worse_fit(strikes_library, monkeypatch):
    """Distinct strikes of the first eight, and the mean cost of all, over two scenes."""
    def measure():
        found = [plan_scene(strikes_library, scene_of(name)).strikes for name in ("three", "six")]
        distinct = [len({(one.order.clip, one.order.hit.first) for one in strikes[:8]}) for strikes in found]
        return np.mean(distinct), np.mean([one.cost for strikes in found for one in strikes[:-1]])

    distinct, cost = measure()
    monkeypatch.setattr(pass_choice, "MOST_REUSE_COST", 0.0)
    distinct_before, cost_before = measure()
    assert distinct >= 5.5 and distinct > distinct_before + 1.0
    assert cost <= 1.1 * cost_before


def test_eighths_of_a_turn(strikes_library):
    scene = scene_of("dropped", directions=8)
    for one in plan_scene(strikes_library, scene).strikes:
        eighths = (one.order.facing - scene.find_facing(one.player)) / (0.25 * np.pi)
        assert abs(eighths - round(eighths)) < 1e-9


def test_an_example_is_imitated(strikes_library):
    """The strike most like a stretch of the attack is the attack itself, whatever the kind says."""
    one = {"kind": "toss", "example": {"clip": "volley_attack.bvh", "from": 0.5}}
    played = plan_scene(strikes_library, two(**one)).strikes[0]
    assert strikes_library.clips[played.order.clip].path.startswith("volley_attack")
    plain = plan_scene(strikes_library, two(kind="toss")).strikes[0]
    assert strikes_library.clips[plain.order.clip].path.startswith("volley_toss")


def test_an_example_that_is_not_there(strikes_library):
    late = {"clip": "volley_attack.bvh", "from": 90}
    fouls = (({"clip": "none.bvh"}, "no recording"), (late, "a time up to"), ({"clip": "ready_1.bvh"}, "no strike"))
    for example, word in fouls:
        with pytest.raises(InputError, match=word):
            plan_scene(strikes_library, two(example=example))


def test_asked_seconds_are_kept(strikes_library):
    plan = plan_scene(strikes_library, two(seconds=1.5, bounces=0))
    assert plan.strikes[0].travel == pytest.approx(1.5)


@pytest.mark.parametrize("side", ["left", "right"])
def test_sides(strikes_library, side):
    assert {one.order.side for one in plan_scene(strikes_library, two(side=side)).strikes[:1]} == {side}


def test_a_joint_strikes(strikes_library):
    plan = plan_scene(strikes_library, two(part="RightLeg", bounces=0))
    assert plan.strikes[0].order.part == "RightLeg"


@pytest.mark.parametrize("far, one, word", [
    (95.0, {"part": "head", "bounces": 0}, "up to 23 m/s by head"),
    (40.0, {"seconds": 0.5, "bounces": 0}, "up to 38 m/s by foot"),
    (5.0, {"part": "Tail"}, "which the skeleton lacks"),
    (5.0, {"bounces": 5, "seconds": 0.2}, "with 5 bounces"),
])
def test_what_cannot_be_is_told(strikes_library, far, one, word):
    with pytest.raises(InputError, match=word) as caught:
        plan_scene(strikes_library, two(far, **one))
    assert "\n" not in str(caught.value) and "pass 1" in str(caught.value)


def test_what_the_library_lacks(strikes_library, clips_folder, library):
    with pytest.raises(NotInLibraryError) as caught:
        plan_scene(library, two(part="chest"))
    assert "chest" in str(caught.value)


@pytest.mark.parametrize("ball, word", [("cannon", "the kind"), ({"weight": 3}, "check the spelling"),
                                        ({"radius": -1}, "radius"), ({"restitution": 3}, "restitution"),
                                        ({"lift": [5, 0, 0]}, "lift"), ({"lift": 0.1}, "lift"),
                                        ({"drag": [0.1, 0.1, 0.1]}, "drag")])
def test_balls_that_are_none(strikes_library, ball, word):
    with pytest.raises(InputError, match=word):
        plan_scene(strikes_library, replace(two(), ball=parse_scene({**SAMPLES["three"], "ball": ball}).ball))


def test_a_net_that_nobody_gets_over(strikes_library):
    scene = scene_of("volley_net", net={"from": [0, -5], "to": [0, 5], "height": 10.0})
    with pytest.raises(InputError, match="net of 10 m"):
        plan_scene(strikes_library, scene)


def test_a_missed_ball_goes_past_and_on(strikes_library):
    plan = plan_scene(strikes_library, two(error="missed"))
    last = plan.strikes[-1]
    assert last.outcome == "missed" and not last.order.touches
    path = build_ball_path(plan)
    frame = int(round(last.order.time * plan.fps))
    assert 0.3 < np.linalg.norm(path.positions[frame] - last.order.ball) < 0.6
    assert path.positions[-1, 0] > 5.5, "it is behind who missed it"


def test_chance_ends_the_rally(strikes_library):
    scene = scene_of("three", errors={"dropped": 0.5}, seed=5)
    plan = plan_scene(strikes_library, scene)
    assert plan.strikes[-1].outcome == "dropped" and 1 < len(plan.strikes) <= 10
    assert len(plan_scene(strikes_library, replace(scene, dropped=0.0, missed=1.0)).strikes) == 2


def test_a_served_ball_is_in_the_air_from_the_beginning(plans):
    _, plan = plans("three")
    path = build_ball_path(plan)
    first = int(round(plan.strikes[0].order.time * plan.fps))
    assert np.linalg.norm(np.diff(path.positions[: first + 1], axis=0), axis=1).min() > 0.01, "it never hangs"


def test_a_ball_that_lies_on_the_ground(strikes_library):
    plan = plan_scene(strikes_library, scene_of("dropped", serve="ground"))
    path = build_ball_path(plan)
    first = int(round(plan.strikes[0].order.time * plan.fps))
    assert np.ptp(path.positions[: first + 1], axis=0).max() < 1e-9
    assert path.positions[0, 2] == pytest.approx(0.11)
    with pytest.raises(InputError, match="lies on the ground"):
        players = [{**one, "part": "head"} for one in SAMPLES["dropped"]["players"]]
        plan_scene(strikes_library, scene_of("dropped", serve="ground", players=players))


def test_who_has_too_little_time_is_told(strikes_library):
    scene = scene_of("dropped", defaults={"seconds": 0.35, "bounces": 0})
    assert any("needs" in line for line in plan_scene(strikes_library, scene).warnings)


def test_a_ball_through_somebody_is_told(strikes_library):
    players = [{"name": "Ann", "place": [0, 0]}, {"name": "Ben", "place": [6, 0]},
               {"name": "Cho", "place": [3, 0.26]}, {"name": "Dia", "place": [3, -0.26]}]
    passes = [{"from": "Ann", "to": "Ben", "seconds": 0.6, "bounces": 0}]
    plan = plan_scene(strikes_library, parse_scene({"players": players, "passes": passes}))
    assert any("through" in line for line in plan.warnings)
    free = parse_scene({"players": players, "passes": [{"from": "Ann", "to": "Ben", "bounces": 0}]})
    assert plan_scene(strikes_library, free).warnings == (), "with time of its own it goes over him"


def test_it_can_be_stopped(strikes_library):
    with pytest.raises(UserCancelledError):
        plan_scene(strikes_library, scene_of(), cancelled=lambda: True)
