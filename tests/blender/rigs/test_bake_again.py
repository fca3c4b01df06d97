"""A bake is the same to the last bit whenever it is made: in the session of its take, over an earlier bake, and after
the file is opened again."""

import json
import pathlib
import subprocess
import sys

import bpy
import numpy as np
import pytest
import sample_rigs as rigs
from conftest import EXTENSION
from sample_rigs import read_all_keys
from test_players import match, ready, session  # noqa: F401  (fixtures)
from test_result import one  # noqa: F401  (fixture)
from test_rigs import body, choose, clip, rigify, rooms  # noqa: F401  (fixtures and a function)

BAKE_IN_ANOTHER_PROCESS = """
import json, os, sys
import bpy, addon_utils
addon_utils.enable({extension!r}, default_set=True)
bpy.ops.wm.open_mainfile(filepath=sys.argv[-1])
sys.path.insert(0, {helpers!r})
from sample_rigs import read_all_keys
assert bpy.ops.beyond_mocap.bake_to_rig() == {{"FINISHED"}}
print("KEYS", json.dumps(read_all_keys({extension!r}, bpy.context.scene.beyond_mocap.rig.target)), flush=True)
os._exit(0)
"""


@pytest.fixture
def rig(one, rigify):  # noqa: F811
    """A Rigify rig, chosen; the player's motion is applied."""
    one.id_data.render.fps = 30
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept()
    found = rigs.append_rigify(rigify)
    bpy.context.scene.beyond_mocap.rig.target = found
    return found


@pytest.mark.parametrize("ik", ("MUTE", "BAKE"))
def test_baking_twice_gives_the_same_keys(rig, ik):
    bpy.context.scene.beyond_mocap.rig.ik = ik
    assert bpy.ops.beyond_mocap.bake_to_rig() == {"FINISHED"}
    first = read_all_keys(EXTENSION, rig)
    bpy.context.scene.frame_set(40)
    assert bpy.ops.beyond_mocap.bake_to_rig() == {"FINISHED"}
    assert any("neck_follow" in place for place in first)
    assert read_all_keys(EXTENSION, rig) == first


@pytest.mark.parametrize("order", (("MUTE", "MUTE"), ("MUTE", "BAKE"), ("BAKE", "MUTE")))
def test_a_bake_does_not_depend_on_the_one_before(body, order):  # noqa: F811
    found = []
    for choices in (order, order[-1:]):
        target = rigs.create_rig(rigs.MIXAMO, "IK", root="root", extra=[("target.L", "root", "left foot")])
        constraint = target.pose.bones["mixamorig:LeftLeg"].constraints.new("IK")
        constraint.target, constraint.subtarget, constraint.chain_count = target, "target.L", 2
        constraint.influence = 0.75
        settings = choose(target, body)
        for choice in choices:
            settings.ik = choice
            assert bpy.ops.beyond_mocap.bake_to_rig() == {"FINISHED"}
            bpy.context.scene.frame_set(20)
        assert constraint.influence == (0.75 if order[-1] == "BAKE" else 0.0)
        found.append(read_all_keys(EXTENSION, target))
        assert bpy.ops.beyond_mocap.unbake() == {"FINISHED"}
        assert constraint.influence == 0.75
    assert found[0] == found[1]


@pytest.mark.parametrize("form", ("ACTION", "STRIPS"))
def test_a_bake_is_the_same_after_the_file_is_opened_again(rig, tmp_path, form):
    settings = bpy.context.scene.beyond_mocap
    settings.accept_as = form
    bpy.ops.beyond_mocap.accept(form=form)
    assert bpy.ops.beyond_mocap.bake_to_rig() == {"FINISHED"}
    in_session, path = read_all_keys(EXTENSION, rig), str(tmp_path / "baked.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    script = BAKE_IN_ANOTHER_PROCESS.format(extension=EXTENSION, helpers=str(pathlib.Path(rigs.__file__).parent))
    done = subprocess.run([sys.executable, "-P", "-c", script, path], capture_output=True, text=True)
    line = next((line for line in done.stdout.splitlines() if line.startswith("KEYS ")), None)
    assert line is not None, done.stdout + done.stderr
    assert json.loads(line[5:]) == in_session


def list_overlays():
    return [space.overlay for window in bpy.context.window_manager.windows for area in window.screen.areas
            for space in area.spaces if space.type == "VIEW_3D"]


def test_a_control_rig_without_a_mesh_is_seen_after_baking(body):  # noqa: F811
    bare, skinned = rigs.create_mixamo(), rigs.create_mixamo()
    mesh = bpy.data.objects.new("Skin", bpy.data.meshes.new("Skin"))
    bpy.context.scene.collection.objects.link(mesh)
    mesh.parent = skinned
    for target, is_seen in ((skinned, False), (bare, True)):
        for overlay in list_overlays():
            overlay.show_bones = False
        choose(target, body)
        assert bpy.ops.beyond_mocap.bake_to_rig() == {"FINISHED"}
        assert list_overlays() and {overlay.show_bones for overlay in list_overlays()} == {is_seen}


def test_ik_and_fk_can_both_be_used_after_a_bake(body, rigify, rooms):  # noqa: F811
    target = rigs.append_rigify(rigify)
    choose(target, body)
    assert bpy.ops.beyond_mocap.bake_to_rig() == {"FINISHED"}
    bones = [f"DEF-{name}.{side}" for side in "LR" for name in ("hand", "foot", "toe", "upper_arm", "thigh", "shin")]
    frames = range(5, 65, 6)
    by_fk = rigs.read_heads(target, bones, frames)
    curves = rooms["core.channels"].collect_curves(*rooms["core.channels"].find_playing_action(target))
    switches = [curve for (path, _), curve in curves.items() if "IK_FK" in path]
    for curve in switches:
        curve.keyframe_points[0].co.y = 0.0
        curve.update()
    assert len(switches) == 4
    apart = np.linalg.norm(rigs.read_heads(target, bones, frames) - by_fk, axis=-1).max(axis=0).reshape(2, -1)
    assert apart[:, :5].max() < 1e-3 and apart.max() < 0.05  # knees may lie beside their plane
    poles = [target.pose.bones[f"VIS_{limb}_ik_pole.{side}"] for side in "LR" for limb in ("thigh", "upper_arm")]
    assert max((pole.tail - pole.head).length for pole in poles) < 1.5  # not stretched from where the rig stands


def read_bvh_rate(path):
    line = next(line for line in path.read_text().splitlines() if line.startswith("Frame Time:"))
    return 1.0 / float(line.split()[-1])


def test_the_takes_rate_is_exported_in_every_session_or_its_lack_is_reported(one, session, tmp_path, capfd):  # noqa: F811
    scene, path = bpy.context.scene, tmp_path / "take.bvh"
    scene.render.fps, scene.beyond_mocap.rate = 25, 60.0
    bpy.ops.beyond_mocap.synthesize()
    bpy.ops.beyond_mocap.accept()
    session.clear_session()

    def export():
        bpy.ops.beyond_mocap.export_motion(filepath=str(path), format="BVH", own_rate=True, who="PLAYERS")
        return capfd.readouterr().out

    assert "rate is not known" not in export() and read_bvh_rate(path) == pytest.approx(60.0, rel=1e-4)
    del one.body.animation_data.action["beyond_mocap_rate"]
    assert "rate is not known" in export() and read_bvh_rate(path) == pytest.approx(25.0, rel=1e-4)
