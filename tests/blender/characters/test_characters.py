"""Characters of the file as bodies: feet on the take's spots, skin at the ball, kits by material, and what users get
wrong."""

import importlib
import os
import pathlib
import subprocess
import sys

import bpy
import numpy as np
import pytest
import sample_characters as characters
import sample_rigs as rigs
from conftest import EXTENSION

SAMPLE = pathlib.Path(__file__).resolve().parents[3] / "sample_blend" / "library"
FAMILIES = {
    "mixamo": rigs.create_mixamo,
    "mixamo 1.6 m": lambda: rigs.create_mixamo(size=1.6 / 1.75),
    "mixamo 2.0 m": lambda: rigs.create_mixamo(size=2.0 / 1.75),
    "unreal": rigs.create_unreal,
    "metahuman": rigs.create_metahuman,
    "nameless": lambda: rigs.create_rig(rigs.NAMELESS, "Own", arms=0.6, rolls=0.7),
}


@pytest.fixture
def room():
    return lambda name: importlib.import_module(f"{EXTENSION}.scene.{name}")


@pytest.fixture(scope="session")
def clip(core):
    """Three seconds of a recorded run-up with a kick."""
    found = core("files.bvh.bvh").read_bvh(SAMPLE / "kick_low_inside.bvh").motion
    return core("motion.motion").resample(found, 30.0).frames(0, 90)


def read_source(room, core, clip):
    contacts = core("motion.contacts").detect_contacts(clip)
    return room("rigs.fit").SourceMotion(clip, 1, "kick", contacts)


def create_touch(room, core, clip):
    """A ball that the built-in body's right foot touches for two frames."""
    surface = core("annotation.striking").build_part_surfaces(clip.skeleton, "foot", ("right",))[0]
    places, world = core("motion.motion").forward_kinematics(clip)
    fastest = int(np.argmax(np.linalg.norm(np.diff(places[:, surface.end[0]], axis=0), axis=1)))
    frames = np.array([fastest, fastest + 1])
    line = surface.compute_line(places[frames], world[frames])
    along = (line[1] - line[0]) * [1.0, 1.0, 0.0]
    aside = np.cross([0.0, 0.0, 1.0], along / np.linalg.norm(along, axis=1, keepdims=True))  # the inside of the foot
    radius = core("motion.track").BALL_RADIUS
    ball = 0.5 * (line[0] + line[1]) + (surface.radius + radius) * aside
    gap = core("annotation.striking").measure_ball_gap(line, surface.radius, ball)
    return room("characters.ball_touches").BallTouch("foot", "right", frames, ball, gap + radius)


def create_character_rig(room, rig):
    """A copy of a character, analysed."""
    if not room("characters.copies").list_meshes(rig):
        characters.add_mesh(rig, EXTENSION)
    bpy.context.view_layer.update()
    things = room("characters.copies").create_copy(rig, "Copy", bpy.context.scene.collection)
    bpy.context.view_layer.update()
    return room("characters.character_rig").CharacterRig(things[0], things[1:], bpy.context.scene)


def read_vertices(mesh, frame):
    """The vertices of a mesh in the world at a frame, as Blender shows them."""
    bpy.context.scene.frame_set(frame)
    evaluated = mesh.evaluated_get(bpy.context.evaluated_depsgraph_get())
    data, matrix = evaluated.to_mesh(), np.array(evaluated.matrix_world)
    points = np.empty(3 * len(data.vertices))
    data.vertices.foreach_get("co", points)
    evaluated.to_mesh_clear()
    return points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


