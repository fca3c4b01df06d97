"""A stretch of a match in the scene: who is there when, in what, where, and seen by which cameras."""

import importlib

import bpy
import numpy as np
import pytest
from conftest import EXTENSION

START, FPS = 100.0, 30


@pytest.fixture
def room():
    return lambda name, package="scene.match": importlib.import_module(f"{EXTENSION}.{package}.{name}")


@pytest.fixture(scope="module")
def walk(core):
    """Four seconds of walking from a place, facing an angle."""
    from dataclasses import replace

    gait, quaternion = core("synthetic.gait").build_gait, core("motion.quaternion")
    motion = gait(1.4, 4.0, FPS)

    def placed(x, y, angle=0.0):
        turn = quaternion.from_up_angle(np.array(angle))
        rotations = np.array(motion.rotations)
        rotations[:, 0] = quaternion.multiply(turn, rotations[:, 0])
        root = quaternion.rotate(turn, motion.root_positions) + [x, y, 0.0]
        return replace(motion, rotations=rotations, root_positions=root)

    return placed


@pytest.fixture
def scenery(room, core, walk):
    """Three players, of whom one comes a second and a half late, a referee, and a ball."""
    person = room("load").Character
    people = (
        person("h1", "Ada", 1, "home", True, ((START, walk(-40.0, 0.0)),)),
        person("h10", "Dan", 10, "home", False, ((START, walk(0.0, -3.0)),)),
        person("a7", "Eva", 7, "away", False, ((START + 1.5, walk(0.0, 3.0, np.pi)),)),
        person("r", "", -1, "referee", False, ((START, walk(5.0, 0.0)),)),
    )
    times = START + np.arange(4 * FPS + 1) / FPS
    places = np.column_stack([10.0 * (times - START), np.zeros(len(times)), np.full(len(times), 0.11)])
    ball = core("synthesis.take").BallPath(times, places, np.ones(len(times), bool))
    colours = {"home": "#FFFFFF", "away": "#0000FF"}
    return room("load").MatchSection(START, START + 6.0, 100.0, 64.0, colours, people, ball)


def shown(room, scenery, first=11, fps=(FPS, 1.0)):
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = fps
    room("show").show_match(bpy.context, scenery, first)
    return scene


def at(thing, frame):
    bpy.context.scene.frame_set(frame)
    return thing.evaluated_get(bpy.context.evaluated_depsgraph_get())


@pytest.mark.parametrize("fps", [(30, 1.0), (24, 1.001)])
@pytest.mark.parametrize("scale", [1.0, 0.01])
def test_everybody_is_where_he_is_in_the_match(room, scenery, fps, scale):
    bpy.context.scene.unit_settings.scale_length = scale
    scene = shown(room, scenery, fps=fps)
    rate = fps[0] / fps[1]
    bodies = {thing[room("match_objects").PLAYER_PROPERTY]: thing
              for thing in room("match_objects").find_armatures(scene)}
    assert set(bodies) == {"h1", "h10", "a7", "r"}
    assert bodies["h10"].name == "Home 10 Dan"
    for person in scenery.characters:
        begins, motion = person.motions[0]
        frame = round(11 + (begins - START + 2.0) * rate)
        played = (frame - 11) / rate - (begins - START)  # seconds
        place = [np.interp(played * FPS, np.arange(len(motion)), axis) for axis in motion.root_positions.T]
        hips = at(bodies[person.id], frame).pose.bones[0]
        assert np.allclose(np.array(hips.matrix.translation) * scale, place, atol=2e-3)
    ball = room("show").find_ball(scene)
    there = np.array(at(ball, 35).matrix_world.translation) * scale
    assert np.allclose(there, (10.0 * 24 / rate, 0.0, 0.11), atol=1e-3)
    assert scene.frame_end >= int(11 + 5.5 * rate)


