"""What is written is what was shown: every format is read back into an empty scene, joints within a millimetre."""

import importlib
import pathlib
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
import sample_rigs as rigs
from undo import collect_state

SAMPLE = pathlib.Path(__file__).resolve().parents[3] / "sample_blend" / "library"
START, FRAMES, RATE = 5, 40, 30
READERS = {
    ".fbx": lambda path: bpy.ops.import_scene.fbx(filepath=path, automatic_bone_orientation=False, anim_offset=0.0),
    ".glb": lambda path: bpy.ops.import_scene.gltf(filepath=path),
    ".usdc": lambda path: bpy.ops.wm.usd_import(filepath=path),
    ".bvh": lambda path: bpy.ops.import_anim.bvh(filepath=path, global_scale=0.01, update_scene_fps=False,
                                                 use_fps_scale=False),
}
SUFFIXES = {"FBX": ".fbx", "GLB": ".glb", "USD": ".usdc", "BVH": ".bvh"}


@pytest.fixture
def rooms(extension):
    return {name: importlib.import_module(f"{extension.__name__}.scene.{name}")
            for name in ("rigs.armature", "core.action", "core.channels", "rigs.bone_maps", "rigs.rig_bake",
                         "rigs.fit", "rigs.export", "rigs.exporters", "rigs.deliver")}


@pytest.fixture(scope="session")
def clip(core):
    """A recorded jog with a turn, FRAMES long."""
    found = core("files.bvh.bvh").read_bvh(SAMPLE / "jogging_turn_left.bvh").motion
    return core("motion.motion").resample(found, float(RATE)).frames(0, FRAMES)


@pytest.fixture
def body(rooms, clip):
    bpy.context.scene.render.fps = RATE
    made = rooms["rigs.armature"].create_armature(bpy.context, clip.skeleton, "Body")
    rooms["core.action"].write_motion(made, clip, bpy.context.scene, START)
    return made


def skin(rig):
    """A mesh that the rig moves."""
    mesh = bpy.data.meshes.new("Skin")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    thing = bpy.data.objects.new("Skin", mesh)
    bpy.context.scene.collection.objects.link(thing)
    thing.parent = rig
    thing.modifiers.new("Armature", "ARMATURE").object = rig
    thing.vertex_groups.new(name=rig.data.bones[0].name).add([0, 1, 2], 1.0, "REPLACE")
    return thing


def look(rig, frames, bones=None):
    """Bone -> places (F, 3) that Blender shows."""
    bones = bones or [bone.name for bone in rig.data.bones]
    places = rigs.read_heads(rig, bones, frames)
    return {bone: places[:, number] for number, bone in enumerate(bones)}


def read_back(path, count):
    """Bone -> places (F, 3) metres of the first `count` frames of a file, read into an empty scene."""
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.context.scene.render.fps = RATE
    READERS[path.suffix](str(path))
    found = [thing for thing in bpy.context.scene.objects if thing.type == "ARMATURE"]
    assert len(found) == 1, [thing.name for thing in bpy.context.scene.objects]
    data = found[0].animation_data  # the glTF importer leaves a muted strip beside the action, or only a strip
    action = data.action or next(strip.action for track in data.nla_tracks for strip in track.strips)
    if data.action is None:
        data.action, data.action_slot = action, action.slots[0]
    start = round(action.frame_range[0])
    assert round(action.frame_range[1]) - start == count - 1, tuple(action.frame_range)
    return look(found[0], range(start, start + count))


def assert_same(found, shown, within=1e-3):
    """Every bone that the file has is where it was shown."""
    assert len(found) >= 15
    plain = {name.replace(":", "_").replace(".", "_"): places for name, places in shown.items()}
    for bone, places in found.items():
        expected = shown.get(bone, plain.get(bone.replace(":", "_").replace(".", "_")))
        if expected is not None:
            off = np.linalg.norm(places - expected, axis=-1).max()
            assert off < within, (bone, off)
    known = {bone.replace(":", "_").replace(".", "_") for bone in found}
    assert len(known & set(plain)) >= min(15, len(plain)), sorted(known)


def export(path, **options):
    return bpy.ops.beyond_mocap.export_motion("EXEC_DEFAULT", filepath=str(path), who="SELECTED", **options)


def select(*things):
    bpy.ops.object.select_all(action="DESELECT")
    for thing in things:
        thing.select_set(True)
    bpy.context.view_layer.objects.active = things[0]


FRAMES_SHOWN = range(START, START + FRAMES)


@pytest.mark.parametrize("format", SUFFIXES)
def test_a_body_goes_out_and_comes_back(body, tmp_path, format):
    skin(body)
    shown = look(body, FRAMES_SHOWN)
    select(body)
    bpy.ops.ed.undo_push(message="before")
    before = collect_state()
    assert export(tmp_path / f"out{SUFFIXES[format]}", format=format) == {"FINISHED"}
    assert collect_state() == before and len(bpy.data.scenes) == 1
    assert [path.name for path in tmp_path.iterdir()] == [f"out{SUFFIXES[format]}"]
    assert_same(read_back(tmp_path / f"out{SUFFIXES[format]}", FRAMES), shown)


