"""The stage: lines that cannot flicker, cameras that follow whatever moves, light and sky that are its own."""

import json
from importlib import import_module
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view
from conftest import EXTENSION
from mathutils import Vector
from worlds import MARKERS, write_synthetic_markers

FPS = 25


def room(name):
    return import_module(f"{EXTENSION}.scene.{name}")


@pytest.fixture
def walker(core):
    """Create armatures that walk for two seconds from a place (x, y), m."""
    motion = core("synthetic.gait").build_gait(1.5, 2.0, fps=FPS)
    place = core("motion.motion").place_motion

    def create(x, y, name="Ada"):
        scene = bpy.context.scene
        scene.render.fps = FPS
        body = room("rigs.armature").create_armature(bpy.context, motion.skeleton, name, scene.collection)
        room("core.action").write_motion(body, place(motion, 0.0, np.array([x, y, 0.0])), scene, 1)
        return body

    return create


def see(camera, body, frame):
    """Where a camera sees a body's root on a frame: right and up as shares of the picture, and metres away."""
    scene = bpy.context.scene
    scene.frame_set(frame)
    body = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return np.array(world_to_camera_view(scene, camera, body.matrix_world @ body.pose.bones[0].head))


def test_the_ball_of_passes_is_as_large_as_they_say_in_every_sport(core):
    scene = bpy.context.scene
    scene.beyond_mocap_stage.sport = "ice_hockey"
    path = core("motion.track.ball_path").BallPath(np.arange(3.0), np.zeros((3, 3)), np.ones(3, bool))
    room("passes.generate").apply_ball(scene, SimpleNamespace(ball=path, kind=SimpleNamespace(radius=0.105)), 1.0)
    bpy.context.view_layer.update()
    assert tuple(scene.beyond_mocap_passes.rally.dimensions) == pytest.approx(3 * (0.21,), rel=0.01)


@pytest.mark.parametrize("size", [(105.0, 68.0), (90.0, 45.0)])
def test_lines_are_faces_of_the_grass_and_nothing_lies_on_it(size):
    scene = bpy.context.scene
    room("stage.stage").create_stage(scene, size)
    flat = [thing for thing in scene.objects if thing.type == "MESH" and thing.dimensions.z < 0.1]
    assert [thing.name for thing in flat] == ["Grass"]
    mesh = flat[0].data
    corners = np.array([vertex.co for vertex in mesh.vertices])
    assert np.ptp(corners[:, 2]) == 0.0
    areas = np.array([face.area for face in mesh.polygons])
    assert np.isclose(areas.sum(), (size[0] + 12.0) * (size[1] + 12.0), rtol=1e-5)  # nothing twice, no hole
    assert all(face.normal.z > 0.99 for face in mesh.polygons)
    names = [mesh.materials[face.material_index].name for face in mesh.polygons]
    lines = np.array([name == "Pitch line" for name in names])
    on_lines = np.array([corners[i] for face, is_line in zip(mesh.polygons, lines) if is_line for i in face.vertices])
    assert np.allclose(np.abs(on_lines[:, :2]).max(axis=0), np.array(size) / 2.0 + 0.06, atol=0.011)
    assert 60.0 < areas[lines].sum() < 95.0
    colours = {material.name: tuple(material.diffuse_color) for material in mesh.materials}  # of the solid view
    assert min(colours["Pitch line"][:3]) > 0.7 and len(set(colours.values())) == 3


@pytest.mark.parametrize("size", [(105.0, 68.0), (90.0, 45.0)])
def test_goals_fit_the_pitch(size):
    scene = bpy.context.scene
    room("stage.stage").create_stage(scene, size)
    bpy.context.view_layer.update()
    goals = [thing for thing in scene.objects if thing.name.startswith(("Goal", "Net"))]
    assert len(goals) == 4
    for goal in goals:
        corners = np.array([goal.matrix_world @ vertex.co for vertex in goal.data.vertices])
        assert np.all(np.abs(corners[:, 0]) > size[0] / 2.0 - 0.07)  # behind the line
        assert 2.4 < corners[:, 2].max() < 2.6 and 7.3 < np.ptp(corners[:, 1]) < 7.7


