"""Own keys as a layer: exactly the take at influence 0, the keyed pose at 1; kept by updates, and taken away."""

import importlib

import bpy
import numpy as np
import pytest
from test_players import match, ready, session  # noqa: F401  (fixtures)
from test_result import one  # noqa: F401  (fixture)

BONES = ("LeftArm", "Spine", "Hips")


@pytest.fixture
def layers(extension):
    return importlib.import_module(f"{extension.__name__}.scene.result.key_layers")


def read_poses(body, frames):
    """Own rotation and location of some bones as Blender evaluates them: (F, B, 7)."""
    found = []
    for frame in frames:
        bpy.context.scene.frame_set(int(frame), subframe=float(frame % 1.0))
        shown = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
        found.append([(*shown.pose.bones[name].rotation_quaternion, *shown.pose.bones[name].location)
                      for name in BONES])
    return np.array(found)


def key_poses(body):
    """Keys of a user: a turned arm at 50 and 60.5, the whole body higher at 52, a bone moved that had no location."""
    arm, spine, hips = (body.pose.bones[name] for name in BONES)
    scene = bpy.context.scene
    for frame in (50, 60.5):
        scene.frame_set(int(frame), subframe=frame % 1.0)
        arm.rotation_quaternion = (0.5, -0.5, 0.5, 0.5)
        arm.keyframe_insert("rotation_quaternion", frame=frame)
    scene.frame_set(52)
    hips.location.z += 0.2
    hips.keyframe_insert("location", frame=52)
    scene.frame_set(70)
    spine.location = (0.1, 0.2, 0.3)
    spine.keyframe_insert("location", frame=70)


KEYED = {0: (50, 60.5), 1: (70,), 2: (52,)}


@pytest.fixture(params=("PREVIEW", "ACTION"))
def body(one, request):  # noqa: F811
    """A body that plays a take, previewed or applied."""
    bpy.ops.beyond_mocap.synthesize()
    if request.param == "ACTION":
        bpy.ops.beyond_mocap.accept()
    return one.body


def assert_dialled(body, layer, plain, keyed, frames):
    layer.influence = 0.0
    np.testing.assert_allclose(read_poses(body, frames), plain, atol=2e-6)
    layer.influence = 1.0
    found = read_poses(body, frames)
    for bone, at in KEYED.items():
        for frame in at:
            row = frames.index(frame)
            same = np.abs(np.sum(found[row, bone, :4] * keyed[row, bone, :4]))
            assert same == pytest.approx(1.0, abs=1e-6)
            np.testing.assert_allclose(found[row, bone, 4:], keyed[row, bone, 4:], atol=2e-6)
    away = [frames.index(frame) for frame in (20, 90)]
    np.testing.assert_allclose(found[away], plain[away], atol=2e-6)
    layer.influence = 0.5
    half = read_poses(body, frames)
    row = frames.index(52)
    np.testing.assert_allclose(half[row, 2, 4:], 0.5 * (plain + keyed)[row, 2, 4:], atol=2e-6)
    layer.influence = 1.0


FRAMES = [20, 50, 52, 55, 60.5, 70, 90]


def test_a_layer_is_dialled_between_the_take_and_the_keys(body, layers, one):  # noqa: F811
    plain = read_poses(body, FRAMES)
    key_poses(body)
    keyed = read_poses(body, FRAMES)
    assert bpy.ops.beyond_mocap.keep_as_layer() == {"FINISHED"}
    (layer,) = layers.list_layers(body)
    assert_dialled(body, layer, plain, keyed, FRAMES)
    between = read_poses(body, [53, 54, 56])[:, 0, :4]  # no spike of one frame: the difference fades
    turned = read_poses(body, [50])[0, 0, :4]
    assert np.abs(np.sum(between * turned, axis=1)).min() > 0.9
    path = bpy.app.tempdir + "layer.blend"
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    body = bpy.context.scene.beyond_mocap.players[0].body
    assert_dialled(body, layers.list_layers(body)[0], plain, keyed, FRAMES)


def test_updates_and_all_forms_keep_the_layer(body, layers, one):  # noqa: F811
    plain = read_poses(body, FRAMES)
    key_poses(body)
    keyed = read_poses(body, FRAMES)
    bpy.ops.beyond_mocap.keep_as_layer()
    layers.list_layers(body)[0].influence = 0.75
    for step in (lambda: bpy.ops.beyond_mocap.update(player=one.name), lambda: bpy.ops.beyond_mocap.accept(),
                 lambda: bpy.ops.beyond_mocap.accept(form="STRIPS"),
                 lambda: bpy.ops.beyond_mocap.update(player=one.name),
                 lambda: bpy.ops.beyond_mocap.discard(), lambda: bpy.ops.beyond_mocap.accept(form="ACTION"),
                 lambda: bpy.ops.beyond_mocap.update(player=one.name), lambda: bpy.ops.beyond_mocap.discard()):
        assert step() == {"FINISHED"}
        (layer,) = layers.list_layers(body)
        assert layer.influence == 0.75
        assert_dialled(body, layer, plain, keyed, FRAMES)
        layer.influence = 0.75
        assert one.result.hand_keys == 0


