"""Hit analysis in Blender: as the core's function says, with markers and a picture."""

import importlib
import json
import pathlib

import bpy
import numpy as np
import pytest
from conftest import EXTENSION
from undo import assert_one_step, press_operator

CLIP = pathlib.Path(__file__).resolve().parents[3] / "sample_blend" / "library" / "kick_low_top.bvh"


@pytest.fixture
def room():
    return lambda name: importlib.import_module(f"{EXTENSION}.scene.{name}")


@pytest.fixture
def body():
    """The sample's kick, at a film's rate, beginning on frame 11."""
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base, scene.frame_start = 24, 1.001, 11
    bpy.ops.beyond_mocap.import_clips(filepath=str(CLIP))
    return bpy.context.object


def markers(body):
    return sorted((marker.frame, marker.name) for marker in body.animation_data.action.pose_markers)


def test_it_says_what_the_function_says(body, room, core):
    assert press_operator(bpy.ops.beyond_mocap.hit_analysis) == {"FINISHED"}
    found = core("passes.hits").detect_hits(room("core.action").read_motion(body, bpy.context.scene), "foot", "right")
    assert len(found.motions) == 1
    kept = json.loads(body.beyond_mocap_hits.found)
    assert kept["keys"] == [found.motions[0].key] and kept["first"] == 11 and kept["count"] == len(found.height)
    assert kept["stretches"] == [list(found.ball_stretches[0])]
    frame, text = room("passes.settings").parse_lines(body.beyond_mocap_hits.lines)[0]
    assert frame == 11 + found.motions[0].key and f"{found.motions[0].max_speed:.1f} m/s" in text
    low, high = found.motions[0].ball_stretch
    assert markers(body) == sorted([(11 + low, "hit from"), (11 + high, "hit to"), (frame, "hit right foot")])


def test_again_replaces_its_own_markers_and_no_others(body):
    body.animation_data.action.pose_markers.new("mine").frame = 20
    body.animation_data.action.pose_markers.new("hit the wall").frame = 21
    for _ in range(2):
        press_operator(bpy.ops.beyond_mocap.hit_analysis)
    assert len(markers(body)) == 5
    press_operator(bpy.ops.beyond_mocap.clear_hits)
    assert markers(body) == [(20, "mine"), (21, "hit the wall")] and not body.beyond_mocap_hits.found


def test_each_is_one_step_of_undo(body):
    assert_one_step(bpy.ops.beyond_mocap.hit_analysis)
    line = bpy.context.object.beyond_mocap_hits.lines
    assert_one_step(bpy.ops.beyond_mocap.go_to_strike, frame=int(line.partition("\t")[0]))
    assert_one_step(bpy.ops.beyond_mocap.clear_hits)


@pytest.mark.parametrize("arguments, said", [({"bone": "Tail"}, "Tail"), ({"part": "tool", "bone": "Nose"}, "Nose")])
def test_a_bone_that_is_not_there_is_told(body, arguments, said):
    with pytest.raises(RuntimeError, match=said):
        press_operator(bpy.ops.beyond_mocap.hit_analysis, **arguments)
    assert not body.beyond_mocap_hits.found and not markers(body)


def test_the_picture_shows_curves_and_stretches(body, room):
    press_operator(bpy.ops.beyond_mocap.hit_analysis)
    graph, found = room("passes.hit_analysis"), json.loads(body.beyond_mocap_hits.found)
    pixels = graph.build_picture(found)
    assert pixels.shape == (graph.SIZE, graph.SIZE, 4) and np.isfinite(pixels).all()
    rows = np.flatnonzero(np.all(np.abs(pixels[30, :, :3] - graph._STRETCH) < 1e-3, axis=1))
    assert len(rows)
    low, high = found["stretches"][0]
    share = (rows.mean() - graph._EDGE) / (graph.SIZE - 1 - 2 * graph._EDGE)
    assert abs(share * (found["count"] - 1) - 0.5 * (low + high)) < 2.0
    fast = pixels[60 : graph.SIZE // 2, :, :3]
    assert np.abs(fast - graph._SPEED).max(axis=2).min() < 0.02, "no curve of speed"
