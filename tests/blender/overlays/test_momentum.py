"""The momentum of armatures: shown for any humanoid that moves, follows its motion, and leaves nothing behind."""

import importlib

import bpy
import numpy as np
import pytest
import worlds
from undo import assert_one_step, collect_state


@pytest.fixture
def room(extension):
    """room("overlays.momentum") -> that module of the scene room; traces are dropped afterwards."""
    names = extension.__name__
    yield lambda name: importlib.import_module(f"{names}.scene.{name}")
    importlib.import_module(f"{names}.scene.overlays.momentum_traces").clear_traces()


@pytest.fixture
def traces(room):
    return room("overlays.momentum_traces")


@pytest.fixture
def runner():
    """An armature that plays a clip of a jogger."""
    return import_clip("jogging_3_5")


def import_clip(name):
    bpy.ops.beyond_mocap.import_clips(filepath=str(worlds.SAMPLE / f"{name}.bvh"))
    body = bpy.context.view_layer.objects.active
    worlds.select_objects(body)
    return body


def list_current(room):
    return room("overlays.momentum").list_current_rows(bpy.context.scene)


def test_showing_is_one_step_and_traces_the_visible_motion(runner, traces, room):
    name = runner.name
    assert_one_step(bpy.ops.beyond_mocap.show_momentum)
    runner = bpy.data.objects[name]
    shown = traces.find_momentum(runner)
    assert len(shown.trace.flights) > 8
    for frame in (5, 40, 77):
        bpy.context.scene.frame_set(frame)
        ((found, row),) = list_current(room)
        root = runner.matrix_world @ runner.pose.bones[0].head
        assert found is shown and row == frame - shown.first
        assert np.linalg.norm(shown.trace.centre[row] - np.array(root)) < 0.3


def test_every_frame_has_finite_meshes_and_a_line(runner, traces, room):
    bpy.ops.beyond_mocap.show_momentum()
    scene, momentum = bpy.context.scene, room("overlays.momentum")
    lines, kinds = set(), set()
    for frame in range(scene.frame_start, scene.frame_end, 3):
        scene.frame_set(frame)
        for item in momentum.list_items(scene):
            meshes = item.meshes()
            assert all(np.isfinite(mesh.points).all() and mesh.points.dtype == np.float32 for mesh in meshes)
            assert all(len(mesh.points) == len(mesh.colours) for mesh in meshes)
            kinds.update(mesh.kind for mesh in meshes)
        lines.update(text.split()[0] for _, text in momentum.list_labels(scene))
    assert lines == {"flight", "ground"} and kinds == {"TRIS", "LINES"}


def test_the_polygon_lies_under_the_standing_foot_and_the_arrow_begins_in_it(runner, traces, room, core):
    bpy.ops.beyond_mocap.show_momentum()
    shown, momentum = traces.find_momentum(runner), room("overlays.momentum")
    standing = np.flatnonzero(shown.trace.is_down.any(axis=(1, 2)))[::9]
    assert len(standing) > 3
    for row in standing:
        meshes = momentum.build_frame(shown.trace, int(row))
        fill = next(mesh for mesh in meshes if mesh.kind == "TRIS")
        middle = shown.trace.corners[row][shown.trace.is_down[row]].mean(axis=0)[:2]
        assert np.linalg.norm(fill.points[:, :2].mean(axis=0) - middle) < 0.2
        arrow = meshes[-1].points
        assert arrow[0, 2] == pytest.approx(shown.trace.ground, abs=1e-6) and arrow[1, 2] > arrow[0, 2]