@pytest.mark.parametrize("engine", ("UNREAL", "UNITY", "GODOT"))
@pytest.mark.parametrize("format", ("FBX", "GLB", "USD"))
def test_axes_of_engines_come_back_too(rooms, body, tmp_path, format, engine):
    rig = rigs.create_unreal()
    baked(rooms, rig, body)
    skin(rig)
    shown = look(rig, FRAMES_SHOWN)
    select(rig)
    path = tmp_path / f"out{SUFFIXES[format]}"
    assert export(path, format=format, engine=engine) == {"FINISHED"}
    assert_same(read_back(path, FRAMES), shown)


def baked(rooms, rig, body, **wishes):
    source = rooms["rigs.fit"].read_source(body, bpy.context.scene)
    table = rooms["rigs.bone_maps"].find_bone_map(rig)
    options = rooms["rigs.fit"].BakeOptions(**wishes)
    return rooms["rigs.rig_bake"].apply_bake(rooms["rigs.rig_bake"].prepare_bake(rig, table, source, bpy.context.scene,
                                                                                 options))


@pytest.mark.parametrize("format", SUFFIXES)
def test_nla_and_constraints_are_baked_first(rooms, body, tmp_path, format):
    rig = rigs.create_mixamo()
    baked(rooms, rig, body)
    skin(rig)
    data = rig.animation_data
    action, slot = data.action, data.action_slot
    data.action = None
    for number, (low, high) in enumerate(((5, 24), (25, 44))):  # several strips: exporters write the first alone
        strip = data.nla_tracks.new().strips.new(f"strip {number}", low, action)
        strip.action_slot, strip.extrapolation = slot, "NOTHING"
        strip.action_frame_start, strip.action_frame_end = low, high
    turned = rig.pose.bones["mixamorig:Head"].constraints.new("COPY_ROTATION")
    turned.target, turned.subtarget = rig, "mixamorig:Hips"
    shown = look(rig, FRAMES_SHOWN)
    select(rig)
    path = tmp_path / f"out{SUFFIXES[format]}"
    assert export(path, format=format) == {"FINISHED"}
    assert_same(read_back(path, FRAMES), shown)


@pytest.mark.parametrize("format", ("FBX", "GLB", "USD"))
@pytest.mark.parametrize("way", ("SMOOTH", "STRAIGHT"))
def test_a_root_bone_is_added_to_the_copy(rooms, body, tmp_path, format, way):
    rig = rigs.create_mixamo()
    baked(rooms, rig, body)
    skin(rig)
    shown = look(rig, FRAMES_SHOWN)
    select(rig)
    path = tmp_path / f"out{SUFFIXES[format]}"
    assert export(path, format=format, root=way) == {"FINISHED"}
    assert "root" not in rig.data.bones
    found = read_back(path, FRAMES)
    assert_same(found, shown)
    assert np.abs(found["root"][:, 2]).max() < 1e-3 and np.linalg.norm(found["root"][-1] - found["root"][0]) > 1.5


def test_in_place_stays(rooms, body, tmp_path):
    rig = rigs.create_unreal()
    skin(rig)
    baked(rooms, rig, body)
    select(rig)
    assert export(tmp_path / "out.glb", format="GLB", root="IN_PLACE") == {"FINISHED"}
    found = read_back(tmp_path / "out.glb", FRAMES)
    assert np.ptp(found["pelvis"][:, :2], axis=0).max() < 0.3


def test_another_rate(rooms, body, tmp_path):
    skin(body)
    bpy.context.scene.render.fps, bpy.context.scene.render.fps_base = 24, 1.001
    rooms["rigs.export"].export_motion(bpy.context, [body], rooms["rigs.export"].ExportOptions(tmp_path / "out.glb",
            "GLB", rate=30.0))
    seconds = (FRAMES - 1) / (24 / 1.001)
    found = read_back(tmp_path / "out.glb", int(np.floor(seconds * 30 + 1e-6)) + 1)
    assert len(found) >= 15


def test_a_control_rig_goes_out_with_its_deform_bones(rooms, body, tmp_path):
    rig = rigs.create_rig(rigs.MIXAMO, "Controls",
                          extra=[("control", None, "head"), ("helper", "mixamorig:Head", "head")])
    for name in ("control", "helper"):
        rig.data.bones[name].use_deform = False
    baked(rooms, rig, body)
    shown = look(rig, FRAMES_SHOWN)
    select(rig)
    assert export(tmp_path / "out.fbx", format="FBX") == {"FINISHED"}
    found = read_back(tmp_path / "out.fbx", FRAMES)
    assert "control" not in found and "helper" not in found
    assert_same(found, shown)


def test_several_at_once(rooms, body, tmp_path):
    other = rigs.create_mixamo()
    baked(rooms, other, body)
    select(body, other)
    assert export(tmp_path / "out.fbx", format="FBX") == {"FINISHED"}
    bpy.ops.wm.read_homefile(use_empty=True)
    READERS[".fbx"](str(tmp_path / "out.fbx"))
    assert sorted(o.name for o in bpy.data.objects if o.type == "ARMATURE") == ["Body", "Mixamo"]


