"""A cloud of markers plays what the recording has, wherever the scene's clock stands, and gives it back."""

import importlib

import bpy
import numpy as np
import pytest
import worlds
from conftest import EXTENSION
from undo import assert_one_step


@pytest.fixture
def cloud():
    return importlib.import_module(f"{EXTENSION}.scene.markers.cloud")


@pytest.fixture
def lines():
    return importlib.import_module(f"{EXTENSION}.scene.markers.nodes")


@pytest.fixture
def trial(core):
    """Four markers that wander for half a second at 120 a second; the second one is out of sight for a while."""
    made = core("markers.trial")
    rng = np.random.default_rng(4)
    places = np.cumsum(rng.normal(0.0, 0.01, (61, 4, 3)), axis=0) + rng.normal(0.0, 0.5, (4, 3)) + [0.0, 0.0, 1.0]
    places[20:31, 1] = np.nan
    events = (made.MarkerEvent(0.7, "Foot Strike", "left"),)
    return made.MarkerTrial(
        labels=("LASI", "RASI", "LKNE", "*7"), positions=places, fps=120.0, residuals=None, events=events, start=0.5,
        name="walk", subject="Ann",
    )


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
    thing = cloud.create_cloud(bpy.context, trial, start=11.0)
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
    thing = cloud.create_cloud(bpy.context, trial, start=0.0)
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
    thing = cloud.create_cloud(bpy.context, trial)
    back = cloud.read_trial(thing, bpy.context.scene)
    assert back.labels == trial.labels and back.fps == trial.fps and back.start == trial.start
    assert [(event.label, event.side) for event in back.events] == [("Foot Strike", "left")]
    assert (back.visibility == trial.visibility).all() and back.subject == "Ann" and back.name == "walk"
    assert np.nanmax(np.abs(back.positions - trial.positions)) < 1e-6
    thing.beyond_mocap_cloud.labels[3].name = "LANK"
    assert cloud.read_trial(thing, bpy.context.scene).labels[3] == "LANK"


def test_markers_whose_vertices_are_deleted_are_left_out(cloud, trial):
    thing = cloud.create_cloud(bpy.context, trial)
    bpy.context.view_layer.objects.active = thing
    thing.select_set(True)
    thing.data.vertices.foreach_set("select", [False, True, False, False])
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.delete(type="VERT")
    bpy.ops.object.mode_set(mode="OBJECT")
    back = cloud.read_trial(thing, bpy.context.scene)
    assert back.labels == ("LASI", "LKNE", "*7")
    places, *_ = seen_at(thing, bpy.context.scene.frame_start)
    assert np.abs(places - trial.positions[0, [0, 2, 3]]).max() < 1e-5


def test_other_trajectories_take_the_place_of_the_first(cloud, trial):
    scene = bpy.context.scene
    thing = cloud.create_cloud(bpy.context, trial)
    label = thing.beyond_mocap_cloud.labels["LKNE"]
    label.segment, label.landmark, label.role = "LeftLeg", "left_knee_lateral", "OPTIONAL"
    fewer = trial.select_markers(("LKNE", "LASI")).with_positions(trial.positions[::-1][:, [2, 0]])
    cloud.write_trial(thing, fewer, scene)
    back = cloud.read_trial(thing, scene)
    assert back.labels == ("LKNE", "LASI") and np.nanmax(np.abs(back.positions - fewer.positions)) < 1e-6
    label = thing.beyond_mocap_cloud.labels["LKNE"]
    assert (label.segment, label.landmark, label.role) == ("LeftLeg", "left_knee_lateral", "OPTIONAL")
    assert len([one for one in bpy.data.objects if "trajectories" in one.name]) == 1