def test_lines_are_built_once_a_second_and_end_with_the_time_range(runner, traces, room):
    bpy.ops.beyond_mocap.show_momentum()
    scene, momentum = bpy.context.scene, room("overlays.momentum")
    shown = traces.find_momentum(runner)
    keys = []
    for frame, reach in ((61, 1.0), (62, 1.0), (61, 0.0)):
        scene.frame_set(shown.first + frame)
        scene.beyond_mocap.view.reach = reach
        keys.append({item.key for item in momentum.list_items(scene) if item.key[1] == "second"})
    assert keys[0] == keys[1] == {(shown, "second", second) for second in (1, 2, 3)} and not keys[2]
    lines = [mesh for second in range(9) for mesh in momentum.build_lines(shown.trace, second)]
    path = np.concatenate([mesh.points for mesh in lines if mesh.width == momentum.THIN])
    np.testing.assert_allclose(path[::2], shown.trace.centre[:-1], atol=1e-6)  # no gap between two seconds
    flights = np.concatenate([mesh.points for mesh in lines if mesh.width == momentum.WIDE])
    assert len(flights) == len(shown.trace.flights) * 2 * (momentum.STEPS - 1)


def test_nothing_is_drawn_outside_the_motion_or_switched_off(runner, traces, room):
    bpy.ops.beyond_mocap.show_momentum()
    scene, view = bpy.context.scene, bpy.context.scene.beyond_mocap.view
    assert len(list_current(room)) == 1
    for name in ("momentum", "show"):
        setattr(view, name, False)
        assert list_current(room) == []
        setattr(view, name, True)
    runner.hide_set(True)
    assert list_current(room) == []
    runner.hide_set(False)
    scene.frame_set(-300)
    assert list_current(room) == []
    scene.frame_set(9000)
    assert list_current(room) == []


def test_hiding_again_leaves_the_file_as_it_was(runner, traces):
    before = collect_state()
    bpy.ops.beyond_mocap.show_momentum()
    assert collect_state() != before
    bpy.ops.beyond_mocap.show_momentum(remove=True)
    assert collect_state() == before and not traces.has_traces()
    with pytest.raises(RuntimeError, match="does not show its momentum.*press Show Momentum"):
        bpy.ops.beyond_mocap.show_momentum(remove=True)


def test_several_characters_are_drawn_at_once(runner, traces, room):
    other = import_clip("walking_1_2")
    worlds.select_objects(runner, other)
    bpy.ops.beyond_mocap.show_momentum()
    bpy.context.scene.frame_set(20)
    assert {id(shown) for shown, _ in list_current(room)} == {id(traces.find_momentum(runner)),
                                                              id(traces.find_momentum(other))}
    assert len(traces.find_momentum(other).trace.flights) == 0 < len(traces.find_momentum(runner).trace.flights)


def test_the_trace_follows_the_action_the_object_and_the_frame_rate(runner, traces):
    scene = bpy.context.scene
    bpy.ops.beyond_mocap.show_momentum()
    first = traces.find_momentum(runner)
    traces.update_traces(scene)
    assert traces.find_momentum(runner) is first  # nothing has changed
    runner.location.z += 1.0
    bpy.context.view_layer.update()
    traces.update_traces(scene)
    moved = traces.find_momentum(runner)
    np.testing.assert_allclose(moved.trace.centre - first.trace.centre, np.tile([0, 0, 1], (len(first.trace), 1)),
                               atol=1e-4)
    walk = import_clip("walking_1_2")
    runner.animation_data.action = walk.animation_data.action
    runner.animation_data.action_slot = walk.animation_data.action_slot
    traces.update_traces(scene)
    assert len(traces.find_momentum(runner).trace.flights) == 0
    scene.render.fps = 60
    traces.update_traces(scene)
    assert traces.find_momentum(runner).trace.fps == 60.0


def test_keys_are_compared_once_an_action_has_changed(runner, traces, room):
    bpy.ops.beyond_mocap.show_momentum()
    first, scene = traces.find_momentum(runner), bpy.context.scene
    action, slot = room("core.channels").find_playing_action(runner)
    path = f'pose.bones["{runner.pose.bones[0].name}"].location'
    curve = room("core.channels").collect_curves(action, slot)[path, 1]
    for key in curve.keyframe_points:
        key.co.y += 0.5 / runner.matrix_world.to_scale().x
    curve.update()
    traces.WATCHER.restored()  # as after undo; with a window Blender reports a change of the action
    traces.update_traces(scene)
    assert np.abs(traces.find_momentum(runner).trace.centre - first.trace.centre).max() > 0.3


