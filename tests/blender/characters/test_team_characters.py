"""Characters of the file as the bodies of a match's teams: shared data, kits, keys, swaps."""

import importlib
from dataclasses import replace

import bpy
import numpy as np
import pytest
import sample_characters as characters
import sample_rigs as rigs
from conftest import EXTENSION

FPS = 30


@pytest.fixture
def room():
    return lambda name: importlib.import_module(f"{EXTENSION}.scene.{name}")


@pytest.fixture
def section(room, core):
    """A keeper and two players, of whom one comes a second late, and a referee."""
    walk, load = core("synthetic.gait").build_gait(1.4, 3.0, FPS), room("match.load")

    def place(y):
        return replace(walk, root_positions=walk.root_positions + [0.0, y, 0.0])

    people = (load.Character("h1", "Ada", 1, "home", True, ((0.0, place(0.0)),)),
              load.Character("h9", "Dan", 9, "home", False, ((0.0, place(3.0)),)),
              load.Character("a7", "Eva", 7, "away", False, ((1.0, place(6.0)),)),
              load.Character("r", "", -1, "referee", False, ((0.0, place(9.0)),)))
    return load.MatchSection(0.0, 5.0, 100.0, 64.0, {"home": "#FF0000", "away": "#0000FF"}, people, None)


@pytest.fixture
def match(room, section):
    """The settings of a scene that shows the section."""
    scene = bpy.context.scene
    scene.render.fps = FPS
    room("match.show").show_match(bpy.context, section, 1)
    scene.beyond_mocap_match.shown = "match"
    return scene.beyond_mocap_match


def find_bodies(room):
    found = room("match.match_objects").find_armatures(bpy.context.scene)
    return {body[room("match.match_objects").PLAYER_PROPERTY]: body for body in found}


def find_shirt(room, body):
    """The colour of the jersey."""
    mesh = room("characters.copies").list_meshes(body)[0]
    material = next(slot.material for slot in mesh.material_slots if slot.material.name.startswith("Jersey"))
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    return tuple(round(one, 2) for one in shader.inputs["Base Color"].default_value[:3])


def test_a_team_plays_in_a_character_and_swaps_it(room, core, section, match):
    mixamo, unreal = rigs.create_mixamo(), rigs.create_unreal()
    meshes = {rig: characters.add_mesh(rig, EXTENSION) for rig in (mixamo, unreal)}
    match.home_character = mixamo
    match.keeper_character = unreal
    bodies = find_bodies(room)
    assert match.character_note == "" and set(bodies) == {"h1", "h9", "a7", "r"}
    assert bodies["h9"].data == mixamo.data and bodies["h1"].data == unreal.data
    assert bodies["a7"].data not in (mixamo.data, unreal.data)
    worn = room("characters.copies").list_meshes(bodies["h9"])[0]
    assert worn.data == meshes[mixamo].data and mixamo.hide_render and unreal.hide_render
    match.away_character = mixamo
    bodies = find_bodies(room)
    assert find_shirt(room, bodies["h9"]) == (1.0, 0.0, 0.0) and find_shirt(room, bodies["a7"]) == (0.0, 0.0, 1.0)
    assert len({room("characters.copies").list_meshes(bodies[one])[0].data for one in ("h9", "a7")}) == 1
    match.away_colour = (0.0, 1.0, 0.0)
    assert find_shirt(room, bodies["a7"]) == (0.0, 1.0, 0.0)
    for frame, hidden in ((1, True), (30, True), (60, False)):  # who comes late is hidden until then
        bpy.context.scene.frame_set(frame)
        assert room("characters.copies").list_meshes(bodies["a7"])[0].hide_render == hidden
    table = room("rigs.bone_maps").find_bone_map(bodies["h9"])
    heads = core("motion.motion").forward_kinematics(section.characters[1].motions[0][1])[0]
    hips = rigs.read_heads(bodies["h9"], [table["hips"]], (31,))[0, 0]
    np.testing.assert_allclose(hips[:2], heads[30, 0, :2], atol=0.06)
    match.home_character = match.away_character = match.keeper_character = None
    assert not {mixamo.data, unreal.data}.intersection(body.data for body in find_bodies(room).values())
    assert not mixamo.hide_render and not meshes[mixamo].hide_render


def test_a_character_without_legs_is_told_and_the_team_plays_on(room, match):
    rig = rigs.create_rig({"hips": "Hips", "spine1": "Spine", "head": "Head"}, "Ghost")
    mesh = bpy.data.objects.new("Sheet", bpy.data.meshes.new("Sheet"))
    bpy.context.scene.collection.objects.link(mesh)
    mesh.parent = rig
    match.home_character = rig
    assert match.character_note and set(find_bodies(room)) == {"h1", "h9", "a7", "r"}
    assert all(body.data != rig.data for body in find_bodies(room).values())


def test_a_match_from_before_the_file_was_opened_says_what_to_press(room, match, tmp_path):
    path = str(tmp_path / "match.blend")
    rig = rigs.create_mixamo()
    characters.add_mesh(rig, EXTENSION)
    bpy.ops.wm.save_as_mainfile(filepath=path)
    room("core.session").clear_session()
    bpy.ops.wm.open_mainfile(filepath=path)
    settings = bpy.context.scene.beyond_mocap_match
    settings.home_character = bpy.data.objects["Mixamo"]
    assert "Show Match" in settings.character_note
