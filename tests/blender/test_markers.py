"""A cloud of markers plays what the recording has, wherever the scene's clock stands, and gives it back."""

import importlib

import bpy
import numpy as np
import pytest
from conftest import EXTENSION


@pytest.fixture
def cloud():
    return importlib.import_module(f"{EXTENSION}.scene.markers.cloud")


@pytest.fixture
def lines():
    return importlib.import_module(f"{EXTENSION}.scene.markers.lines")


@pytest.fixture
def trial(core):
    """Four markers that wander for half a second at 120 a second; the second one is out of sight for a while."""
    made = core("markers.trial")
    rng = np.random.default_rng(4)
    places = np.cumsum(rng.normal(0.0, 0.01, (61, 4, 3)), axis=0) + rng.normal(0.0, 0.5, (4, 3)) + [0.0, 0.0, 1.0]
    places[20:31, 1] = np.nan
    events = (made.MarkerEvent(0.7, "Foot Strike", "left"),)
    return made.MarkerTrial(("LASI", "RASI", "LKNE", "*7"), places, 120.0, None, events, 0.5, "walk", "Ann")


def seen_at(thing, frame):
    """Places (V, 3) of the evaluated vertices, whether each is seen, spheres and edges that are drawn."""
    whole = int(np.floor(frame))
    bpy.context.scene.frame_set(whole, subframe=frame - whole)
    graph = bpy.context.evaluated_depsgraph_get()
    mesh = thing.evaluated_get(graph).data
    places, seen = np.empty(3 * len(mesh.vertices), np.float32), np.empty(len(mesh.vertices), bool)
    mesh.attributes["position"].data.foreach_get("vector", places)
    mesh.attributes["seen"].data.foreach_get("value", seen)
    spheres = sum(1 for one in graph.object_instances if one.is_instance)
    return places.reshape(-1, 3), seen, spheres, len(mesh.edges)


@pytest.mark.parametrize("rate", [(24, 1.0), (24, 1.001), (120, 1.0), (300, 1.0)])
def test_it_plays_the_recording_at_any_frame_rate(cloud, trial, rate):
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = rate
    fps = rate[0] / rate[1]
    thing = cloud.create(bpy.context, trial, start=11.0)
    for frame in (3.0, 11.0, 11.0 + 0.1 * fps, 11.0 + 0.35 * fps, 11.0 + 0.4321 * fps, 11.0 + 2.0 * fps):
        row = min(max((frame - 11.0) / fps * 120.0, 0.0), 60.0)
        before, share = int(row), row - int(row)
        want = trial.positions[before] * (1 - share) + trial.positions[min(before + 1, 60)] * share
        places, *_ = seen_at(thing, frame)
        both = np.isfinite(want).all(axis=-1)
        assert np.abs(places - want)[both].max() < 2e-4
    assert scene.frame_end >= int(11.0 + 0.5 * fps)


def test_what_is_not_seen_has_neither_sphere_nor_lines(cloud, lines, trial):
    bpy.context.scene.render.fps = 120
    thing = cloud.create(bpy.context, trial, start=0.0)
    for label in thing.beyond_mocap_cloud.labels:
        label.segment = "Hips"
    assert seen_at(thing, 10)[1:][1:] == (4, 6)
    places, seen, spheres, drawn = seen_at(thing, 25)
    assert seen.tolist() == [True, False, True, True] and (spheres, drawn) == (3, 3)
    thing.beyond_mocap_cloud.labels[3].segment = ""
    assert seen_at(thing, 10)[2:] == (4, 3)


@pytest.mark.parametrize("scale", [1.0, 0.01])
def test_it_gives_the_recording_back(cloud, trial, scale):
    bpy.context.scene.unit_settings.scale_length = scale
    thing = cloud.create(bpy.context, trial)
    back = cloud.read(thing, bpy.context.scene)
    assert back.labels == trial.labels and back.fps == trial.fps and back.start == trial.start
    assert [(event.label, event.side) for event in back.events] == [("Foot Strike", "left")]
    assert (back.seen == trial.seen).all() and back.subject == "Ann" and back.name == "walk"
    assert np.nanmax(np.abs(back.positions - trial.positions)) < 1e-6
    thing.beyond_mocap_cloud.labels[3].name = "LANK"
    assert cloud.read(thing, bpy.context.scene).labels[3] == "LANK"


def test_markers_whose_vertices_are_deleted_are_left_out(cloud, trial):
    thing = cloud.create(bpy.context, trial)
    bpy.context.view_layer.objects.active = thing
    thing.select_set(True)
    thing.data.vertices.foreach_set("select", [False, True, False, False])
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.delete(type="VERT")
    bpy.ops.object.mode_set(mode="OBJECT")
    back = cloud.read(thing, bpy.context.scene)
    assert back.labels == ("LASI", "LKNE", "*7")
    places, *_ = seen_at(thing, bpy.context.scene.frame_start)
    assert np.abs(places - trial.positions[0, [0, 2, 3]]).max() < 1e-5


def test_other_trajectories_take_the_place_of_the_first(cloud, trial):
    scene = bpy.context.scene
    thing = cloud.create(bpy.context, trial)
    thing.beyond_mocap_cloud.labels["LKNE"].segment = "LeftLeg"
    fewer = trial.only(("LKNE", "LASI")).with_positions(trial.positions[::-1][:, [2, 0]])
    cloud.write(thing, fewer, scene)
    back = cloud.read(thing, scene)
    assert back.labels == ("LKNE", "LASI") and np.nanmax(np.abs(back.positions - fewer.positions)) < 1e-6
    assert thing.beyond_mocap_cloud.labels["LKNE"].segment == "LeftLeg"
    assert len([one for one in bpy.data.objects if "trajectories" in one.name]) == 1


def test_a_saved_file_plays_and_reads(cloud, trial, tmp_path):
    cloud.create(bpy.context, trial)
    path = str(tmp_path / "kept.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    thing = bpy.data.objects["walk"]
    places, *_ = seen_at(thing, bpy.context.scene.frame_start)
    assert np.abs(places - trial.positions[0]).max() < 1e-5
    assert np.nanmax(np.abs(cloud.read(thing, bpy.context.scene).positions - trial.positions)) < 1e-6