@pytest.mark.parametrize("sport", ["futsal", "handball", "basketball", "ice_hockey", "field_hockey", "rugby",
                                   "american_football"])
def test_each_sport_has_its_ground_goals_and_ball(sport):
    scene = bpy.context.scene
    stage = room("stage.stage")
    stage.create_stage(scene)
    for name in ("ice_hockey", sport):  # what one sport leaves in the file is not the next one's
        scene.beyond_mocap_stage.sport = name
    kind = room("stage.stage_collection").find_sport(scene)
    length, width = kind.size
    assert room("stage.stage_collection").find_pitch_size(scene) == kind.size
    bpy.context.view_layer.update()
    grounds = [thing for thing in scene.objects if thing.name.startswith("Grass")]
    assert len(grounds) == 1
    areas = np.array([face.area for face in grounds[0].data.polygons])
    around = (length + 2 * kind.behind + 12.0) * (width + 12.0)
    assert areas.sum() == pytest.approx(around, rel=1e-4) and areas.min() > 0.0  # nothing twice, no hole
    paints = {face.material_index for face in grounds[0].data.polygons} - {0, 1}
    assert len(paints) == (3 if sport == "ice_hockey" else 1)
    goals = [thing for thing in stage.find_pitch(scene) if thing.name.startswith("Goal ") and len(
        thing.name.split()) == 2]
    assert sorted(goal.location.x for goal in goals) == pytest.approx(
        [kind.goal.inset - length / 2, length / 2 - kind.goal.inset], abs=1e-4)
    shader = goals[0].data.materials[0].node_tree.nodes["Principled BSDF"]
    assert tuple(shader.inputs["Base Color"].default_value)[:3] == pytest.approx(kind.goal.colour)
    assert max(goal.dimensions.z for goal in goals) >= min(kind.goal.height, 0.01)
    ball = room("stage.ball").create_ball(bpy.context, "Ball", scene.collection)
    bpy.context.view_layer.update()
    across = 2 * kind.ball.radius
    wanted = (kind.ball.length or across, across, kind.ball.thickness or across)
    assert tuple(ball.dimensions) == pytest.approx(wanted, rel=0.01)
    scene.beyond_mocap_stage.sport = "football"
    assert room("stage.stage_collection").find_pitch_size(scene) == (105.0, 68.0)


def test_balls_become_those_of_the_sport_and_roll_by_their_own_radius(core):
    """A ball of a size of its own stays; what a ball has rolled after a metre is a metre over its radius."""
    scene, balls = bpy.context.scene, room("stage.ball")
    x = np.linspace(0.0, 1.0, 25)
    path = core("motion.track.ball_path").BallPath(x, np.column_stack([x, 0 * x, 0 * x + 0.1]), np.ones(25, bool))
    ball = balls.create_ball(bpy.context, "Ball", scene.collection)
    small = balls.create_ball(bpy.context, "Small", scene.collection, 0.03)
    old = balls.create_ball(bpy.context, "Old", scene.collection)  # as earlier versions saved it
    del old.data[balls.SPORT], old[balls.ROLLING_RADIUS]
    bpy.context.view_layer.update()
    for thing in (ball, small):
        balls.write_trajectory(thing, path, scene, 1.0)

    def measure(thing):
        scene.frame_set(1 + round(scene.render.fps * 0.5))
        return thing.rotation_quaternion.angle, max(thing.dimensions), thing.data.materials[0].name

    before = measure(ball)
    assert before[:2] == pytest.approx((0.5 / 0.11, 0.22), rel=0.02)
    assert measure(small)[:2] == pytest.approx(((0.5 / 0.03) % (2 * np.pi), 0.06), rel=0.02)
    scene.beyond_mocap_stage.sport = "basketball"
    radius = room("stage.stage_collection").find_sport(scene).ball.radius
    assert measure(ball) == (pytest.approx(0.5 / radius, rel=0.02), pytest.approx(2 * radius, rel=0.02),
                             "Ball white basketball")
    assert measure(small)[1] == pytest.approx(0.06, rel=0.02)
    assert max(old.dimensions) == pytest.approx(2 * radius, rel=0.02)
    scene.beyond_mocap_stage.sport = "ice_hockey"  # a puck slides
    assert measure(ball)[0] == 0.0
    scene.beyond_mocap_stage.sport = "football"
    assert measure(ball) == before and len([one for one in bpy.data.meshes if one.name.startswith("Ball")]) == 1


