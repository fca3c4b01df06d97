"""The recipe for a throw at a target: planned, generated, corrected, flown; and what it refuses."""

import json
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.ball.flight import find_crossing, simulate_flight
from beyond_mocap.base.errors import InputError
from beyond_mocap.cli.main import main
from beyond_mocap.files.bvh import bvh
from beyond_mocap.files.tables import read_ball
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.throws.ball_release import InHand, sample_points
from beyond_mocap.throws.join_throw import build_standing_motion, join_throw
from beyond_mocap.throws.network_npz import write_model
from beyond_mocap.throws.throw import throw_at
from beyond_mocap.throws.throw_request import ThrowRequest, place_in_motion
from tests.core.linear_throws import build_kick_examples, build_linear_model, build_throw_examples


@pytest.fixture(scope="module")
def model():
    return build_linear_model(build_throw_examples())


ORDERS = [
    ThrowRequest((12.0, 3.0, 1.0)),
    ThrowRequest((-9.0, 6.0, 0.1), over=(2.0, 1.0)),
    ThrowRequest((4.0, -12.0, 1.8), limb="left_hand", start=(1.0, 1.0)),
    ThrowRequest((14.0, -2.0, 1.2), speed=20.0, fps=60.0, release_time=7.5, ball="tennis"),
]


@pytest.mark.parametrize("order", ORDERS, ids=["start", "over", "left", "speed"])
def test_hits_what_it_is_aimed_at(model, order):
    thrown = throw_at(model, order)
    target = np.maximum(order.target, [-np.inf, -np.inf, thrown.ball.radius])
    flight = simulate_flight(thrown.launch, thrown.ball, 4.0)
    assert np.linalg.norm(find_crossing(flight, target) - target) < 0.02
    assert thrown.impact_error < 0.02 and thrown.displacement < 0.05 and not thrown.warnings
    assert abs(np.degrees(thrown.rotation)) < 8.0
    if order.speed:
        assert abs(thrown.speed - order.speed) < 1.5
        assert thrown.motion.fps == 60.0 and abs(thrown.release_time - 7.5) < 1e-9


def test_stands_where_it_is_told(model):
    thrown = throw_at(model, ORDERS[0])
    hips = identify_joints(thrown.motion.skeleton).hips
    assert hips == 0 and np.linalg.norm(thrown.motion.root_positions[0, :2]) < 0.05
    thrown = throw_at(model, ORDERS[1])
    at = int(round(thrown.release * thrown.motion.fps))
    assert np.linalg.norm(thrown.motion.root_positions[at, :2] - [2.0, 1.0]) < 0.15


def test_the_ball_is_held_and_then_flies(model):
    thrown = throw_at(model, ORDERS[3])
    part = InHand("right", thrown.grip)
    held = thrown.path.times <= thrown.release_time
    frames = np.flatnonzero(held)
    assert np.allclose(thrown.path.positions[held], sample_points(thrown.motion, part, frames.astype(float))[:, 0])
    # never jumps: the step over the release is no longer than those around it allow
    steps = np.linalg.norm(np.diff(thrown.path.positions, axis=0), axis=1) * thrown.motion.fps
    assert abs(steps[frames[-1]] - thrown.speed) < 0.15 * thrown.speed
    assert np.all(np.diff(thrown.path.times) > 0.0) and thrown.path.times[-1] > thrown.release_time + 0.5


@pytest.fixture(scope="module")
def kicking():
    return build_linear_model(build_kick_examples(), "kick", 30.0)


@pytest.mark.parametrize("order", [
    ThrowRequest((11.0, 2.0, 0.9), ball_place=(1.0, 1.0)), ThrowRequest((-4.0, 10.0, 0.3), limb="left_foot",
                                                                        ball_place=(0.0, 0.0)),
    ThrowRequest((12.0, 0.0, 0.8)),
], ids=["ball", "left", "free"])  # fmt: skip
def test_a_kick_hits_and_the_ball_lies_where_it_is_told(kicking, order):
    thrown = throw_at(kicking, order)
    assert thrown.impact_error < 0.02 and thrown.displacement < 0.06 and thrown.grip is None
    lies = thrown.path.positions[thrown.path.times <= thrown.release_time]
    assert np.ptp(lies, axis=0).max() == 0.0 and np.isclose(lies[0, 2], thrown.ball.radius)
    if order.ball_place is not None:
        assert np.allclose(lies[0, :2], order.ball_place)
    assert np.abs(thrown.launch.spin).max() > 5.0