def test_players_that_an_export_leaves_out_are_reported(body, tmp_path, capfd):
    settings, bodies = bpy.context.scene.beyond_mocap, [body, body.copy()]
    bpy.context.scene.collection.objects.link(bodies[1])
    for name, one in zip(("first", "second"), bodies):
        player = settings.players.add()
        player.name, player.body = name, one
    select(body)
    options = {"filepath": str(tmp_path / "out.fbx"), "meshes": False}
    for who, said in (("ACTIVE", "out.fbx with Body; without second"), ("PLAYERS", "with Body, Body.001")):
        assert bpy.ops.beyond_mocap.export_motion("EXEC_DEFAULT", who=who, **options) == {"FINISHED"}
        assert capfd.readouterr().out.strip().splitlines()[-1].endswith(said)
    bpy.ops.beyond_mocap.export_bvh(filepath=str(tmp_path / "out.bvh"))
    assert "frames of Body written to" in (line := capfd.readouterr().out) and line.strip().endswith("; without second")


def test_the_file_browser_shows_the_name_that_is_written(rooms, extension):
    operator = importlib.import_module(f"{extension.__name__}.operators.rigs").BEYOND_MOCAP_OT_export_motion
    for name, format, written in (("walk", "FBX", "walk.fbx"), ("walk.glb", "FBX", "walk.fbx"),
                                  ("a.v2", "GLB", "a.v2.glb")):
        asked = SimpleNamespace(filepath=f"/here/{name}", format=format)
        assert operator.check(asked, None) and asked.filepath == f"/here/{written}"
        assert not operator.check(asked, None)


@pytest.mark.parametrize("format", ("FBX", "BVH"))
def test_the_root_of_the_recordings_is_added_where_it_is_asked_for(extension, core, body, clip, tmp_path, format):
    bvh, form = core("files.bvh.bvh"), core("files.bvh.bvh_write")
    root = form.JointAboveHips(name="World", channels=(), is_moving=False, position=np.array([0.0, 0.5, 0.0]),
                               rotation=np.array([1.0, 0.0, 0.0, 0.0]))
    folder = tmp_path / "library"
    folder.mkdir()
    bvh.write_bvh(folder / "jog.bvh", clip, form.BvhForm(above=(root,)))
    (folder / "jog.txt").write_text("0 1 jogging\n")
    bpy.context.scene.beyond_mocap.library_folder = str(folder)
    shown, out = look(body, FRAMES_SHOWN), tmp_path / f"out{SUFFIXES[format]}"
    select(body)
    with pytest.raises(RuntimeError, match="no library is built"):
        export(out, format=format, keep_root=True)
    assert bpy.ops.beyond_mocap.build_library() == {"FINISHED"}
    select(body)
    before = collect_state()
    assert export(out, format=format, keep_root=True) == {"FINISHED"}
    assert collect_state() == before and len(bpy.data.scenes) == 1
    foreign = importlib.import_module(f"{extension.__name__}.scene.library.foreign")
    above = (bvh.read_bvh(out) if format == "BVH" else foreign.read_takes(out)[0]).form.above
    assert [joint.name for joint in above] == ["World"] and np.allclose(above[0].position, root.position, atol=1e-4)
    if format == "FBX":
        assert_same(read_back(out, FRAMES), shown)


def test_bad_places_and_choices_are_told(rooms, body, tmp_path, core, monkeypatch):
    select(body)

    def complaint(**options):
        before = collect_state()
        with pytest.raises(RuntimeError) as error:
            export(**options)
        assert collect_state() == before and len(bpy.data.scenes) == 1
        assert "Traceback" not in str(error.value)
        return str(error.value)

    assert "export: no file given; expected a file to write; choose a file" in complaint(path="", format="FBX")
    assert "cannot be written" in complaint(path=tmp_path / "nowhere" / "out.fbx", format="FBX")
    still = rigs.create_mixamo()
    select(still)
    assert "does not move" in complaint(path=tmp_path / "out.fbx", format="FBX")
    bpy.ops.object.select_all(action="DESELECT")
    monkeypatch.setitem(rooms["rigs.exporters"]._OPERATORS, "USD", ("wm", "no_such_exporter"))
    with pytest.raises(core("base.errors").InputError, match="no USD exporter"):
        rooms["rigs.exporters"].check_exporter("USD")


@pytest.mark.parametrize("suffix", (".fbx", ".glb", ".usdc"))
def test_what_the_command_delivers_comes_back(rooms, core, clip, tmp_path, suffix):
    import types

    take = types.SimpleNamespace(motion=clip, ball=None, start_time=0.0)
    rooms["rigs.deliver"].write_result(take, tmp_path / f"out{suffix}")
    places, _ = core("motion.motion").forward_kinematics(clip)
    shown = {name: places[:, number] for number, name in enumerate(clip.skeleton.names)}
    assert_same(read_back(tmp_path / f"out{suffix}", FRAMES), shown)
