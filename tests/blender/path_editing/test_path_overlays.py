"""What is drawn of riders, and what the panel says of them, from motions ridden by the core."""

import json
import time
from dataclasses import replace
from importlib import import_module

import bpy
import numpy as np
import pytest
from conftest import EXTENSION, SOURCE

SWITCHES = ("path_source", "path_new", "path_trackers", "path_residuals", "path_ghost")


@pytest.fixture(scope="module")
def ridden(core):
    """A walk on a bend: source, ridden motion, path."""
    clip = core("files.bvh.bvh").read_bvh(SOURCE / "sample_blend" / "library" / "walking_1_2.bvh").motion
    settings = core("path_editing.path_edit_settings").PathEditSettings()
    source = core("path_editing.path_edit_source").prepare_source(clip, settings)
    turn = np.linspace(0.0, 2.5, 80)
    line = np.stack([4.0 * np.sin(turn), 4.0 - 4.0 * np.cos(turn), 0.3 * turn], axis=1)
    path = core("path_editing.path_line").fit_line(line, "bend")
    return source, core("path_editing.path_edit").edit_path(source, path, settings), path


@pytest.fixture
def rides():
    return import_module(f"{EXTENSION}.scene.overlays.path_overlays")


@pytest.fixture
def shown(rides, ridden, monkeypatch):
    """One rider in the scene, of whom this was computed; gives a new one where it is computed anew."""
    body = bpy.data.objects.new("Rider", bpy.data.armatures.new("Rider"))
    bpy.context.scene.collection.objects.link(body)
    bpy.context.view_layer.update()
    source, motion, path = ridden
    now = [rides.edited_bodies.ComputedEdit(1, motion.motion.fps, source, path, motion, 1)]
    monkeypatch.setattr(rides, "list_edited_bodies", lambda scene: [body])
    monkeypatch.setattr(rides.edited_bodies, "find_computed_edit", lambda one: now[-1])
    monkeypatch.setattr(rides.edited_bodies, "has_computed_edits", lambda: True)
    return now


def switch(*names):
    view = bpy.context.scene.beyond_mocap.view
    for name in SWITCHES:
        setattr(view, name, name in names)


def points(items):
    """All vertices (N, 3) of items, in the world, in Blender's units."""
    found = []
    for item in items:
        matrix = np.array(item.world)
        found += [mesh.points @ matrix[:3, :3].T + matrix[:3, 3] for mesh in item.meshes()]
    return np.concatenate(found)


def distance(places, way):
    """(N,) to the nearest of way (M, 3)."""
    return np.linalg.norm(places[:, None] - way[None], axis=2).min(axis=1)


def test_each_switch_draws_its_own_and_nothing_is_drawn_without(rides, shown):
    switch()
    assert rides.list_items(bpy.context.scene) == []
    for name in SWITCHES:
        switch(name)
        items = rides.list_items(bpy.context.scene)
        assert items and np.isfinite(points(items)).all(), name
        for mesh in (mesh for item in items for mesh in item.meshes()):
            assert (
                len(mesh.points) == len(mesh.colours) and len(mesh.points) % 2 == 0 and mesh.points.dtype == np.float32
            )
    switch(*SWITCHES)
    bpy.context.scene.beyond_mocap.view.show = False
    assert rides.list_items(bpy.context.scene) == []


def test_lines_lie_on_their_paths_and_residuals_end_at_the_pelvis(rides, shown):
    shown, = shown
    fine = shown.path.at(np.linspace(*shown.path.domain, 2000))
    switch("path_new")
    assert distance(points(rides.list_items(bpy.context.scene)), fine).max() < 0.1
    switch("path_source")
    assert distance(points(rides.list_items(bpy.context.scene)), shown.source.moving.origin).max() < 0.15
    switch("path_residuals")
    bpy.context.scene.frame_set(30)
    row = 30 - 1
    strong = next(item for item in rides.list_items(bpy.context.scene) if item.key == (shown.edited, "residual", row))
    foot, pelvis = strong.meshes()[0].points
    assert np.allclose(pelvis, shown.edited.motion.root_positions[row], atol=1e-5)
    assert np.allclose(foot[:2], shown.edited.origin[row, :2], atol=1e-5)


def test_the_trackers_go_along_and_look_ahead(rides, shown):
    switch("path_trackers")
    shown, = shown
    for frame in (1, 40, 70):
        bpy.context.scene.frame_set(frame)
        row = min(frame - 1, len(shown.edited.arc) - 1)
        new = next(item for item in rides.list_items(bpy.context.scene) if item.key[2] == "new")
        assert np.allclose(new.world.translation, shown.edited.origin[row], atol=1e-5)
        ahead = new.world.to_3x3() @ new.world.translation.__class__((1, 0, 0))
        assert np.allclose(np.arctan2(ahead.y, ahead.x), np.angle(np.exp(1j * shown.edited.heading[row])), atol=1e-5)