@pytest.mark.parametrize("when", ["before", "after", "reopened"])
def test_the_camera_follows_the_bodies_whenever_the_stage_is_added(walker, when, tmp_path):
    if when == "before":
        bpy.ops.beyond_mocap.add_stage()
    body = walker(28.9, 11.3)
    if when == "reopened":
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "one.blend"))
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "one.blend"))
        body = bpy.context.scene.objects["Ada"]
    if when != "before":
        bpy.ops.beyond_mocap.add_stage()
    room("stage.cameras").update_cameras(bpy.context.scene)
    for frame in (1, 25, 51):
        x, y, away = see(bpy.context.scene.camera, body, frame)
        assert 0.3 < x < 0.7 and 0.3 < y < 0.7 and away < 12.0


@pytest.mark.parametrize("view", ["FOLLOW", "BROADCAST", "TACTICAL", "GOAL"])
def test_every_view_has_all_bodies_in_the_picture_and_moves_smoothly(walker, view):
    bodies = [walker(x, y, name) for x, y, name in ((20.0, 8.0, "Ada"), (24.0, 3.0, "Bea"))]
    bpy.ops.beyond_mocap.stage_view(view=view)
    scene = bpy.context.scene
    assert scene.camera["beyond_mocap_view"] == view
    seen = np.array([[see(scene.camera, body, frame) for body in bodies] for frame in range(1, 52)])
    assert np.all((seen[..., :2] > 0.02) & (seen[..., :2] < 0.98)) and np.all(seen[..., 2] > 0.0)
    turns = []
    for frame in range(1, 52):
        scene.frame_set(frame)
        turns.append(scene.camera.matrix_world.to_quaternion() @ Vector((0.0, 0.0, -1.0)))
    jerk = np.linalg.norm(np.diff(np.array(turns), 3, axis=0), axis=1)
    assert jerk.max() < 2e-3  # rad per frame^3


def test_the_players_eye_is_in_the_selected_players_head(walker):
    walker(0.0, 0.0, "Ada")
    second = walker(5.0, 5.0, "Bea")
    second.select_set(True)
    bpy.context.view_layer.objects.active = second
    bpy.ops.beyond_mocap.stage_view(view="EYES")
    scene = bpy.context.scene
    assert scene.camera["beyond_mocap_eyes_of"] == second
    scene.frame_set(20)
    assert 1.4 < scene.camera.matrix_world.translation.z < 1.9


def test_a_view_without_a_body_shows_the_empty_pitch_and_eyes_say_what_is_missing():
    bpy.ops.beyond_mocap.stage_view(view="TACTICAL")
    assert bpy.context.scene.camera.animation_data is None
    with pytest.raises(RuntimeError, match="no body moves in this scene"):
        bpy.ops.beyond_mocap.stage_view(view="EYES")


def test_a_camera_that_the_user_has_moved_or_animated_stays(walker):
    walker(0.0, 0.0)
    scene = bpy.context.scene
    bpy.ops.beyond_mocap.stage_view(view="BROADCAST")
    scene.camera.location = (1.0, -70.0, 30.0)
    aim = next(thing for thing in scene.objects if thing.name == "Broadcast aim")
    own = bpy.data.actions.new("Mine")
    room("core.channels").assign_action(aim, own, own.slots.new(id_type="OBJECT", name="Mine"))
    walker(40.0, 20.0, "Bea")
    bpy.ops.beyond_mocap.add_stage()
    assert tuple(scene.camera.location) == (1.0, -70.0, 30.0) and aim.animation_data.action == own