@pytest.mark.parametrize("family", FAMILIES)
def test_feet_stand_on_the_takes_spots_and_skin_meets_the_ball(room, core, clip, family):
    bpy.context.scene.render.fps = 30
    rig = create_character_rig(room, FAMILIES[family]())
    source, touch = read_source(room, core, clip), create_touch(room, core, clip)
    frames, curves, motion = rig.build_keys(source, (touch,))
    identify, forward = core("motion.humanoid").identify_joints, core("motion.motion").forward_kinematics
    on_ground = core("motion.contacts").detect_heel_toe_contacts(clip) | source.foot_contacts[:, :, None]
    (theirs, _), (ours, world) = forward(clip), forward(motion)
    points = core("motion.retargeting.body_points")
    for side, name in enumerate(("left", "right")):
        a, b = getattr(identify(clip.skeleton), name), getattr(identify(motion.skeleton), name)
        toes = on_ground[:, side, 1]
        away = np.linalg.norm((ours[:, b.toe] - theirs[:, a.toe])[:, :2], axis=1)
        assert away[toes].mean() < 1e-3 and np.percentile(away[toes], 90) < 2e-3, (name, away[toes].max())
        soles = points.measure_sole_heights(rig._select_soles(name, {}), ours, world)
        assert soles.min() > -2e-3 and np.median(soles[source.foot_contacts[:, side]]) < 3e-3
    # what Blender shows: nothing below the grass, and the boot at the ball
    room("core.channels").create_action(rig.driven.rig, "Kick", frames, curves)
    mesh = room("characters.copies").list_meshes(rig.driven.rig)[0]
    for number, frame in enumerate(touch.frames):
        vertices = read_vertices(mesh, 1 + int(frame))
        boots = [index for face in mesh.data.polygons if face.material_index == 4 for index in face.vertices]
        gap = np.linalg.norm(vertices[boots] - touch.ball[number], axis=1).min() - touch.distance[number]
        assert -1e-3 < gap < 4e-3, gap  # vertices are some millimetres apart, the skin between them is nearer
    lowest = min(read_vertices(mesh, frame)[:, 2].min() for frame in range(5, 90, 12))
    assert lowest > -4e-3


def test_a_control_rig_keeps_its_constraints(room, core, clip, tmp_path):
    """Rigify's deform bones follow controls: the copy is moved by its controls, with its own twist and bendy bones."""
    out = tmp_path / "rig.blend"
    script = pathlib.Path(__file__).parents[1] / "rigify_rig.py"
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(tmp_path)}
    subprocess.run([sys.executable, "-P", script, out], env=environment, capture_output=True, check=False)
    bpy.context.scene.render.fps = 30
    rig = create_character_rig(room, rigs.append_rigify(out))
    body = rig.driven.rig
    rig.set_switches(body)
    frames, curves, motion = rig.build_keys(read_source(room, core, clip))
    room("core.channels").create_action(body, "Kick", frames, curves)
    heads = core("motion.motion").forward_kinematics(motion)[0]
    for part in ("left foot", "right hand", "head"):
        shown = rigs.read_heads(body, [rig.driven.find_bone(part)], (1, 40, 80))[:, 0]
        assert np.abs(shown - heads[[0, 39, 79], rig.driven.parts.index(part)]).max() < 1e-3


def test_twist_bones_share_the_roll(room, core, clip):
    rig = rigs.create_unreal()
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    bones = rig.data.edit_bones
    twist = bones["lowerarm_twist_01_l"]
    twist.head = 0.5 * (bones["lowerarm_l"].head + bones["hand_l"].head)
    twist.tail = twist.head + bones["hand_l"].head - bones["lowerarm_l"].head
    bpy.ops.object.mode_set(mode="OBJECT")
    found = create_character_rig(room, rig)
    shares = {one.bone: one.share for one in found.twist_bones}
    assert shares["lowerarm_twist_01_l"] == pytest.approx(0.5, abs=0.02)
    assert set(shares) >= {"upperarm_twist_01_l", "thigh_twist_01_r", "calf_twist_01_r"}
    _, curves, motion = found.build_keys(read_source(room, core, clip))
    roll = core("motion.retargeting.twist_bones").measure_roll
    one = next(one for one in found.twist_bones if one.bone == "lowerarm_twist_01_l")
    hand = roll(motion.rotations[:, one.joint], one.axis)
    path = 'pose.bones["lowerarm_twist_01_l"].rotation_quaternion'
    turned = core("motion.quaternion").rotate(core("motion.quaternion").inverse(one.rest), one.axis)
    np.testing.assert_allclose(roll(curves[path][1], turned), one.share * hand, atol=1e-4)