def test_a_saved_file_plays_and_reads(cloud, trial, tmp_path):
    cloud.create_cloud(bpy.context, trial)
    path = str(tmp_path / "kept.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    thing = bpy.data.objects["walk"]
    places, *_ = seen_at(thing, bpy.context.scene.frame_start)
    assert np.abs(places - trial.positions[0]).max() < 1e-5
    assert np.nanmax(np.abs(cloud.read_trial(thing, bpy.context.scene).positions - trial.positions)) < 1e-6


def test_a_vertex_that_is_doubled_in_edit_mode_is_no_second_marker(cloud, trial):
    thing = cloud.create_cloud(bpy.context, trial)
    bpy.context.view_layer.objects.active = thing
    thing.data.vertices.foreach_set("select", [False, True, False, False])
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.duplicate()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert len(thing.data.vertices) == 5
    assert cloud.read_trial(thing, bpy.context.scene).labels == trial.labels


@pytest.mark.parametrize("by", ["delete", "clear"])
def test_a_cloud_without_vertices_says_so(cloud, core, trial, by):
    thing = cloud.create_cloud(bpy.context, trial)
    if by == "clear":
        thing.data.clear_geometry()
    else:
        bpy.context.view_layer.objects.active = thing
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.mesh.delete(type="VERT")
        bpy.ops.object.mode_set(mode="OBJECT")
    thing.beyond_mocap_cloud.labels[0].segment = "Hips"
    with pytest.raises(core("base.errors").InputError, match="no vertex of a marker"):
        cloud.read_trial(thing, bpy.context.scene)


@pytest.mark.parametrize("lost", ["modifier", "empty", "mesh"])
def test_a_cloud_whose_player_is_spoilt_says_so(cloud, core, trial, lost):
    nodes = importlib.import_module(f"{EXTENSION}.scene.markers.nodes")
    thing = cloud.create_cloud(bpy.context, trial)
    if lost == "modifier":
        thing.modifiers.clear()
        with pytest.raises(core("base.errors").InputError, match="import the recording again"):
            cloud.compute_playback_rate(thing, bpy.context.scene)
    else:
        other = bpy.data.objects.new("other", bpy.data.meshes.new("other") if lost == "mesh" else None)
        nodes.set_input(nodes.find_modifier(thing), "Trajectories", other)
    assert cloud.sample_places(thing, 1.0) == []
    with pytest.raises(core("base.errors").InputError, match="no trajectories"):
        cloud.read_trial(thing, bpy.context.scene)


@pytest.fixture
def walk(core):
    """A recording in a file: Plug-in Gait on a walking body."""
    worlds.write_synthetic_markers()
    return worlds.MARKERS / "walk.trc"


def imported(path):
    bpy.ops.beyond_mocap.import_markers(filepath=str(path))
    return bpy.context.object


def test_importing_gives_what_the_reader_reads_and_is_one_step(cloud, core, walk):
    assert_one_step(bpy.ops.beyond_mocap.import_markers, filepath=str(walk))
    read = core("markers.files.marker_files").read_markers(walk)
    thing = bpy.data.objects["walk"]
    back = cloud.read_trial(thing, bpy.context.scene)
    assert back.labels == read.labels and back.fps == read.fps
    assert np.allclose(back.positions, read.positions, atol=1e-6, equal_nan=True)
    assert thing.beyond_mocap_cloud.set_name == "plug_in_gait"
    assert thing.beyond_mocap_cloud.labels["LKNE"].segment == "LeftUpLeg"


def test_dropped_files_become_clouds_with_names_of_their_own(walk):
    files = [{"name": "walk.trc"}, {"name": "static.trc"}]
    bpy.ops.beyond_mocap.import_markers("INVOKE_DEFAULT", directory=str(walk.parent), files=files)
    assert {thing.name for thing in bpy.context.selected_objects} == {"walk", "static"}


def test_a_marker_set_goes_to_a_file_and_comes_back(walk, tmp_path):
    thing = imported(walk)
    kept = thing.beyond_mocap_cloud
    kept.labels["*1"].role = "OTHER"
    kept.labels["LFIN"].role, kept.labels["RBAK"].role = "OPTIONAL", "STATIC"
    rows = [(row.name, row.segment, row.landmark, row.role) for row in kept.labels]
    path = str(tmp_path / "mine.txt")
    bpy.ops.beyond_mocap.save_marker_set(filepath=path)
    for row in kept.labels:
        row.segment = row.landmark = ""
        row.role = "NEEDED"
    assert_one_step(bpy.ops.beyond_mocap.load_marker_set, filepath=path)
    kept = bpy.data.objects["walk"].beyond_mocap_cloud
    assert [(row.name, row.segment, row.landmark, row.role) for row in kept.labels] == rows
    assert kept.set_name == "mine"


def test_markers_that_only_the_static_trial_has_are_of_the_set(core):
    sets = importlib.import_module(f"{EXTENSION}.scene.markers.sets")
    thing = imported(worlds.SAMPLE.parent / "markers" / "throw.c3d")
    known = {one.name: one for one in core("markers.files.marker_set_text").read_shipped_sets()}["driveline"]
    made = sets.build_marker_set(thing)
    assert {joint: set(labels) for joint, labels in made.segments.items()} == {
        joint: set(labels) for joint, labels in known.segments.items()
    }
    assert made.static == known.static and made.optional == known.optional and dict(made.aliases) == dict(known.aliases)
    assert {key: set(labels) for key, labels in made.landmarks.items()} == {
        key: set(labels) for key, labels in known.landmarks.items()
    }


def test_markers_without_names_go_to_the_side_they_are_near_to(core, tmp_path):
    known = core("synthetic.ground_truth.synthetic_markers").build_trial(
        core("synthetic.gait").build_gait(1.4, 0.4, fps=100.0), "sprinter", seed=2, occlusion=0.0, swaps=0, jumps=0,
        unlabeled=0
    )
    path = tmp_path / "run.trc"
    lost = known.trial.rename_labels({"LHAND": "x53",
                                      "RHAND": "x52"})  # the set's own aliases have them the other way round
    core("markers.files.trc").write_trc(lost, path)
    thing = imported(path)
    assert tuple(row.name for row in thing.beyond_mocap_cloud.labels) == known.trial.labels


def test_selected_vertices_are_assigned_to_a_segment(walk):
    thing = imported(walk)
    labels = thing.beyond_mocap_cloud.labels
    wanted = [row.name in ("LTHI", "LKNE") for row in labels]
    thing.data.vertices.foreach_set("select", wanted)
    thing.data.edges.foreach_set("select", [False] * len(thing.data.edges))
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.beyond_mocap.assign_markers(segment="RightLeg")
    assert [row.name for row in labels if row.segment == "RightLeg"] == ["LTHI", "LKNE", "RTIB", "RANK"]
    bpy.ops.object.mode_set(mode="OBJECT")
    side = np.empty(len(thing.data.vertices), np.int32)
    thing.data.attributes["side"].data.foreach_get("value", side)
    assert all(side[[row.name for row in labels].index(name)] == 2 for name in ("LTHI", "LKNE"))
    thing.beyond_mocap_cloud.active_label = 0
    bpy.ops.beyond_mocap.assign_markers(segment="NONE")
    assert not labels[0].segment and thing.beyond_mocap_cloud.set_name == "own"


def test_labels_are_written_where_markers_are_seen(walk):
    labels = importlib.import_module(f"{EXTENSION}.scene.markers.cloud")
    thing = imported(walk)
    thing.location.x = 3.0
    bpy.context.scene.frame_set(5)
    bpy.context.view_layer.update()
    found = {text: place for place, text, _ in labels.list_visible_labels(bpy.context)}
    places, seen, *_ = seen_at(thing, 5)
    names = [row.name for row in thing.beyond_mocap_cloud.labels]
    assert set(found) == {name for name, there in zip(names, seen) if there}
    for name, place in found.items():
        assert np.allclose(np.array(place) - [3.0, 0.0, 0.0], places[names.index(name)], atol=1e-5)
    bpy.context.scene.beyond_mocap_markers.names = False
    assert not labels.list_visible_labels(bpy.context)


def test_the_active_cloud_becomes_the_others_static_trial(walk):
    trial, still = imported(walk), imported(walk.with_name("static.trc"))
    assert_one_step(bpy.ops.beyond_mocap.set_static)
    trial, still = bpy.data.objects["walk"], bpy.data.objects["static"]
    assert trial.beyond_mocap_cloud.static == still and still.beyond_mocap_cloud.static is None


def test_a_static_trial_that_was_deleted_is_not_used(walk):
    imported(walk), imported(walk.with_name("static.trc"))
    bpy.ops.beyond_mocap.set_static()
    trial, still = bpy.data.objects["walk"], bpy.data.objects["static"]
    for collection in still.users_collection:
        collection.objects.unlink(still)
    bpy.context.view_layer.objects.active = trial
    with pytest.raises(RuntimeError, match="static trial static is not in the scene"):
        bpy.ops.beyond_mocap.reconstruct_markers()


def test_importing_leaves_edit_mode(walk):
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.object.mode_set(mode="EDIT")
    thing = imported(walk)
    assert bpy.context.mode == "OBJECT" and bpy.context.object == thing
    assert all(one.mode == "OBJECT" for one in bpy.data.objects)


def test_a_file_that_is_none_is_refused_and_nothing_comes(tmp_path):
    path = tmp_path / "broken.c3d"
    path.write_bytes(b"\x02P" + bytes(600))
    with pytest.raises(RuntimeError, match="broken.c3d"):
        bpy.ops.beyond_mocap.import_markers(filepath=str(path))
    assert not len(bpy.data.objects) and not len(bpy.data.meshes)


def test_into_a_linked_collection_nothing_is_imported(walk, tmp_path):
    bpy.context.scene.collection.children.link(bpy.data.collections.new("Theirs"))
    path = str(tmp_path / "theirs.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        wanted.collections = ["Theirs"]
    bpy.context.scene.collection.children.link(wanted.collections[0])
    layer = bpy.context.view_layer
    layer.active_layer_collection = layer.layer_collection.children["Theirs"]
    with pytest.raises(RuntimeError, match="a linked collection; expected one of this file"):
        bpy.ops.beyond_mocap.import_markers(filepath=str(walk))
    assert not len(bpy.data.objects) and not len(bpy.data.meshes)


@pytest.fixture
def session(extension):
    """What is kept of reconstructions, emptied afterwards."""
    yield importlib.import_module(f"{EXTENSION}.scene.markers.solve")
    importlib.import_module(f"{EXTENSION}.scene.markers.solve").clear_reconstructions()


def bone_at(body, bone, frame):
    """A bone's head in the world."""
    bpy.context.scene.frame_set(frame)
    return np.array(body.matrix_world @ body.pose.bones[bone].head)


def test_cleaning_is_what_the_core_does_and_one_step(cloud, core, walk):
    thing = imported(walk)
    trial = cloud.read_trial(thing, bpy.context.scene)
    sets = importlib.import_module(f"{EXTENSION}.scene.markers.sets")
    wanted = core("markers.cleaning.clean").clean_trial(trial,
                                                        sets.build_marker_set(thing).select_clusters(trial.labels))
    assert_one_step(bpy.ops.beyond_mocap.clean_markers)
    thing = bpy.data.objects["walk"]
    back = cloud.read_trial(thing, bpy.context.scene)
    assert back.labels == wanted.trial.labels
    assert np.allclose(back.positions, wanted.trial.positions, atol=1e-5, equal_nan=True)
    assert thing.beyond_mocap_cloud.cleaned.splitlines() == list(wanted.report.lines)
    assert thing.beyond_mocap_cloud.labels["LKNE"].segment == "LeftUpLeg"


def test_reconstructing_gives_the_recipe_s_body_beside_the_cloud(cloud, core, walk, session):
    thing = imported(walk)
    thing.location = (0.0, 2.0, 0.0)
    bpy.context.view_layer.update()
    assert_one_step(bpy.ops.beyond_mocap.reconstruct_markers)
    scene, thing = bpy.context.scene, bpy.data.objects["walk"]
    kept = thing.beyond_mocap_cloud
    made, body = session.find_reconstruction(kept.made), kept.body
    assert made is not None and kept.figures and kept.model is not None
    motion = importlib.import_module(f"{EXTENSION}.scene.core.action").read_motion(body, scene)
    assert motion.skeleton.names == made.motion.skeleton.names
    places = core("motion.motion").forward_kinematics(made.motion)[0]
    for frame in (1, 8):
        row = (frame - 1) / 24.0 * made.motion.fps
        for name in ("Hips", "LeftFoot", "RightHand"):
            joint = made.motion.skeleton.names.index(name)
            low = int(row)
            want = places[low, joint] * (1.0 - row + low) + places[low + 1, joint] * (row - low)
            assert np.abs(bone_at(body, name, frame) - want - [0.0, 2.0, 0.0]).max() < 5e-3, (frame, name)
    ankle, _, *_ = seen_at(thing, 8)
    near = ankle[[row.name for row in kept.labels].index("LANK")] + [0.0, 2.0, 0.0]
    assert np.linalg.norm(bone_at(body, "LeftFoot", 8) - near) < 0.12
    before = len(bpy.data.objects), len(bpy.data.actions)
    bpy.ops.beyond_mocap.reconstruct_markers()
    assert (len(bpy.data.objects), len(bpy.data.actions)) == before and kept.body == body


def test_a_model_is_saved_loaded_and_used(walk, session, tmp_path):
    thing = imported(walk)
    bpy.ops.beyond_mocap.reconstruct_markers()
    path = str(tmp_path / "model.json")
    bpy.ops.beyond_mocap.save_marker_model(filepath=path)
    made = session.find_reconstruction(thing.beyond_mocap_cloud.made)
    thing.beyond_mocap_cloud.model = None
    with pytest.raises(RuntimeError, match="no model"):
        bpy.ops.beyond_mocap.save_marker_model(filepath=path)
    assert_one_step(bpy.ops.beyond_mocap.load_marker_model, filepath=path)
    kept = bpy.data.objects["walk"].beyond_mocap_cloud
    assert kept.use_model
    bpy.ops.beyond_mocap.reconstruct_markers()
    again = session.find_reconstruction(kept.made)
    assert np.array_equal(again.model.places, made.model.places)
    assert np.allclose(again.motion.root_positions, made.motion.root_positions, atol=1e-4)


def test_the_motion_goes_to_the_library_with_its_words(walk, session, tmp_path):
    imported(walk)
    bpy.context.scene.beyond_mocap.library_folder = str(tmp_path)
    settings = bpy.context.scene.beyond_mocap_markers
    settings.add, settings.words = True, "walking"
    bpy.ops.beyond_mocap.reconstruct_markers()
    assert (tmp_path / "walk.bvh").is_file() and "walking" in (tmp_path / "walk.txt").read_text()
    with pytest.raises(RuntimeError, match="already exists"):
        bpy.ops.beyond_mocap.reconstruct_markers()


def test_a_slowed_cloud_has_a_slowed_body(cloud, walk, session):
    scene = bpy.context.scene
    thing = imported(walk)
    nodes = importlib.import_module(f"{EXTENSION}.scene.markers.nodes")
    modifier = nodes.find_modifier(thing)
    nodes.set_input(modifier, "Step", nodes.get_input(modifier, "Step") / 2.0)
    assert cloud.compute_playback_rate(thing, scene) == pytest.approx(50.0)
    bpy.ops.beyond_mocap.reconstruct_markers()
    body = thing.beyond_mocap_cloud.body
    first, last = body.animation_data.action.frame_range
    assert last - first == pytest.approx(0.6 * 2 * 24, abs=1.0)
    cloud.write_trial(thing, cloud.read_trial(thing, scene), scene)  # as Clean Up does
    assert cloud.compute_playback_rate(thing, scene) == pytest.approx(50.0)
    nodes.set_input(modifier, "Step", 0.0)
    for verb in (bpy.ops.beyond_mocap.reconstruct_markers, bpy.ops.beyond_mocap.find_release):
        with pytest.raises(RuntimeError, match="a Step of 0"):
            verb()


def test_a_copied_cloud_gets_a_body_of_its_own_and_a_lost_skin_comes_again(walk, session):
    scene, thing = bpy.context.scene, imported(walk)
    thing.beyond_mocap_cloud.release = "Speed: of the one before"
    scene.beyond_mocap_markers.dressed = False
    bpy.ops.beyond_mocap.reconstruct_markers()
    body = thing.beyond_mocap_cloud.body
    assert not body.children and not thing.beyond_mocap_cloud.release
    copied = thing.copy()
    scene.collection.objects.link(copied)
    bpy.context.view_layer.objects.active = copied
    scene.beyond_mocap_markers.dressed = True
    bpy.ops.beyond_mocap.reconstruct_markers()
    assert thing.beyond_mocap_cloud.body == body != copied.beyond_mocap_cloud.body
    bpy.context.view_layer.objects.active = thing
    bpy.ops.beyond_mocap.reconstruct_markers()
    assert thing.beyond_mocap_cloud.body == body and len(body.children) == 1


def test_a_throw_s_release_is_found_and_the_ball_flies(core, session):
    sample = worlds.SAMPLE.parent / "markers" / "throw.c3d"
    thing = imported(sample)
    bpy.ops.beyond_mocap.reconstruct_markers()
    thing.beyond_mocap_cloud.release = ""
    bpy.ops.beyond_mocap.find_release()
    kept = thing.beyond_mocap_cloud
    speed = float(kept.release.split("Speed: ")[1].split()[0])
    assert abs(speed / 28.15 - 1.0) < 0.03
    assert [marker.frame for marker in bpy.context.scene.timeline_markers] == [round(1 + 0.958 * 24)]
    places, seen, *_ = seen_at(thing, 26)
    marker = places[[row.name for row in kept.labels].index("BALL")]
    assert abs(np.linalg.norm(np.array(kept.ball.matrix_world.translation) - marker) - 0.0366) < 0.03
    ball, size = kept.ball, kept.ball.dimensions.x
    bpy.context.scene.beyond_mocap_markers.radius = size
    bpy.ops.beyond_mocap.find_release()
    bpy.context.view_layer.update()
    assert kept.ball == ball and ball.dimensions.x == pytest.approx(2.0 * size, rel=1e-3)


def test_without_a_body_no_release_is_looked_for(walk):
    imported(walk)
    with pytest.raises(RuntimeError, match="press Reconstruct"):
        bpy.ops.beyond_mocap.find_release()