def grey_world():
    """Blender's own, as in its new files."""
    world = bpy.data.worlds.new("World")
    if world.node_tree is None:
        world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.0509, 0.0509, 0.0509, 1.0)
    bpy.context.scene.world = world
    return world


def test_the_plain_world_gives_way_to_a_sky():
    scene = bpy.context.scene
    grey_world()
    bpy.ops.beyond_mocap.add_stage()
    assert scene.world.name.startswith("Stage sky") and scene.view_settings.view_transform == "AgX"


def test_a_world_of_the_users_stays():
    scene, own = bpy.context.scene, grey_world()
    next(node for node in own.node_tree.nodes if node.type == "BACKGROUND").inputs[0].default_value = (0.9, 0.2, 0.1, 1)
    bpy.ops.beyond_mocap.add_stage()
    assert scene.world == own


def test_light_and_stands_can_be_changed_and_nothing_is_left_twice(walker):
    scene = bpy.context.scene
    walker(10.0, 0.0)
    bpy.ops.beyond_mocap.add_stage()
    before = len(scene.objects)
    scene.beyond_mocap_stage.light = "FLOODLIGHT"
    lamps = [thing for thing in scene.objects if thing.type == "LIGHT"]
    assert len(lamps) == 4 and {lamp.data.type for lamp in lamps} == {"AREA"}
    scene.beyond_mocap_stage.stands = True
    assert "Stands" in scene.objects and not [thing for thing in scene.objects if "mast" in thing.name]
    scene.beyond_mocap_stage.light, scene.beyond_mocap_stage.stands = "DAYLIGHT", False
    assert len(scene.objects) == before
    assert not [mesh for mesh in bpy.data.meshes if not mesh.users]
    assert not [light for light in bpy.data.lights if not light.users]


def test_tracks_are_not_rendered(walker):
    scene = bpy.context.scene
    ribbon = room("result.bake").write_ribbon(bpy.context, "Ada track", np.zeros((3, 2)), (1, 0, 0), scene.collection)
    assert ribbon.hide_render and not ribbon.hide_viewport


def test_a_track_of_an_older_file_is_hidden_from_renders_when_it_is_opened(tmp_path):
    scene = bpy.context.scene
    scene.beyond_mocap.players.add().name = "Ada"
    home = room("result.bake").find_or_create_collection(scene)
    for name in ("Ada track", "Mine"):
        home.objects.link(bpy.data.objects.new(name, bpy.data.curves.new(name, "CURVE")))
    room("core.migrate").on_save()
    scene.beyond_mocap.version = 1
    room("core.migrate").on_load()
    assert scene.objects["Ada track"].hide_render and not scene.objects["Mine"].hide_render


def write_clip(core, path, seconds):
    bvh, motion = core("files.bvh.bvh"), core("synthetic.gait").build_gait(1.5, seconds, fps=24.0)
    bvh.write_bvh(path, motion)
    return len(motion)


def test_a_fresh_scene_ends_where_its_import_ends_and_another_one_grows(core, tmp_path):
    scene = bpy.context.scene
    scene.render.fps = 24
    short, long = write_clip(core, tmp_path / "short.bvh", 2.0), write_clip(core, tmp_path / "long.bvh", 4.0)
    bpy.ops.beyond_mocap.import_clips(filepath=str(tmp_path / "short.bvh"))
    assert (scene.frame_start, scene.frame_end) == (1, short)
    bpy.ops.beyond_mocap.import_clips(filepath=str(tmp_path / "long.bvh"))
    assert scene.frame_end == long
    bpy.ops.beyond_mocap.import_clips(filepath=str(tmp_path / "short.bvh"))
    assert scene.frame_end == long


def test_a_short_recording_of_markers_sets_the_end_of_a_fresh_scene():
    write_synthetic_markers()
    scene = bpy.context.scene
    scene.render.fps = 24
    bpy.ops.beyond_mocap.import_markers(filepath=str(MARKERS / "walk.trc"))
    cloud = bpy.context.view_layer.objects.active
    assert scene.frame_end == 1 + int(24 * room("markers.cloud").read_trial(cloud, scene).duration + 1e-4) < 60