def test_a_model_of_kicks_does_not_throw(kicking):
    with pytest.raises(InputError, match="trained for kicks"):
        throw_at(kicking, ThrowRequest((12.0, 0.0, 1.0), limb="right_hand"))


def test_the_same_order_gives_the_same_bits_and_a_seed_another_motion(model):
    first, again = (throw_at(model, ORDERS[0]) for _ in range(2))
    assert np.array_equal(first.motion.rotations, again.motion.rotations)
    other = throw_at(model, ThrowRequest((12.0, 3.0, 1.0), seed=3))
    assert other.impact_error < 0.02 and not np.array_equal(first.launch.velocity, other.launch.velocity)


def test_another_body_throws(model):
    thrown = throw_at(model, ORDERS[0], build_adult_skeleton(1.65))
    assert thrown.motion.skeleton.has_same_bones(build_adult_skeleton(1.65))
    assert thrown.impact_error < 0.02 and thrown.displacement < 0.05


def test_within_a_longer_motion_the_ball_flies_as_it_did(model):
    thrown = throw_at(model, ORDERS[0])
    own = build_standing_motion(thrown.motion.skeleton, 8.0, 30.0)
    laid = join_throw(own, 0.0, thrown.motion, thrown.release, at=4.0)
    whole = place_in_motion(thrown, laid.motion, laid.start, laid.release, laid.first)
    assert len(whole.shift) == len(whole.motion) and abs(whole.release_time - 4.0) < 0.02
    left = sample_points(whole.motion, InHand("right", thrown.grip), np.array([whole.release * 30.0]))[0, 0]
    assert np.linalg.norm(left - thrown.launch.position) < 1e-3
    assert np.allclose(whole.launch.velocity, thrown.launch.velocity)
    assert np.linalg.norm(find_crossing(whole.flight, thrown.target) - thrown.target) < 0.02


@pytest.mark.parametrize("order, says", [
    (ThrowRequest((320.0, 0.0, 1.0)), "the human limit for a throw"),
    (ThrowRequest((90.0, 0.0, 1.0)), "fastest example"),
    (ThrowRequest((12.0, 0.0, 1.0), speed=60.0), "at most 45 m/s"),
    (ThrowRequest((12.0, 0.0, 1.0), speed=5.0), "to reach the target"),
    (ThrowRequest((12.0, 0.0, 1.0), limb="right_foot"), "trained for throws"),
    (ThrowRequest((0.5, 0.2, 1.0)), "at least 1.5 m"),
])
def test_refuses_what_cannot_be(model, order, says):
    with pytest.raises(InputError, match=says):
        throw_at(model, order)


@pytest.mark.parametrize("wrong", [
    {"target": (1.0, 2.0)}, {"target": (1.0, np.nan, 0.0)}, {"limb": "tail"}, {"ball": "pebble"}, {"speed": -1.0},
    {"start": (0.0, 0.0), "over": (0.0, 0.0)}, {"limb": "left_hand", "ball_place": (0.0, 0.0)},
    {"seed": -1}, {"start": (1.0,)}, {"over": (np.nan, 0.0)}, {"ball_place": (0.0, np.inf)}, {"fps": -30.0},
])
def test_refuses_orders_that_say_nothing(wrong):
    with pytest.raises(InputError):
        ThrowRequest(**{"target": (12.0, 0.0, 1.0), **wrong})


def test_an_unknown_kind_of_ball_is_refused_with_those_that_exist():
    with pytest.raises(InputError, match="ball: the kind 'soccer'; expected one of .*football.*; choose one of these"):
        ThrowRequest((12.0, 0.0, 1.0), ball="soccer")


def test_a_body_without_hands_is_refused(model):
    from dataclasses import replace

    skeleton = build_adult_skeleton()
    keep = [n for n, name in enumerate(skeleton.names) if "Hand" not in name and "ForeArm" not in name]
    index = {old: new for new, old in enumerate(keep)}
    parents = tuple(-1 if skeleton.parents[n] < 0 else index[skeleton.parents[n]] for n in keep)
    less = replace(skeleton, names=tuple(skeleton.names[n] for n in keep), parents=parents,
                   offsets=skeleton.offsets[keep], end_parents=(), end_offsets=np.zeros((0, 3)))  # fmt: skip
    with pytest.raises(InputError, match="^skeleton: .*without a right hand; expected .*; choose a skeleton with arms"):
        throw_at(model, ORDERS[0], less)