def test_a_body_on_its_new_path_is_traced_there(runner, traces):
    bpy.ops.beyond_mocap.edit_path()
    curve = bpy.context.view_layer.objects.active
    curve.location.y += 3.0
    bpy.context.view_layer.update()
    bpy.ops.beyond_mocap.update_path()
    worlds.select_objects(runner)
    bpy.ops.beyond_mocap.show_momentum()
    shown = traces.find_momentum(runner)
    bpy.context.scene.frame_set(shown.first + 10)
    root = runner.matrix_world @ runner.pose.bones[0].head
    assert np.linalg.norm(shown.trace.centre[10] - np.array(root)) < 0.3
    bpy.ops.beyond_mocap.leave_path()
    traces.update_traces(bpy.context.scene)
    assert abs(traces.find_momentum(runner).trace.centre[10, 1] - shown.trace.centre[10, 1]) > 2.5


def test_a_skeleton_that_rests_folded_is_read_as_it_moves(traces, core, tmp_path):
    """As LAFAN1's, whose limbs all lie along X at rest: here every rest offset of the legs is turned by a quarter."""
    turn = core("motion.quaternion").from_axis_angle(np.array([0.0, 1.0, 0.0]), np.pi / 2)
    gait = core("synthetic.gait").build_gait(3.0, 2.0, fps=30.0)
    skeleton, quaternion = gait.skeleton, core("motion.quaternion")
    legs = [joint for joint, name in enumerate(skeleton.names) if any(part in name for part in ("Leg", "Foot", "Toe"))]
    below = [joint for joint in legs if skeleton.parents[joint] in legs]  # their offsets turn with the thigh
    offsets, rotations = skeleton.offsets.copy(), gait.rotations.copy()
    offsets[below] = quaternion.rotate(turn, offsets[below])
    tops = [joint for joint in legs if joint not in below]
    back = quaternion.inverse(turn)
    rotations[:, tops] = quaternion.multiply(rotations[:, tops], back)
    rotations[:, below] = quaternion.multiply(quaternion.multiply(turn, rotations[:, below]), back)
    folded = core("motion.motion").Motion(core("motion.skeleton").Skeleton(skeleton.names, skeleton.parents, offsets),
                                          gait.root_positions, rotations, gait.fps)
    core("files.bvh.bvh").write_bvh(tmp_path / "folded.bvh", folded)
    bpy.context.scene.render.fps = 30
    bpy.ops.beyond_mocap.import_clips(filepath=str(tmp_path / "folded.bvh"))
    body = bpy.context.view_layer.objects.active
    worlds.select_objects(body)
    bpy.ops.beyond_mocap.show_momentum()
    np.testing.assert_allclose(traces.find_momentum(body).trace.centre,
                               core("motion.momentum_trace").trace_momentum(gait).centre, atol=5e-3)


def test_the_mesh_of_a_character_stands_for_its_armature(runner, traces):
    mesh = bpy.data.objects.new("Skin", bpy.data.meshes.new("Skin"))
    bpy.context.scene.collection.objects.link(mesh)
    mesh.modifiers.new("Armature", "ARMATURE").object = runner
    worlds.select_objects(mesh)
    bpy.ops.beyond_mocap.show_momentum()
    assert traces.find_momentum(runner) is not None