def test_the_figure_is_the_original_s_pose_that_is_shown_now(rides, shown, core):
    switch("path_ghost")
    bpy.context.scene.frame_set(50)
    item, = rides.list_items(bpy.context.scene)
    shown, = shown
    was = round(float(shown.edited.frames[50 - 1]))
    places, _ = core("motion.motion").forward_kinematics(shown.source.motion)
    assert distance(points([item]), places[was]).max() < 1e-4


def test_units_are_the_scene_s(rides, shown):
    switch(*SWITCHES)
    metres = points(rides.list_items(bpy.context.scene))
    bpy.context.scene.unit_settings.scale_length = 0.01
    assert np.allclose(points(rides.list_items(bpy.context.scene)), 100.0 * metres, rtol=1e-4, atol=1e-2)


def test_only_what_was_laid_anew_is_made_anew(rides, shown, core):
    switch(*SWITCHES)
    before = {item.key for item in rides.list_items(bpy.context.scene)}
    assert {item.key for item in rides.list_items(bpy.context.scene)} == before
    settings = core("path_editing.path_edit_settings").PathEditSettings()
    old, = shown
    edited = core("path_editing.path_edit").edit_path(old.source, old.path, settings)
    shown.append(replace(old, edited=edited, number=2))
    changed = before - {item.key for item in rides.list_items(bpy.context.scene)}
    assert changed and all(key[0] is not old.source and key[0] != "" for key in changed)


def test_hidden_riders_and_those_not_computed_yet_are_not_drawn(rides, shown, monkeypatch):
    switch(*SWITCHES)
    bpy.data.objects["Rider"].hide_set(True)
    assert rides.list_items(bpy.context.scene) == []
    bpy.data.objects["Rider"].hide_set(False)
    monkeypatch.setattr(rides.edited_bodies, "find_computed_edit", lambda one: None)
    assert rides.list_items(bpy.context.scene) == []


def test_figures_become_lines_with_what_is_aimed_for():
    lines = import_module(f"{EXTENSION}.panels.path_editing").describe_figures
    told = lines(json.dumps({
        "root_error_m": {"mean": 0.007}, "root_error_own_m": {"mean": 0.0081}, "kept_speed": {"path": {"p95": 0.02}},
        "skate": {"contact_cm_s": 1.5, "source_contact_cm_s": 2.25, "before_contact_cm_s": 9.0}, "ik_miss_share": None,
        "seam_jerk": {"seams": 0, "max": None}, "foot_correction_m": {"p95": float("nan")},
    })).splitlines()
    assert told == [
        "Distance to path: 0.70 cm\t≤ 0.81\tmet", "Speed error: 2.00 %\t≤ 1.00\tmissed",
        "Foot slide: 1.5 cm/s\t≤ 2.2\tmet",
        "Slide unplanted: 9.0 cm/s\t\t",
    ]
    close = lines(json.dumps({"root_error_m": {"mean": 0.002}, "root_error_own_m": {"mean": 0.0016}}))
    assert close == "Distance to path: 0.20 cm\t≤ 0.50\tmet"
    assert lines("") == lines("{") == lines("[]") == ""


def test_a_rider_at_rest_is_measured_once_and_again_when_it_was_laid_anew(monkeypatch):
    """The timer's looks, one by one; there is no window here that would call them."""
    measure = import_module(f"{EXTENSION}.scene.path_editing.live")
    monkeypatch.setattr(measure, "REST", 0.0)
    bpy.ops.beyond_mocap.import_clips(filepath=str(SOURCE / "sample_blend" / "library" / "walking_1_2.bvh"))
    body = bpy.context.object
    ride = body.beyond_mocap_ride
    bpy.ops.beyond_mocap.edit_path()
    assert measure.KNOWN not in ride.figures
    look(measure, ride)
    first = json.loads(ride.figures)
    assert first["metres"] > 5.0 and first["root_error_m"]["mean"] < 0.02 and "skate" in first
    before = ride.figures
    for _ in range(3):
        measure._run_timer()
    assert ride.figures == before and not measure._running
    bpy.context.object.location.y += 1.0
    bpy.context.object.scale = (0.5, 0.5, 1.0)
    bpy.context.view_layer.update()
    import_module(f"{EXTENSION}.scene.path_editing.edited_bodies").update_motion(bpy.context.scene, body)
    assert measure.KNOWN not in ride.figures
    look(measure, ride)
    assert json.loads(ride.figures)["length_m"] < 0.6 * first["length_m"]


def look(measure, ride):
    """Tick until the figures are there."""
    for _ in range(400):
        measure._run_timer()
        if measure.KNOWN in ride.figures:
            return
        time.sleep(0.02)
    raise AssertionError("no figures")


def test_update_path_measures_at_once():
    bpy.ops.beyond_mocap.import_clips(filepath=str(SOURCE / "sample_blend" / "library" / "walking_1_2.bvh"))
    body = bpy.context.object
    bpy.ops.beyond_mocap.edit_path()
    bpy.ops.beyond_mocap.update_path()
    told = import_module(f"{EXTENSION}.panels.path_editing").describe_figures(body.beyond_mocap_ride.figures)
    assert "Foot slide" in told
