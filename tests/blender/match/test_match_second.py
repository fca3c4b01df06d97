"""From a line of the page over a match to its second in the scene."""

import importlib

import bpy
import pytest
from conftest import EXTENSION


@pytest.fixture
def shown():
    """Two players of a match that is shown from 60 s on, its first frame being 11, at 25 frames a second."""
    ours = importlib.import_module(f"{EXTENSION}.scene.match.match_objects")
    scene = bpy.context.scene
    scene.render.fps, scene.frame_end = 25, 11 + 250
    match = scene.beyond_mocap_match
    match.shown, match.shown_start, match.shown_first = "//match", 60.0, 11
    for name in ("home_7", "away_9"):
        body = ours.mark_object(bpy.data.objects.new(name, bpy.data.armatures.new(name)))
        body[ours.PLAYER_PROPERTY] = name
        ours.create_collection(scene, name[:4]).objects.link(body)
    bpy.context.view_layer.update()


def test_it_goes_to_the_frame_and_selects_the_player(shown):
    assert bpy.ops.beyond_mocap.match_second(seconds=66.0, player="away_9") == {"FINISHED"}
    assert bpy.context.scene.frame_current == 11 + 150
    assert [one.name for one in bpy.context.selected_objects] == ["away_9"] and bpy.context.object.name == "away_9"
    assert bpy.ops.beyond_mocap.match_second(seconds=60.0) == {"FINISHED"}
    assert bpy.context.scene.frame_current == 11 and bpy.context.object.name == "away_9"


def test_keys_stay_on_their_frames_when_the_scenes_rate_changes(shown):
    bpy.context.scene.beyond_mocap_match.shown_rate = 25.0
    bpy.context.scene.render.fps = 50
    bpy.ops.beyond_mocap.match_second(seconds=66.0)
    assert bpy.context.scene.frame_current == 11 + 150


@pytest.mark.parametrize("asked, words", [
    ({"seconds": 59.0}, "59 s is not shown; expected 60 to 70 s"), ({"seconds": 71.0}, "60 to 70 s"),
    ({"seconds": 66.0, "player": "home_1"}, "home_1 is not shown; expected one of home_7, away_9"),
])
def test_what_is_not_shown_is_told_and_nothing_moves(shown, asked, words):
    bpy.context.scene.frame_set(5)
    with pytest.raises(RuntimeError, match=words):
        bpy.ops.beyond_mocap.match_second(**asked)
    assert bpy.context.scene.frame_current == 5 and not bpy.context.selected_objects


def test_without_a_match_it_says_what_to_press():
    with pytest.raises(RuntimeError, match="Show Match"):
        bpy.ops.beyond_mocap.match_second(seconds=1.0)