def test_a_layer_is_removed_and_the_take_is_an_action_again(body, layers):
    plain, actions = read_poses(body, FRAMES), len(bpy.data.actions)
    take = body.animation_data.action
    key_poses(body)
    bpy.ops.beyond_mocap.keep_as_layer()
    assert bpy.ops.beyond_mocap.remove_layer(number=1) == {"FINISHED"}
    assert not layers.list_layers(body) and body.animation_data.action == take and len(bpy.data.actions) == actions
    np.testing.assert_allclose(read_poses(body, FRAMES), plain, atol=2e-6)


def test_keys_above_a_layer_become_a_second_one(body, layers):
    key_poses(body)
    bpy.ops.beyond_mocap.keep_as_layer()
    before = read_poses(body, FRAMES)
    bpy.context.scene.frame_set(55)
    body.pose.bones["LeftArm"].rotation_quaternion = (1.0, 0.0, 0.0, 0.0)
    body.pose.bones["LeftArm"].keyframe_insert("rotation_quaternion", frame=55)
    assert bpy.ops.beyond_mocap.keep_as_layer() == {"FINISHED"}
    first, second = layers.list_layers(body)
    assert np.abs(read_poses(body, [55])[0, 0, 0]) == pytest.approx(1.0, abs=1e-6)
    second.influence = 0.0
    np.testing.assert_allclose(read_poses(body, FRAMES), before, atol=2e-6)


def test_keys_above_a_layer_are_kept_by_an_update(body, layers, one):  # noqa: F811
    key_poses(body)
    bpy.ops.beyond_mocap.keep_as_layer()
    bpy.context.scene.frame_set(55)
    body.pose.bones["LeftArm"].rotation_quaternion = (1.0, 0.0, 0.0, 0.0)
    body.pose.bones["LeftArm"].keyframe_insert("rotation_quaternion", frame=55)
    before = read_poses(body, [50, 55, 70])
    for step in (lambda: bpy.ops.beyond_mocap.update(player=one.name), bpy.ops.beyond_mocap.accept):
        assert step() == {"FINISHED"}
        assert len(layers.list_layers(body)) == 2
        after = read_poses(body, [50, 55, 70])
        np.testing.assert_allclose(after[1], before[1], atol=2e-6)
        np.testing.assert_allclose(after[2, 1:], before[2, 1:], atol=2e-6)  # the arm's only key held it for ever


def test_without_own_keys_there_is_no_layer(body, layers):
    with pytest.raises(RuntimeError, match="no keys of your own"):
        bpy.ops.beyond_mocap.keep_as_layer()
    assert not layers.list_layers(body) and body.animation_data.action is not None


def test_time_and_keyed_influence_of_a_layer_are_kept_by_updates(body, layers, one):  # noqa: F811
    key_poses(body)
    bpy.ops.beyond_mocap.keep_as_layer()
    (layer,) = layers.list_layers(body)
    layer.scale, layer.blend_type, layer.frame_start_ui = 1.5, "ADD", layer.frame_start + 20.0
    for influence, frame in ((0.25, 60), (0.75, 90)):
        layer.influence = influence
        layer.keyframe_insert("influence", frame=frame)

    def read_layer():
        (layer,) = layers.list_layers(body)
        return (layer.frame_start, layer.frame_end, layer.scale, layer.blend_type,
                [tuple(key.co) for curve in layer.fcurves for key in curve.keyframe_points])

    before = read_layer()
    assert len(before[-1]) == 2
    for step in (lambda: bpy.ops.beyond_mocap.update(player=one.name), lambda: bpy.ops.beyond_mocap.accept()):
        assert step() == {"FINISHED"}
        assert read_layer() == before


def test_a_layer_with_keys_of_the_object_and_of_a_custom_property_is_removed(body, layers):
    bone = body.pose.bones["Spine"]
    bone["stiffness"] = 0.5
    bone.keyframe_insert('["stiffness"]', frame=50)
    body.location.x += 1.0
    body.keyframe_insert("location", frame=50)
    bpy.ops.beyond_mocap.keep_as_layer()
    assert bpy.ops.beyond_mocap.remove_layer(number=1) == {"FINISHED"}
    assert not layers.list_layers(body)


def test_keys_of_one_axis_above_a_layer_leave_the_others(body, layers):
    key_poses(body)
    bpy.ops.beyond_mocap.keep_as_layer()
    before = read_poses(body, FRAMES)
    bpy.context.scene.frame_set(52)
    body.pose.bones["Hips"].location.y += 0.3
    body.pose.bones["Hips"].keyframe_insert("location", index=1, frame=52)
    assert bpy.ops.beyond_mocap.keep_as_layer() == {"FINISHED"}
    after = read_poses(body, FRAMES)
    np.testing.assert_allclose(after[2, 2, 4:] - before[2, 2, 4:], (0.0, 0.3, 0.0), atol=2e-6)
    away = [FRAMES.index(frame) for frame in (20, 90)]
    np.testing.assert_allclose(after[away], before[away], atol=2e-6)


def test_a_strip_in_tweak_mode_stops_updates_before_they_change_anything(body, layers, one):  # noqa: F811
    key_poses(body)
    bpy.ops.beyond_mocap.keep_as_layer()
    data = body.animation_data
    track = data.nla_tracks[-1]
    track.select, data.nla_tracks.active = True, track
    data.use_tweak_mode, take = True, one.take
    for step in (lambda: bpy.ops.beyond_mocap.update(player=one.name), bpy.ops.beyond_mocap.accept):
        with pytest.raises(RuntimeError, match="leave tweak mode"):
            step()
    assert one.take == take
