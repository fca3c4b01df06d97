"""Characters in the file: the mesh bends as in the core, keeps its volume, and changes its look but not its kit."""

import importlib

import bpy
import numpy as np
import pytest
import synthetic_motion

pytestmark = pytest.mark.usefixtures("full_bodies")


@pytest.fixture
def character(extension, core):
    """A character on an armature that plays a known motion, and that motion."""
    rooms = {name: importlib.import_module(f"{extension.__name__}.scene.{name}")
             for name in ("rigs.armature", "core.action", "stage.body")}
    motion, scene = synthetic_motion.build_motion(core, 31, 30.0), bpy.context.scene
    scene.render.fps = 30
    rig = rooms["rigs.armature"].create_armature(bpy.context, motion.skeleton, "Somebody")
    rooms["core.action"].write_motion(rig, motion, scene, 1.0)
    body = rooms["stage.body"]
    return body.create_character(rig, "Somebody", (1, 0, 0), scene.collection, scene, motion), motion, body


def read_places(thing):
    """The vertices (V, 3) of an object as displayed."""
    shown = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh, flat = shown.to_mesh(), np.empty(3 * len(thing.data.vertices), np.float32)
    mesh.vertices.foreach_get("co", flat)
    shown.to_mesh_clear()
    matrix = np.array(thing.matrix_world)
    return flat.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def test_blender_bends_it_as_the_core_does(core, character):
    thing, motion, _ = character
    look = core("appearance.look").choose_look("Somebody")
    body = core("appearance.body").build_body(motion.skeleton, example=motion, look=look)
    places, world = core("motion.motion").forward_kinematics(motion)
    for frame in (0, 17, 30):
        bpy.context.scene.frame_set(1 + frame)
        expected = core("appearance.mesh").deform_body(body, motion.skeleton, places[frame], world[frame])
        assert np.abs(read_places(thing) - expected).max() < 0.002
    assert thing.modifiers["Armature"].use_deform_preserve_volume


def test_bones_do_not_stick_out_of_head_and_hands(character):
    thing, _, body = character
    shown = {bone.name for bone in thing.parent.pose.bones if bone.custom_shape == body.get_tip()}
    assert shown == {bone.name for bone in thing.parent.data.bones if not bone.children} != set()
    assert max(corner.co.y for corner in body.get_tip().data.vertices) < 0.6 and not body.get_tip().users_collection


def test_edges_between_parts_are_sharp_and_only_those(character):
    thing = character[0]
    sharp = np.empty(len(thing.data.edges), bool)
    thing.data.edges.foreach_get("use_edge_sharp", sharp)
    assert 0.005 < sharp.mean() < 0.15


def test_paint_follows_the_sculpted_athlete_and_keeps_plain_colours(core, character):
    """Exporters write the plain colours; the shader finds mouth, eyes and cloth by the mesh's attribute."""
    thing, motion, rooms = character
    look, stored = core("appearance.look").choose_look("Somebody"), thing.data.attributes["sculpted"].data
    places = np.empty(3 * len(stored), np.float32)
    stored.foreach_get("vector", places)
    body = core("appearance.body").build_body(motion.skeleton, example=motion, look=look)
    assert np.allclose(places.reshape(-1, 3), body.sculpted, atol=1e-6)
    for part, material in zip(core("appearance.mesh").MATERIALS, thing.data.materials):
        nodes = {node.type: node for node in material.node_tree.nodes}
        inputs = nodes["BSDF_PRINCIPLED"].inputs
        is_painted = any(inputs[name].is_linked for name in ("Base Color", "Normal"))
        assert is_painted == (part not in ("eyes", "soles")), part
        assert not is_painted or nodes["ATTRIBUTE"].attribute_name == "sculpted"
    skin = core("appearance.look").SKIN_TONES[look.skin]
    assert np.allclose(thing.data.materials[0].node_tree.nodes["Principled BSDF"].inputs[0].default_value[:3], skin)


def test_another_look_keeps_the_kit(core, character):
    thing, _, body = character
    kit, faces = thing.data.materials[1], len(thing.data.polygons)
    look = core("appearance.look").Look(hair="bald", skin=4, gloves=True)
    body.change_look(thing, bpy.context.scene, look, True)
    assert thing.data.materials[1] == kit and len(thing.data.polygons) < 0.4 * faces
    assert thing.material_slots[0].material.name == "Skin 5" and len(thing.vertex_groups) > 10
    assert np.ptp(read_places(thing)[:, 2]) > 1.2


def test_another_look_leaves_those_who_share_the_mesh_alone(core, character):
    """A team of a match shares one mesh, and with it the vertex groups."""
    thing, _, body = character
    other = thing.copy()
    bpy.context.scene.collection.objects.link(other)
    before = read_places(other)
    body.change_look(thing, bpy.context.scene, core("appearance.look").Look(hair="bald"), True)
    assert other.data != thing.data and len(thing.vertex_groups) == len(other.vertex_groups)
    np.testing.assert_array_equal(read_places(other), before)