def test_who_is_away_is_hidden(room, scenery):
    scene = shown(room, scenery)
    late = next(thing for thing in room("match_objects").find_armatures(scene)
                if thing[room("match_objects").PLAYER_PROPERTY] == "a7")
    hidden = {}
    for frame in (11, 11 + 44, 11 + 45, 11 + 45 + 120, 11 + 45 + 121):
        scene.frame_set(frame)
        hidden[frame - 11] = {thing.hide_render for thing in late.children}
        assert {thing.hide_viewport for thing in late.children} == hidden[frame - 11]
    assert hidden == {0: {True}, 44: {True}, 45: {False}, 165: {False}, 166: {True}}
    assert len(late.children) == 2


def test_meshes_are_shared_and_wear_the_kit(room, scenery):
    scene = shown(room, scenery)
    bodies = {thing[room("match_objects").PLAYER_PROPERTY]: thing
              for thing in room("match_objects").find_armatures(scene)}
    assert len({thing.data for thing in bodies.values()}) == 1
    worn = {who: next(one for one in thing.children if one.name.endswith("body")) for who, thing in bodies.items()}
    meshes = {who: thing.data for who, thing in worn.items()}
    assert len(set(meshes.values())) == 4  # home, home keeper, away, referee

    def shirt(mesh):
        material = next(one for one in mesh.materials if one.name.endswith("shirt"))
        shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
        return tuple(round(share, 2) for share in shader.inputs["Base Color"].default_value[:3])

    assert shirt(meshes["h10"]) == (1.0, 1.0, 1.0) and shirt(meshes["a7"]) == (0.0, 0.0, 1.0)
    keeper = shirt(meshes["h1"])
    assert keeper not in {shirt(meshes[who]) for who in ("h10", "a7", "r")}
    assert not [one for one in bodies["r"].children if one.name.endswith("number")]


def test_numbers_ride_the_back(room, scenery):
    """In a walk every corner of the number stays within a centimetre of the shirt, and before it."""
    scene = shown(room, scenery)
    ten = next(thing for thing in room("match_objects").find_armatures(scene)
               if thing[room("match_objects").PLAYER_PROPERTY] == "h10")
    number, body = (next(one for one in ten.children if one.name.endswith(part)) for part in ("number", "body"))
    from mathutils.bvhtree import BVHTree

    for frame in (20, 45, 80):
        scene.frame_set(frame)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        tree = BVHTree.FromObject(body, depsgraph)
        shape = number.evaluated_get(depsgraph).to_mesh()
        away = [tree.find_nearest(number.matrix_world @ vertex.co)[3] for vertex in shape.vertices]
        assert 0.0 < np.median(away) < 0.006 and max(away) < 0.012, (frame, max(away))
        assert len(shape.vertices) > 200


def test_numbers_read_from_behind_and_before(core):
    """A drawing's right is the reader's right on either side, and its top is up."""
    shirts = core("appearance.shirt_number")
    skeleton = core("motion.retargeting.adult").build_adult_skeleton()
    neutral = core("motion.retargeting.neutral").build_neutral_stance(skeleton)
    body = core("appearance.body").build_body(skeleton)
    drawing = np.array([[0.05, 0.0], [-0.05, 0.0], [0.0, 0.06]])
    for side, right in (("back", -1.0), ("chest", 1.0)):
        laid = shirts.place_on_shirt(body, skeleton, drawing, side)
        assert np.allclose(laid.weights.sum(axis=1), 1.0)
        turned = np.einsum("nk,nkc->nc", laid.weights, _posed(core, laid, neutral, skeleton))
        assert np.isclose(turned[0, 1] - turned[1, 1], 0.1 * right, atol=0.005)
        assert turned[2, 2] > turned[0, 2] + 0.05
        assert np.all(turned[:, 0] * right > 0.05)  # the person faces +X


def _posed(core, laid, neutral, skeleton):
    quaternion, kinematics = core("motion.quaternion"), core("motion.motion").compute_pose
    rest = kinematics(skeleton, np.zeros((1, 3)), quaternion.identity(1, len(skeleton)))[0][0]
    moved = laid.vertices[:, None] - rest[laid.joints]
    return quaternion.rotate(neutral.rotations[laid.joints], moved) + neutral.positions[laid.joints]