def test_what_is_no_moving_humanoid_gets_one_clear_line_and_nothing_changes(runner, traces):
    data = bpy.data.armatures.new("Chain")
    chain = bpy.data.objects.new("Chain", data)
    bpy.context.scene.collection.objects.link(chain)
    worlds.select_objects(chain)
    bpy.ops.object.mode_set(mode="EDIT")
    for number in range(3):
        bone = data.edit_bones.new(f"link{number}")
        bone.head, bone.tail = (0, 0, number), (0, 0, number + 1)
        bone.parent = data.edit_bones[number - 1] if number else None
    bpy.ops.object.mode_set(mode="OBJECT")
    with pytest.raises(RuntimeError, match="plays no action"):
        bpy.ops.beyond_mocap.show_momentum()
    for frame in (1, 20):
        chain.pose.bones[0].location.x = frame
        chain.pose.bones[0].keyframe_insert("location", frame=frame)
    worlds.select_objects(runner, chain)
    before = collect_state()
    with pytest.raises(RuntimeError, match="armature Chain: has no legs.*expected a humanoid") as told:
        bpy.ops.beyond_mocap.show_momentum()
    assert len(str(told.value).strip().splitlines()) == 1
    assert collect_state() == before and not traces.has_traces()


def test_a_motion_that_becomes_impossible_says_so_once_and_comes_back(runner, traces):
    scene = bpy.context.scene
    bpy.ops.beyond_mocap.show_momentum()
    action, slot = runner.animation_data.action, runner.animation_data.action_slot
    runner.animation_data.action = None
    traces.update_traces(scene)
    assert traces.find_momentum(runner) is None
    assert "plays no action" in runner.beyond_mocap_momentum.message
    runner.animation_data.action = action
    runner.animation_data.action_slot = slot
    traces.update_traces(scene)
    assert traces.find_momentum(runner) is not None and runner.beyond_mocap_momentum.message == ""


def test_a_deleted_armature_is_forgotten(runner, traces, room):
    bpy.ops.beyond_mocap.show_momentum()
    bpy.data.objects.remove(runner)
    assert list_current(room) == []
    traces.update_traces(bpy.context.scene)
    assert not traces.has_traces()


def test_the_switch_is_saved_and_the_trace_comes_back_with_the_file(runner, traces, room, tmp_path):
    bpy.ops.beyond_mocap.show_momentum()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shown.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    assert not traces.has_traces()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shown.blend"))
    assert list_current(room) == []
    traces.update_traces(bpy.context.scene)
    assert len(list_current(room)) == 1


def test_a_rig_with_constraints_shows_the_momentum_of_what_it_shows(traces, room):
    """Its bones have no keys: they copy another armature."""
    walker = import_clip("walking_1_2")
    scene = bpy.context.scene
    follower = walker.copy()
    follower.animation_data_clear()
    scene.collection.objects.link(follower)
    for bone in follower.pose.bones:
        constraint = bone.constraints.new("COPY_TRANSFORMS")
        constraint.target, constraint.subtarget = walker, bone.name
    follower.keyframe_insert("location", frame=1)
    follower.keyframe_insert("location", frame=60)
    worlds.select_objects(walker, follower)
    bpy.ops.beyond_mocap.show_momentum()
    own, copied = (traces.find_momentum(body).trace.centre for body in (walker, follower))
    count = min(len(own), len(copied))
    assert count >= 55 and np.abs(own[:count] - copied[:count]).max() < 0.02


def test_nothing_is_left_when_the_extension_is_disabled(runner, extension):
    import addon_utils

    bpy.ops.beyond_mocap.show_momentum()
    names, traces = extension.__name__, importlib.import_module(
        f"{extension.__name__}.scene.overlays.momentum_traces")
    handlers = {name: len(getattr(bpy.app.handlers, name)) for name in dir(bpy.app.handlers)
                if isinstance(getattr(bpy.app.handlers, name), list)}
    addon_utils.disable(names)
    assert not traces.has_traces() and not hasattr(bpy.types.Object, "beyond_mocap_momentum")
    after = {name: len(getattr(bpy.app.handlers, name)) for name in handlers}
    assert all(after[name] <= handlers[name] for name in handlers)
    addon_utils.enable(names)
    assert hasattr(bpy.types.Object, "beyond_mocap_momentum")