def test_a_body_in_the_wrong_unit_is_refused(model):
    with pytest.raises(InputError, match="a body of 1.8e.03 m; expected 0.1 to 10 m"):
        throw_at(model, ThrowRequest((12.0, 0.0, 1.0)), build_adult_skeleton(1800.0))


def test_a_target_under_the_ground_is_told(model):
    assert any("4.00 m below the ground" in line for line in throw_at(model, ThrowRequest((9.0, 0.0, -4.0))).warnings)


def test_networks_that_answer_no_numbers_are_told(model):
    networks = {name: replace(one, weights=tuple(6e30 * each for each in one.weights))
                for name, one in model.networks.items()}  # fmt: skip
    with pytest.raises(InputError, match="an invalid pose"):
        throw_at(replace(model, networks=networks), ThrowRequest((9.0, 0.0, 1.0)))


@pytest.fixture(scope="module")
def weights(tmp_path_factory, model):
    path = tmp_path_factory.mktemp("weights") / "W.npz"
    write_model(model, path)
    return path


def test_the_command_is_the_function(weights, tmp_path, capsys, model):
    names = {name: tmp_path / name for name in ("out.bvh", "ball.csv", "report.json")}
    found = main(["throw", "synthesize", "--model", str(weights), "--target", "12,3,1", "--out", str(names["out.bvh"]),
                  "--ball", str(names["ball.csv"]), "--report", str(names["report.json"])])  # fmt: skip
    assert found == 0 and "cm from the target" in capsys.readouterr().out
    thrown = throw_at(model, ORDERS[0])
    motion = bvh.read_bvh(names["out.bvh"]).motion
    assert len(motion) == len(thrown.motion)
    assert np.abs(motion.root_positions - thrown.motion.root_positions).max() < 1e-4
    report = json.loads(names["report.json"].read_text())
    assert report["impact_error_m"] < 0.02 and report["limb"] == "right_hand" and report["corrected_frames"]
    assert np.allclose(report["velocity_m_s"], thrown.launch.velocity, atol=1e-6)
    assert np.abs(read_ball(names["ball.csv"]).positions - thrown.path.positions).max() < 1e-4


STICK = """HIERARCHY
ROOT Hips
{ OFFSET 0 0 0 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation End Site { OFFSET 0 10 0 } }
MOTION
Frames: 2
Frame Time: 0.0333
0 90 0 0 0 0
0 90 0 0 0 0
"""


@pytest.mark.parametrize("extra, says", [
    (["--target", "12,3"], "X,Y,Z in metres"), (["--target", "1e9,0,0"], "less than 100 km"),
    (["--target", "320,0,1"], "the human limit"),
    (["--target", "12,3,1", "--model", "none.npz"], "none.npz"),
    (["--target", "12,3,1", "--out", "x.obj"], "x.obj"),
    (["--target", "12,3,1", "--track", "t.csv"], "--track: set without --library"),
    (["--target", "12,3,1", "--library", "l"], "--library: set without --track"),
    (["--target", "12,3,1", "--annotations", "a.txt"], "--annotations: set without --track"),
    (["--target", "12,3,1", "--fps", "5"], "10 to 480"),
    (["--target", "12,3,1", "--skeleton", "STICK"], "stick.bvh: skeleton"),
    (["--target", "12,3,1", "--ball-kind", "pebble"], "pebble"),
    (["--target", "12,3,1", "--seed", "-1"], "--seed"),
    (["--target", "12,3,1", "--unit", "nan"], "--unit"),
    (["--target", "-320,0,1", "--start", "-.5,-1"], "the human limit"),
])
def test_bad_command_lines_are_told_in_one_line(weights, tmp_path, capsys, extra, says):
    (tmp_path / "stick.bvh").write_text(STICK)
    extra = [str(tmp_path / "stick.bvh") if one == "STICK" else one for one in extra]
    found = main(["throw", "synthesize", "--model", str(weights), "--out", str(tmp_path / "o.bvh"), *extra])
    told = capsys.readouterr().err
    assert found == 2 and says in told and told.count("\n") == 1
    assert not (tmp_path / "o.bvh").exists()


def test_weights_have_their_ending(tmp_path, capsys):
    assert main(["throw", "train", str(tmp_path), "--out", str(tmp_path / "w.txt")]) == 2
    assert "ending in .npz" in capsys.readouterr().err