def test_shown_again_it_takes_its_own_place_and_leaves_the_users_things(room, scenery):
    scene = shown(room, scenery)
    own = bpy.data.objects.new("Mine", None)
    room("match_objects").create_collection(scene, "home").objects.link(own)
    kinds = ("objects", "meshes", "actions", "armatures", "collections", "cameras", "lights", "curves")
    before = {kind: len(getattr(bpy.data, kind)) for kind in kinds}
    shown(room, scenery)
    assert before == {kind: len(getattr(bpy.data, kind)) for kind in before}
    assert own.name in scene.objects
    room("match_objects").clear_match(scene)
    assert own.name in scene.objects and not room("match_objects").find_armatures(scene)
    assert len(bpy.data.armatures) == 0 and len(bpy.data.actions) == 0


def test_shown_again_where_its_collections_were_excluded(room, scenery):
    scene = shown(room, scenery)
    room("match_objects").create_collection(scene, "home").objects.link(bpy.data.objects.new("Mine", None))
    layers = bpy.context.view_layer.layer_collection.children
    layers["Match"].exclude = True
    shown(room, scenery)
    body = room("match_objects").find_armatures(scene)[0]
    assert body.visible_get() and body.animation_data.action_slot is not None


def test_it_takes_its_own_place_below_another_collection(room, scenery):
    scene = shown(room, scenery)
    room("match_objects").create_collection(scene, "home").objects.link(bpy.data.objects.new("Mine",
            None))  # so that it stays
    above, whole = bpy.data.collections.new("Above"), room("match_objects").find_root(scene)
    scene.collection.children.link(above)
    scene.collection.children.unlink(whole)
    above.children.link(whole)
    bpy.context.view_layer.layer_collection.children["Above"].exclude = True
    shown(room, scenery)
    assert len([thing for thing in scene.objects if thing.type == "ARMATURE"]) == 4
    assert room("match_objects").find_root(scene) in above.children[:] and room("match_objects").find_armatures(scene)[
        0].visible_get()


def test_actions_that_somebody_keeps_stay(room, scenery):
    """His own, which gets a shield, and one of ours that he has given a shield; others go."""
    scene = shown(room, scenery)
    first, second, *_ = room("match_objects").find_armatures(scene)
    own = bpy.data.actions.new("Mine")
    own.slots.new(id_type="OBJECT", name="Mine")
    first.animation_data.action, first.animation_data.action_slot = own, own.slots[0]
    second.animation_data.action.name, second.animation_data.action.use_fake_user = "Kept", True
    shown(room, scenery)
    room("match_objects").clear_match(scene)
    kept = {action.name for action in bpy.data.actions if action.use_fake_user}
    assert kept == {"Mine", "Kept"}


def second_scene(name="Second"):
    """Another scene, which is the context's from now on."""
    scene = bpy.data.scenes.new(name)
    bpy.context.window.scene = scene
    return scene


def shirt_colours(room, scene):
    """Team -> rounded colour of what its first player wears, number and shirt."""
    out = {}
    for body in room("match_objects").find_armatures(scene):
        for mesh in (thing.data for thing in body.children):
            for material in mesh.materials:
                if "shirt" in material.name or "number" in material.name:
                    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
                    rgb = tuple(round(share, 2) for share in shader.inputs["Base Color"].default_value[:3])
                    out[body[room("match_objects").PLAYER_PROPERTY], material.name.split(".")[0].split()[-1]] = rgb
    return out


def test_two_matches_in_one_file_wear_their_own_colours(room, scenery):
    from dataclasses import replace

    first = shown(room, scenery)
    before = shirt_colours(room, first)
    second = second_scene()
    shown(room, replace(scenery, colours={"home": "#101010", "away": "#FFFFFF"}))
    assert shirt_colours(room, first) == before
    after = shirt_colours(room, second)
    assert after["h10", "shirt"] != before["h10", "shirt"] and after["h10", "number"] != before["h10", "number"]
    room("kits").update_materials(second, {"home": "#00FF00", "away": "#FFFFFF"})
    assert shirt_colours(room, first) == before and shirt_colours(room, second)["h10", "shirt"] == (0.0, 1.0, 0.0)
    count = len(bpy.data.materials)
    shown(room, scenery)
    assert len(bpy.data.materials) == count  # its own are worn again