def start_player(room, core, clip):
    """A player whose built-in body plays the clip."""
    scene = bpy.context.scene
    scene.render.fps = 30
    player = scene.beyond_mocap.players.add()
    player.name = "Ada"
    body = room("rigs.armature").create_armature(bpy.context, clip.skeleton, "Ada")
    room("core.action").write_motion(body, clip, scene, 1)
    room("stage.body").create_character(body, "Ada", (0.5, 0, 0), collection=scene.collection, scene=scene,
                                        example=clip)
    player.body = body
    return player


def test_a_player_gets_a_character_and_the_built_in_body_again(room, core, clip):
    player = start_player(room, core, clip)
    rig = rigs.create_mixamo()
    mesh = characters.add_mesh(rig, EXTENSION)
    player.character = rig
    copy = player.character_body
    assert player.character_note == "" and copy.data == rig.data and copy != rig
    worn = room("characters.copies").list_meshes(copy)[0]
    assert worn.data == mesh.data and worn.modifiers[0].object == copy
    assert rig.hide_render and mesh.hide_render and not worn.hide_render
    assert all(one.hide_render for one in player.body.children)
    player.shirt = (0.1, 0.2, 0.9)
    jersey = next(slot.material for slot in worn.material_slots if slot.material.name.startswith("Jersey"))
    shader = next(node for node in jersey.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    np.testing.assert_allclose(shader.inputs["Base Color"].default_value[:3], (0.1, 0.2, 0.9), atol=1e-6)
    assert mesh.data.materials[1].name == "Jersey" and mesh.material_slots[1].material == mesh.data.materials[1]
    other = rigs.create_unreal()
    characters.add_mesh(other, EXTENSION)
    player.character = other
    assert player.character_body.data == other.data and not rig.hide_render and other.hide_render
    player.character = None
    assert player.character_body is None and not other.hide_render
    assert not any(one.hide_render for one in player.body.children)
    assert not [thing for thing in bpy.data.objects if "beyond_mocap_copy_of" in thing]


def test_a_textured_shirt_keeps_its_light_and_dark(room, core, clip):
    player = start_player(room, core, clip)
    rig = rigs.create_mixamo()
    mesh = characters.add_mesh(rig, EXTENSION)
    tree = mesh.data.materials[1].node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    tree.links.new(texture.outputs["Color"], tree.nodes["Principled BSDF"].inputs["Base Color"])
    player.character = rig
    player.shirt = (0.0, 0.5, 0.0)
    worn = room("characters.copies").list_meshes(player.character_body)[0].material_slots[1].material
    tints = [node for node in worn.node_tree.nodes if node.type == "MIX"]
    assert len(tints) == 1 and tints[0].blend_type == "MULTIPLY"
    assert tuple(tints[0].inputs[7].default_value)[:3] == (0.0, 0.5, 0.0)
    assert not [node for node in tree.nodes if node.type == "MIX"]


def lose_meshes(rig, mesh):
    bpy.data.objects.remove(mesh)


def mirror(rig, mesh):
    rig.scale.x *= -1


def stretch(rig, mesh):
    rig.scale.z *= 2


def lose_legs(rig, mesh):
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    for bone in list(rig.data.edit_bones):
        if "Leg" in bone.name or "Foot" in bone.name or "Toe" in bone.name:
            rig.data.edit_bones.remove(bone)
    bpy.ops.object.mode_set(mode="OBJECT")


def edit(rig, mesh):
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")


def rest(rig, mesh):
    rig.data.pose_position = "REST"


def give_to_another_player(rig, mesh):
    bpy.context.scene.beyond_mocap.players.add().rig = rig


@pytest.mark.parametrize("wrong, words", [(lose_meshes, "no mesh"), (mirror, "scale"), (stretch, "scale"),
                                          (lose_legs, "legs"), (edit, "being edited"), (rest, "rest position"),
                                          (give_to_another_player, "shows the motion")])
def test_a_character_that_cannot_be_a_body_is_told_in_one_line(room, core, clip, wrong, words):
    player = start_player(room, core, clip)
    rig = rigs.create_mixamo()
    wrong(rig, characters.add_mesh(rig, EXTENSION))
    bpy.context.view_layer.update()
    before = len(bpy.data.objects)
    player.character = rig
    assert words in player.character_note and "\n" not in player.character_note
    assert player.character_body is None and len(bpy.data.objects) == before
    assert not any(one.hide_render for one in player.body.children)


def add_bones(rig, mesh):
    """As faces and cloth have them: three hundred bones."""
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    head = rig.data.edit_bones["mixamorig:Head"]
    for number in range(280):
        bone = rig.data.edit_bones.new(f"face_{number}")
        bone.head, bone.tail, bone.parent = head.head, head.tail, head
    bpy.ops.object.mode_set(mode="OBJECT")


def lose_fingers(rig, mesh):
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    for bone in [bone for bone in rig.data.edit_bones if "HandMiddle" in bone.name]:
        rig.data.edit_bones.remove(bone)
    bpy.ops.object.mode_set(mode="OBJECT")


def turn(rig, mesh):
    rig.rotation_euler.z, rig.location = 1.0, (4.0, 5.0, 6.0)


def add_a_twin(rig, mesh):
    characters.add_mesh(rigs.create_mixamo(), EXTENSION, name="Twin")


def hold_elsewhere(rig, mesh):
    """A constraint holds the hips at the origin while the bones rest a metre above it."""
    target = bpy.data.objects.new("Target", None)
    bpy.context.scene.collection.objects.link(target)
    rig.pose.bones["mixamorig:Hips"].constraints.new("COPY_LOCATION").target = target


def flip_bones(rig, mesh):
    """Bones that point the other way, rolled, as some exporters leave them."""
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    for bone in rig.data.edit_bones:
        bone.use_connect, bone.tail = False, 2.0 * bone.head - bone.tail
        bone.roll += 3.0
    bpy.ops.object.mode_set(mode="OBJECT")


@pytest.mark.parametrize("unusual", [add_bones, lose_fingers, turn, add_a_twin, hold_elsewhere, flip_bones])
def test_unusual_characters_work(room, core, clip, unusual):
    player = start_player(room, core, clip)
    rig = rigs.create_mixamo()
    unusual(rig, characters.add_mesh(rig, EXTENSION))
    bpy.context.view_layer.update()
    player.character = rig
    assert player.character_note == ""
    copy = player.character_body
    assert len(room("characters.copies").list_meshes(copy)) == 1
    body = room("rigs.bone_maps").find_bone_map(player.body)
    table = room("rigs.bone_maps").find_bone_map(copy)
    for part in ("left toe", "right toe"):
        shown = [rigs.read_heads(one, [names[part]], (20, 50))[:, 0]
                 for one, names in ((copy, table), (player.body, body))]
        assert np.abs(shown[0] - shown[1]).max() < 0.08


def test_a_mesh_without_vertex_groups_is_named(room, core, clip):
    player = start_player(room, core, clip)
    rig = rigs.create_mixamo()
    characters.add_mesh(rig, EXTENSION)
    loose = bpy.data.objects.new("Hat", bpy.data.meshes.new("Hat"))
    bpy.context.scene.collection.objects.link(loose)
    loose.modifiers.new("Armature", "ARMATURE").object = rig
    player.character = rig
    assert player.character_note.startswith("Hat:") and player.character_body is not None


def test_what_copies_do_not_have_is_named(room, core, clip):
    player = start_player(room, core, clip)
    rig = rigs.create_mixamo()
    mesh = characters.add_mesh(rig, EXTENSION)
    rig.pose.bones["mixamorig:Head"].scale = (2.0, 2.0, 2.0)
    mesh.shape_key_add(name="Basis")
    mesh.shape_key_add(name="Fist").driver_add("value")
    player.character = rig
    head, shapes = player.character_note.splitlines()
    assert head.startswith("mixamorig:Head: scaled") and shapes.startswith("Mesh: its shape keys")


def test_a_thing_on_a_socket_follows_its_bone(room, core, clip):
    """An Empty on the head carries a hat, as game engines have it: both are copied."""
    player = start_player(room, core, clip)
    rig = rigs.create_mixamo()
    characters.add_mesh(rig, EXTENSION)
    socket = bpy.data.objects.new("Socket", None)
    hat = bpy.data.objects.new("Hat", bpy.data.meshes.new("Hat"))
    for thing, parent in ((socket, rig), (hat, socket)):
        bpy.context.scene.collection.objects.link(thing)
        thing.parent = parent
    socket.parent_type, socket.parent_bone = "BONE", "mixamorig:Head"
    player.character = rig
    worn = next(one for one in room("characters.copies").list_meshes(player.character_body) if one.data == hat.data)
    for frame in (20, 50):
        bpy.context.scene.frame_set(frame)
        head = player.character_body.matrix_world @ player.character_body.pose.bones["mixamorig:Head"].tail
        assert (worn.matrix_world.translation - head).length < 1e-3
    player.character = None
    assert not [thing for thing in bpy.data.objects if "beyond_mocap_copy_of" in thing]


def test_a_deleted_character_leaves_its_copies(room, core, clip):
    player = start_player(room, core, clip)
    rig = rigs.create_mixamo()
    mesh = characters.add_mesh(rig, EXTENSION)
    player.character = rig
    copy = player.character_body
    bpy.data.batch_remove([rig, mesh])
    assert player.character is None and copy.name in bpy.context.scene.objects
    room("characters.player_character").update_character(player, bpy.context)
    assert player.character_body is None and not any(one.hide_render for one in player.body.children)


def test_a_linked_character_works(room, core, clip, tmp_path):
    rig = rigs.create_mixamo()
    characters.add_mesh(rig, EXTENSION)
    path = str(tmp_path / "character.blend")
    bpy.data.libraries.write(path, {rig, *rig.children})
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (theirs, mine):
        mine.objects = theirs.objects
    for thing in mine.objects:
        bpy.context.scene.collection.objects.link(thing)
    bpy.context.view_layer.update()
    player = start_player(room, core, clip)
    player.character = next(thing for thing in mine.objects if thing.type == "ARMATURE")
    assert player.character_note == "" and player.character_body.library is None
    assert player.character_body.data.library is not None
    player.shirt = (0.0, 0.0, 1.0)
    worn = room("characters.copies").list_meshes(player.character_body)[0]
    assert worn.material_slots[1].link == "OBJECT"


def test_a_character_is_found_again_in_a_saved_file(room, core, clip, tmp_path):
    """Hidden objects have no placement in a file that was just opened: the copies keep the character's size."""
    player = start_player(room, core, clip)
    rig = rigs.create_mixamo()
    characters.add_mesh(rig, EXTENSION)
    player.character = rig
    path = str(tmp_path / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    player = bpy.context.scene.beyond_mocap.players[0]
    assert player.character_body is not None
    assert bpy.ops.beyond_mocap.update_character() == {"FINISHED"}
    np.testing.assert_allclose(player.character_body.matrix_world.to_scale(), (0.01,) * 3, rtol=1e-5)
    second = bpy.context.scene.beyond_mocap.players.add()
    second.name, second.body = "Eva", player.body
    second.character = player.character
    np.testing.assert_allclose(second.character_body.matrix_world.to_scale(), (0.01,) * 3, rtol=1e-5)


def test_a_copy_that_was_deleted_in_a_view_is_made_again(room, core, clip):
    player = start_player(room, core, clip)
    rig = rigs.create_mixamo()
    characters.add_mesh(rig, EXTENSION)
    player.character = rig
    copy = player.character_body
    for thing in (copy, *copy.children):  # as Blender's Delete does; the player's pointer keeps the object in the file
        for collection in list(thing.users_collection):
            collection.objects.unlink(thing)
    bpy.context.scene.beyond_mocap.active_player = 0
    assert bpy.ops.beyond_mocap.update_character() == {"FINISHED"}
    assert player.character_body.name in bpy.context.scene.objects and rig.hide_render
    player.character = None
    assert not rig.hide_render
