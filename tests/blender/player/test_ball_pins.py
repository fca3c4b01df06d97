"""Pins of the ball: made at the nearest key moment, dragged in the view, and followed by the ball and the body."""

import importlib

import bpy
import numpy as np
import pytest
import worlds
from undo import assert_one_step


@pytest.fixture
def scene():
    return bpy.context.scene


@pytest.fixture
def places(tmp_path):
    return worlds.make_places(tmp_path)


@pytest.fixture
def session(extension):
    module = importlib.import_module(f"{extension.__name__}.scene.core.session")
    yield module
    module.clear_session()


@pytest.fixture
def freshness(extension):
    return importlib.import_module(f"{extension.__name__}.scene.result.freshness")


def test_the_ball_is_dragged_and_the_take_follows(scene, places, session, freshness):
    scene.render.fps = 30  # as takes have, so that the ball is seen where it is touched
    worlds.import_tracking(places)
    worlds.synthesize_players(places)
    settings = scene.beyond_mocap
    settings.active_player = 0
    player, ball = settings.players[0], scene.objects["Ball"]
    take = session.find_take(player.take).take
    scene.frame_set(10)
    assert_one_step(bpy.ops.beyond_mocap.add_pin, part="ball", at="BODY")
    scene = bpy.context.scene
    player, ball = scene.beyond_mocap.players[0], scene.objects["Ball"]
    pin, = player.pins
    assert pin.time == pytest.approx(2.4) and scene.frame_current != 10  # on the frame of the touch
    assert (pin.target.matrix_world.translation - ball.matrix_world.translation).length < 1e-4
    with pytest.raises(RuntimeError, match="one position at a time"):
        bpy.ops.beyond_mocap.add_pin(part="ball", at="BODY")
    pin.target.location.y += 0.12
    bpy.context.view_layer.update()
    assert freshness.compute_edited_parts(scene, player)
    assert bpy.ops.beyond_mocap.update() == {"FINISHED"}
    made = session.find_take(player.take).take
    frame = round(made.keys[0].frame)
    assert made.pins[0].miss < 1e-3 and round(take.keys[0].frame) == frame
    np.testing.assert_allclose(made.ball.positions[frame] - take.ball.positions[frame], [0.0, 0.12, 0.0], atol=1e-3)
    assert (pin.target.matrix_world.translation - ball.matrix_world.translation).length < 1e-3
    assert not any("does not reach" in line for line in made.warnings)


def test_before_the_first_take_the_pin_is_where_the_tracking_has_the_ball(scene, places):
    worlds.import_tracking(places)
    scene.beyond_mocap.active_player = 0
    assert bpy.ops.beyond_mocap.add_pin(part="ball", hold=0.5) == {"FINISHED"}
    pin, = scene.beyond_mocap.players[0].pins
    np.testing.assert_allclose(pin.target.location, [2.0 * 2.4 + 0.6, 0.3 * np.sin(2.4), 0.11], atol=0.01)
    assert pin.hold == 0.0


def test_what_lacks_is_said_in_one_line(scene, places):
    worlds.import_tracking(places)
    scene.beyond_mocap.active_player = 1
    with pytest.raises(RuntimeError, match="player2: no key moment with the ball; expected one,") as told:
        bpy.ops.beyond_mocap.add_pin(part="ball")
    assert str(told.value).strip().count("\n") == 0
    bpy.ops.beyond_mocap.draw_track()
    with pytest.raises(RuntimeError, match="tracking without a ball"):
        bpy.ops.beyond_mocap.add_pin(part="ball", at="CURSOR")
    assert not any(len(player.pins) for player in scene.beyond_mocap.players)


def test_a_part_that_becomes_the_ball_does_not_hold(extension, scene, places):
    plans = importlib.import_module(f"{extension.__name__}.scene.result.plans")
    worlds.import_tracking(places)
    player = scene.beyond_mocap.players[0]
    scene.beyond_mocap.active_player = 0
    bpy.ops.beyond_mocap.add_pin(part="gaze", at="CURSOR", hold=1.0)
    player.pins[0].part = "ball"
    found, = plans.build_plan(scene.beyond_mocap, player)[0].pins
    assert (found.part, found.hold) == ("ball", 0.0)