@pytest.mark.parametrize("linked", ["whole", "part", "player"])
def test_what_another_scene_shows_too_stays_there(room, scenery, linked):
    first = shown(room, scenery)
    ours, second = room("match_objects"), bpy.data.scenes.new("Second")
    home = next(one for one in ours.find_root(first).children if one[ours.MARK] == "home")
    if linked == "player":
        second.collection.objects.link(ours.find_armatures(first)[0])
    else:
        second.collection.children.link(ours.find_root(first) if linked == "whole" else home)
    there = {thing.name for thing in second.objects}
    shown(room, scenery)
    assert {thing.name for thing in second.objects} == there
    assert len(ours.find_armatures(first)) == 4 and not there & {thing.name for thing in first.objects}
    ours.clear_match(first)
    assert {thing.name for thing in second.objects} == there and not ours.find_armatures(first)


def test_a_collection_of_the_users_that_two_scenes_have_is_told(room, core, scenery):
    first = shown(room, scenery)
    ours, second = room("match_objects"), bpy.data.scenes.new("Second")
    above, whole = bpy.data.collections.new("Above"), ours.find_root(first)
    first.collection.children.unlink(whole)
    above.children.link(whole)
    for scene in (first, second):
        scene.collection.children.link(above)
    with pytest.raises(core("base.errors").InputError, match="'Above': holds the match 'Match' in two scenes"):
        ours.clear_match(first)
    assert len(ours.find_armatures(first)) == 4


def test_a_match_linked_from_another_file_is_left_alone(room, scenery, tmp_path):
    shown(room, scenery)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "other.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "other.blend"), link=True) as (_, linked):
        linked.collections = ["Match"]
    scene = bpy.context.scene
    scene.collection.children.link(linked.collections[0])
    assert not room("match_objects").find_armatures(scene)
    shown(room, scenery)
    assert len(room("match_objects").find_armatures(scene)) == 4 and all(not thing.library
                                                                         for thing in room(
        "match_objects").find_armatures(scene))
    assert linked.collections[0] in scene.collection.children[:] and len(linked.collections[0].all_objects) > 10
    worn = room("match_objects").find_armatures(scene)[0].children[0].data.materials
    assert all(cloth.library is None for cloth in worn)  # a linked one would not take a new colour


def test_a_match_and_single_players_share_one_stage(room, scenery):
    """Before or after: one pitch, of the match's size; what the user put on the stage stays."""
    stage = room("stage.stage", "scene")
    scene = bpy.context.scene
    stage.create_stage(scene)
    own = bpy.data.objects.new("Mine", None)
    scene.collection.children["Stage"].objects.link(own)
    shown(room, scenery)
    assert scene.camera == room("stage.cameras", "scene").find_camera(scene, "BROADCAST") is not None
    bpy.ops.beyond_mocap.add_stage()
    grass = [thing for thing in scene.objects if thing.name.startswith("Grass")]
    assert [round(side) for side in grass[0].dimensions[:2]] == [112, 76] and len(grass) == 1
    assert scene.camera.name == "Broadcast" and own.name in scene.collection.children["Stage"].objects


def test_a_stage_of_the_users_own_stays(room, scenery):
    scene, own = bpy.context.scene, bpy.data.collections.new("Stage")
    scene.collection.children.link(own)
    for name in ("Camera", "Sun", "Grass"):
        own.objects.link(bpy.data.objects.new(name, None))
    shown(room, scenery)
    assert sorted(thing.name for thing in own.objects) == ["Camera", "Grass", "Sun"]


