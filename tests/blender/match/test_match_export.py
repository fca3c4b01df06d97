"""A match that is shown is written whole: every file is read back into an empty scene, joints within a millimetre."""

import bpy
import numpy as np
import pytest
from test_match_scene import FPS, START, room, scenery, shown, walk  # noqa: F401  (fixtures)

READERS = {
    ".fbx": lambda path: bpy.ops.import_scene.fbx(filepath=path, automatic_bone_orientation=False, anim_offset=0.0),
    ".glb": lambda path: bpy.ops.import_scene.gltf(filepath=path),
    ".usdc": lambda path: bpy.ops.wm.usd_import(filepath=path),
}
FORMATS = {"FBX": ".fbx", "GLB": ".glb", "USD": ".usdc"}
LAST = 5.5  # seconds of the match that are written: the latest player's end


def places_of(scene, bone):
    """Name -> (F, 3) of a bone of every armature and of the ball, over the match's frames."""
    armatures = [one for one in scene.objects if one.type == "ARMATURE"]
    ball = next(one for one in scene.objects if one.type != "CURVE" and plain(one).startswith("Match ball"))
    found = {name: [] for name in ("ball", *map(plain, armatures))}
    for frame in range(scene.frame_start, scene.frame_start + round(LAST * FPS) + 1):
        scene.frame_set(frame)
        found["ball"].append(np.array(ball.matrix_world.translation))
        for thing in armatures:
            found[plain(thing)].append(np.array((thing.matrix_world @ thing.pose.bones[bone].matrix).translation))
    return {name: np.array(places) for name, places in found.items()}


def plain(thing):
    """Its name as Blender had it: USD knows no spaces, and the importer adds numbers."""
    return thing.name.replace("_", " ").split(".")[0]


@pytest.mark.parametrize("format", FORMATS)
def test_everybody_goes_out_and_comes_back(room, scenery, tmp_path, format):  # noqa: F811
    scene = shown(room, scenery, first=1)
    bone = scenery.characters[0].motions[0][1].skeleton.names[3]
    before = places_of(scene, bone)
    names = {thing.name for thing in scene.objects}
    path = tmp_path / f"match{FORMATS[format]}"
    assert bpy.ops.beyond_mocap.match_export(filepath=str(path), format=format) == {"FINISHED"}
    assert {thing.name for thing in scene.objects} == names and len(bpy.data.scenes) == 1
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps = FPS
    READERS[path.suffix](str(path))
    for thing in scene.objects:  # the glTF importer may leave a muted strip only
        data = thing.animation_data
        if data is not None and data.action is None and data.nla_tracks:
            data.action = data.nla_tracks[0].strips[0].action
            data.action_slot = data.action.slots[0]
    starts = [thing.animation_data.action.frame_range[0] for thing in scene.objects
              if thing.type == "ARMATURE" and thing.animation_data and thing.animation_data.action]
    scene.frame_start = round(min(starts))
    after = places_of(scene, bone)
    assert set(after) == set(before)
    for name, expected in before.items():
        assert np.abs(after[name] - expected).max() < 1e-3, name
    worn = [thing for thing in scene.objects if any(one.type == "ARMATURE" for one in thing.modifiers)]
    assert len(worn) == 7  # four bodies, three numbers
    assert any("goal" in thing.name.lower() for thing in scene.objects)
    assert format == "USD" or {thing.name for thing in worn} <= names  # without numbers behind them


def test_a_root_bone_carries_everybody(room, scenery, tmp_path):  # noqa: F811
    shown(room, scenery, first=1)
    path = tmp_path / "match.fbx"
    bpy.ops.beyond_mocap.match_export(filepath=str(path), format="FBX", root="SMOOTH", pitch=False)
    bpy.ops.wm.read_homefile(use_empty=True)
    READERS[".fbx"](str(path))
    bodies = [thing for thing in bpy.context.scene.objects if thing.type == "ARMATURE"]
    assert len(bodies) == 4 and all("root" in thing.data.bones for thing in bodies)
    assert not any("goal" in thing.name.lower() for thing in bpy.context.scene.objects)


def test_who_is_excluded_is_left_out_and_that_is_told(room, scenery, tmp_path):  # noqa: F811
    scene = shown(room, scenery, first=1)
    layers = bpy.context.view_layer.layer_collection.children["Match"].children
    next(layer for layer in layers if layer.name == "Match Home").exclude = True
    path = tmp_path / "match.fbx"
    bpy.ops.beyond_mocap.match_export(filepath=str(path), format="FBX", pitch=False)
    assert len(room("match_objects").find_armatures(scene)) == 4
    bpy.ops.wm.read_homefile(use_empty=True)
    READERS[".fbx"](str(path))
    assert len([thing for thing in bpy.context.scene.objects if thing.type == "ARMATURE"]) == 2


def test_without_a_match_nothing_is_written(tmp_path):
    with pytest.raises(RuntimeError, match="Show a match first|poll"):
        bpy.ops.beyond_mocap.match_export(filepath=str(tmp_path / "match.fbx"))
    assert not list(tmp_path.iterdir())