def test_a_ball_outside_the_bodies_time_leaves_the_cameras_with_the_bodies(walker):
    scene, body = bpy.context.scene, walker(20.0, 8.0)
    ball = room("stage.ball").create_ball(bpy.context, "Ball", scene.collection)
    for frame in (300, 400):
        ball.keyframe_insert("location", frame=frame)
    bpy.ops.beyond_mocap.stage_view(view="BROADCAST")
    assert np.all(np.abs(see(scene.camera, body, 30)[:2] - 0.5) < 0.3)


def test_of_many_bodies_those_nearest_to_the_ball_are_framed(walker):
    presenting, scene = room("stage.presenting"), bpy.context.scene
    bpy.ops.beyond_mocap.add_stage()
    bodies = [walker(4.0 * i, 0.0, f"p{i}") for i in range(9)]
    ball = room("stage.ball").create_ball(bpy.context, "Ball", scene.collection)
    for frame in (1, 50):
        ball.location.x = 31.0
        ball.keyframe_insert("location", frame=frame)
    bpy.context.view_layer.update()
    assert set(presenting.choose_objects(scene, [*scene.objects])) == set(bodies[3:])
    assert presenting.choose_objects(scene, bodies[:2]) == bodies[:2]


def test_a_new_ball_is_framed_with_who_throws_it(walker):
    scene, thrower = bpy.context.scene, walker(0.0, 0.0)
    for thing in bpy.context.selected_objects:
        thing.select_set(False)
    thrower.select_set(True)
    ball = room("stage.ball").create_ball(bpy.context, "Ball", scene.collection)
    assert room("stage.presenting").choose_objects(scene, [ball]) == [ball, thrower]


@pytest.mark.parametrize("module, name", [
    ("player", "import_tracking"), ("library.clips", "import_clips"),
    ("library.library", "import_clip"),
    ("markers", "import_markers"), ("markers", "reconstruct_markers"), ("passes", "passes_make"),
    ("throws", "throw_at_target"), ("throws", "kick_at_target"), ("library.library_labels", "annotate_clip"),
])
def test_what_makes_bodies_moves_the_view_to_them(module, name):
    assert getattr(import_module(f"{EXTENSION}.operators.{module}"), f"BEYOND_MOCAP_OT_{name}").presents


def test_exporters_read_the_grass_as_green(tmp_path):
    bpy.ops.beyond_mocap.add_stage()
    bpy.ops.export_scene.gltf(filepath=str(tmp_path / "stage.glb"))
    raw = (tmp_path / "stage.glb").read_bytes()
    found = json.loads(raw[20:20 + int.from_bytes(raw[12:16], "little")])["materials"]
    red, green, blue, _ = next(one for one in found if one["name"] == "Pitch grass")["pbrMetallicRoughness"][
        "baseColorFactor"]
    assert green > 2 * red > blue


def test_a_zoom_of_ones_own_stays(extension):
    bpy.ops.beyond_mocap.add_stage()
    bpy.ops.beyond_mocap.stage_view(view="BROADCAST")
    lens = bpy.context.scene.camera.data
    lens.animation_data_clear()
    for frame, length in ((1, 35.0), (40, 90.0)):
        lens.lens = length
        lens.keyframe_insert("lens", frame=frame)
    mine = lens.animation_data.action
    bpy.ops.beyond_mocap.add_stage()
    assert lens.animation_data.action == mine


def test_what_is_changed_of_the_sky_stays_until_the_light_changes(extension):
    bpy.ops.beyond_mocap.add_stage()
    scene = bpy.context.scene
    shader = next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND")
    shader.inputs["Strength"].default_value = 7.0
    scene.beyond_mocap_stage.stands = True
    bpy.ops.beyond_mocap.add_stage()
    strengths = [node.inputs["Strength"].default_value for node in scene.world.node_tree.nodes
                 if node.type == "BACKGROUND"]
    assert strengths == [7.0]
    scene.beyond_mocap_stage.light = "FLOODLIGHT"
    (shader,) = (node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND")
    assert shader.inputs["Strength"].default_value == 1.0