def test_the_stands_camera_keeps_the_ball_in_its_picture(room, scenery):
    from bpy_extras.object_utils import world_to_camera_view

    scene = shown(room, scenery)
    camera, ball = room("stage.cameras", "scene").find_camera(scene, "BROADCAST"), room("show").find_ball(scene)
    assert scene.camera == camera
    places = []
    for frame in range(11, 11 + 121, 10):
        scene.frame_set(frame)
        x, y, z = world_to_camera_view(scene, camera, ball.matrix_world.translation)
        assert 0.05 < x < 0.95 and 0.05 < y < 0.95 and z > 0.0
        places.append(tuple(camera.matrix_world.translation))
    assert len(set(places)) == 1  # it stands still


def test_eyes_see_what_the_player_sees_but_not_his_own_head(room, scenery):
    scene = shown(room, scenery)
    ten = next(thing for thing in room("match_objects").find_armatures(scene)
               if thing[room("match_objects").PLAYER_PROPERTY] == "h10")
    camera = room("stage.eyes", "scene").create_eyes_camera(scene, ten, None)
    for frame in (20, 60, 120):
        scene.frame_set(frame)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        eye, ahead = camera.matrix_world.translation, camera.matrix_world.to_quaternion() @ _ahead()
        assert 1.5 < eye.z < 1.8 and ahead.x > 0.9  # he walks along +X
        body = next(one for one in ten.children if one.name.endswith("body")).evaluated_get(depsgraph)
        assert not _hit(body, eye, ahead, camera.data.clip_start)
        up = camera.matrix_world.to_quaternion() @ _ahead((0.0, 1.0, 0.0))
        assert up.z > 0.9
    actions = len(bpy.data.actions)
    assert room("stage.eyes", "scene").create_eyes_camera(scene, ten, room("show").find_ball(scene)) == camera
    assert len(bpy.data.actions) == actions


def _ahead(way=(0.0, 0.0, -1.0)):
    from mathutils import Vector

    return Vector(way)


def _hit(body, eye, ahead, near):
    """Whether a ray from the eye along the gaze meets the body beyond the camera's near plane."""
    back = body.matrix_world.inverted()
    return body.ray_cast(back @ (eye + ahead * near), back.to_3x3() @ ahead)[0]


def test_a_gaze_turns_to_the_ball_as_far_as_eyes_turn(room, walk):
    motion = walk(0.0, 0.0)
    middle = len(motion) // 2
    place, plain = room("stage.eyes", "scene").compute_eye_view(motion, None)
    ball = place + [3.0, 1.0, -1.5]
    _, turned = room("stage.eyes", "scene").compute_eye_view(motion, ball)
    quaternion = importlib.import_module(f"{EXTENSION}.beyond_mocap.motion.quaternion")
    gaze = quaternion.rotate(turned, np.array([0.0, 0.0, -1.0]))[middle]
    wanted = (ball - place)[middle] / np.linalg.norm((ball - place)[middle])
    assert gaze @ wanted > np.cos(np.radians(4.0))
    behind = place + [-5.0, 0.0, 0.0]
    _, same = room("stage.eyes", "scene").compute_eye_view(motion, behind)
    assert quaternion.rotate(same, np.array([0.0, 0.0, -1.0]))[middle, 0] > 0.9


def test_kits_tell_teams_and_keepers_apart(room):
    kits, person = room("kits"), room("load").Character
    for colours in ({}, {"home": "#F2C200", "away": "#1FA34A"}, {"home": "#FFFFFF", "away": "#101010"}):
        worn = [kits.choose_kit(person("", "", 1, team, keeper, ()), colours).shirt
                for team in ("home", "away") for keeper in (False, True)]
        for i, one in enumerate(worn):
            for other in worn[:i]:
                assert np.linalg.norm(np.sqrt(one) - np.sqrt(other)) > 0.2, colours
        for team in ("home", "away"):
            kit = kits.choose_kit(person("", "", 9, team, False, ()), colours)
            assert abs(kits.compute_luminance(kit.ink) - kits.compute_luminance(kit.shirt)) > 0.2, (colours, team)
    for text in ("#C8102E", "#000000", "#FFFFFF", "#1D4ED8"):
        assert kits.to_hex(kits.to_linear(text)) == text
