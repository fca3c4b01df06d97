"""Whether the shown takes have one ball: reported where they have not, and each pair of takes is compared once."""

import importlib

import bpy
import worlds
from conftest import EXTENSION


def test_different_balls_are_reported_and_each_pair_is_compared_once(tmp_path, library_folder):
    ball_tracks = importlib.import_module(f"{EXTENSION}.scene.result.ball_tracks")
    places = worlds.make_places(tmp_path)
    worlds.import_tracking(places)
    bpy.context.scene.beyond_mocap.library_folder = str(library_folder)
    bpy.ops.beyond_mocap.synthesize()
    found = str(ball_tracks.describe_difference(bpy.context.scene))
    assert "ball of player2: up to 3 m from the ball of player1" in found
    before = ball_tracks._measure_distance.cache_info().misses
    assert str(ball_tracks.describe_difference(bpy.context.scene)) == found
    assert ball_tracks._measure_distance.cache_info().misses == before
    bpy.ops.beyond_mocap.synthesize(player="player2")  # another take
    assert str(ball_tracks.describe_difference(bpy.context.scene)) == found
    assert ball_tracks._measure_distance.cache_info().misses == before + 1
