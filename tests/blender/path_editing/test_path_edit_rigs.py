"""Path editing on armatures of every kind: their own path changes nothing, another one is gone to the millimetre by the
bones that are seen, what was before comes back, and what cannot be done is said."""

import importlib
import re

import bpy
import numpy as np
import path_edit_rigs
import pytest
import sample_rigs as rigs
from test_path_edit import SAMPLE, bits, choose
from test_rigs import rigify  # noqa: F401  (a fixture)
from undo import assert_one_step

STEP = 6
IS_LONGER = "the motion ends .* m before the end of the path: .*"  # the only line about a bent path


@pytest.fixture
def part(extension):
    return lambda name: importlib.import_module(f"{extension.__name__}.scene.{name}")


@pytest.fixture
def recorded(part, core):
    """Two seconds of a recorded jog with a turn, on an armature of its own."""
    bpy.context.scene.render.fps = 30
    clip = core("files.bvh.bvh").read_bvh(SAMPLE / "jogging_turn_left.bvh").motion
    clip = core("motion.motion").resample(clip, 30.0).frames(0, 60)

    def make(onto=None, **wishes):
        scene = bpy.context.scene
        body = part("rigs.armature").create_armature(bpy.context, clip.skeleton, "Body")
        part("core.action").write_motion(body, clip, scene, path_edit_rigs.START)
        if onto is None:
            return body
        rig = onto() if callable(onto) else rigs.append_rigify(onto)
        source, options = part("rigs.fit").read_source(body, scene), part("rigs.fit").BakeOptions(**wishes)
        bake = part("rigs.rig_bake")
        bake.apply_bake(bake.prepare_bake(rig, part("rigs.bone_maps").find_bone_map(rig), source, scene, options))
        bpy.data.objects.remove(body)
        bpy.context.view_layer.update()
        return rig

    return make


@pytest.fixture
def ride(part, core):
    """Put an armature on its own path, or on a bent one, as Edit Path does. Gives the carrier's reading and the
    ridden."""

    def go(rig, bent, **settings):
        scene, recipe = bpy.context.scene, core("path_editing.path_edit")
        wanted = recipe.PathEditSettings(**settings)
        carrier = part("path_editing.rigs").choose_adapter(rig)
        carrier.check()
        read = carrier.read_motion(scene)
        source = core("path_editing.path_edit_source").prepare_source(read.motion, wanted, read.standing)
        path = source.path
        if bent:
            along = np.linspace(0.0, 1.0, 80)
            line = np.column_stack([3.0 + 1.2 * source.arc.length * along, 1.2 * np.sin(4.0 * along), 0.0 * along])
            path = core("path_editing.path_line").fit_line(line, "bent")
        ridden = recipe.edit_path(source, path, wanted)
        if not rig.beyond_mocap_ride.on:
            carrier.start_edit()
            rig.beyond_mocap_ride.on = True
        carrier.write_motion(scene, read, ridden, "a digest")
        return read, ridden

    return go


def shown(rig, frames, bones=None):
    """What Blender shows of bones: (F, B, 4, 4) in the world."""
    scene, found = bpy.context.scene, []
    bones = bones or [bone.name for bone in rig.data.bones]
    for frame in frames:
        scene.frame_set(int(frame))
        posed = rig.evaluated_get(bpy.context.evaluated_depsgraph_get())
        found.append([np.array(posed.matrix_world @ posed.pose.bones[name].matrix) for name in bones])
    return np.array(found)


def off(core, rig, read, ridden):
    """Millimetres between the ridden motion and the bones that show it, the most of each joint."""
    rows = np.arange(0, len(ridden.motion), STEP)
    bones = list(read.rig.transfer.parts.visible_bones.values())
    places = core("motion.motion").forward_kinematics(ridden.motion)[0][rows]
    seen = shown(rig, read.first + rows, bones)[..., :3, 3]
    return dict(zip(read.rig.transfer.parts.visible_bones, 1000 * np.linalg.norm(seen - places, axis=-1).max(axis=0)))


def tuned(rig, part, path, value=0.0):
    """A property of the rig set, its curve gone."""
    action, slot = part("core.channels").find_playing_action(rig)
    for (where, _), curve in part("core.channels").collect_curves(action, slot).items():
        if where == path:
            action.layers[0].strips[0].channelbag(slot).fcurves.remove(curve)
    owner, _, name = path.rpartition("[")
    rig.path_resolve(owner)[name.strip('"]')] = value


def rigify_fk(recorded, part, file):
    return recorded(file, bakes_ik=True)


def rigify_ik(recorded, part, file):
    rig = recorded(file, bakes_ik=True)
    for limb in ("thigh_parent.L", "thigh_parent.R", "upper_arm_parent.L", "upper_arm_parent.R"):
        tuned(rig, part, f'pose.bones["{limb}"]["IK_FK"]')
    return rig


def hand_rig(recorded, part, _):
    return path_edit_rigs.create_ik_rig()


def hand_rig_of_few_keys(recorded, part, _):
    return path_edit_rigs.create_ik_rig(every=6, interpolation="BEZIER")


def without_root(recorded, part, _):
    return path_edit_rigs.create_ik_rig(root=False, cog=False)


def unreal_root_travels(recorded, part, _):
    return recorded(rigs.create_unreal, root="SMOOTH", bakes_ik=True)


def unreal_root_stays(recorded, part, _):
    return recorded(rigs.create_unreal, bakes_ik=True)


def odd_modes(recorded, part, _):
    def make():
        rig = rigs.create_mixamo()
        for number, bone in enumerate(rig.pose.bones):
            bone.rotation_mode = ("XYZ", "AXIS_ANGLE", "ZYX", "QUATERNION", "YXZ")[number % 5]
        return rig

    rig = recorded(make)
    rig.constraints.new("LIMIT_SCALE")  # so that it is no plain one
    return rig


def moved_object(recorded, part, _):
    return path_edit_rigs.move_to_object(recorded(), part("core.channels"))


def moved_object_under_moved_empty(recorded, part, _):
    rig = path_edit_rigs.move_to_object(recorded(), part("core.channels"))
    path_edit_rigs.parent_to_empty(rig)
    rig.delta_location, rig.delta_rotation_euler = (0.3, 0.2, 0.1), (0.0, 0.0, 0.4)
    return rig


def under_scaled_empty(recorded, part, _):
    rig = recorded()
    path_edit_rigs.parent_to_empty(rig, 2.0)
    rig.scale = (0.5, 0.5, 0.5)
    return rig


def strips(recorded, part, _):
    return path_edit_rigs.move_to_strip(recorded(), scale=1.3)


def half_an_action_over_strips(recorded, part, _):
    rig = recorded()
    data = rig.animation_data
    action = data.action
    path_edit_rigs.move_to_strip(rig)
    other = action.copy()
    rest = path_edit_rigs.build_bone_path(
        "Spine1" if "Spine1" in rig.pose.bones else rig.pose.bones[1].name, "rotation_quaternion"
    )
    for curve in part("core.channels").collect_curves(other, other.slots[0]).values():
        if curve.data_path == rest:
            for point in curve.keyframe_points:
                point.co.y = 0.5
    data.action, data.action_influence = other, 0.5
    data.action_slot = other.slots[0]
    return rig


def cyclic(recorded, part, _):
    rig = path_edit_rigs.create_ik_rig(frames=31)
    path_edit_rigs.cycle_curves(rig, part("core.channels"))
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 5, 70
    return rig


KINDS = [rigify_fk, rigify_ik, hand_rig, hand_rig_of_few_keys, without_root, unreal_root_travels, unreal_root_stays,
         odd_modes,
         moved_object, moved_object_under_moved_empty, under_scaled_empty, strips, half_an_action_over_strips, cyclic]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_its_own_path_changes_nothing_and_another_is_gone_to_the_millimetre(
    core, part, recorded, ride, rigify, kind
):  # noqa: F811
    rig = kind(recorded, part, rigify)
    bpy.context.view_layer.update()
    before = whole(part, rig)
    carrier = part("path_editing.rigs").choose_adapter(rig)
    assert type(carrier).__name__ == "RigAdapter"
    seen = carrier.read_motion(bpy.context.scene)
    assert whole(part, rig) == before  # looking changes nothing
    count, first = len(seen.motion), seen.first
    frames = np.arange(0, count, STEP)
    was = shown(rig, first + frames)
    read, _ = ride(rig, bent=False, plant=False, lean=False)
    now = shown(rig, first + frames)
    deforms = [bone.use_deform for bone in rig.data.bones]
    np.testing.assert_allclose(now[:, deforms], was[:, deforms], atol=2e-5)
    model = off(core, rig, read, _)  # the bones that are seen may stretch, the motion's do not
    read, ridden = ride(rig, bent=True)
    assert len(ridden.motion) == count and np.abs(ridden.correction).max() > 1e-4
    found = off(core, rig, read, ridden)
    feet = {name: value for name, value in found.items() if "foot" in name or name == "hips"}
    assert max(feet.values()) < 1.5, feet
    assert all(found[name] < model[name] + 3.0 for name in found if "lower_leg" not in name), found
    part("path_editing.edited_bodies").revert_path_edit(rig)
    bpy.context.scene.frame_set(1)
    assert whole(part, rig) == before


@pytest.mark.parametrize("kind", [hand_rig, strips, moved_object], ids=lambda kind: kind.__name__)
def test_a_rig_on_its_path_is_saved_and_opened(part, recorded, tmp_path, kind):
    rig = kind(recorded, part, None)
    rig.name = "Rig"
    before = whole(part, rig)
    bend(bpy.context.scene, start(rig), part)
    was = shown(rig, [5, 20, 40])
    file = str(tmp_path / "rig.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.ops.wm.open_mainfile(filepath=file)
    rig, scene = bpy.data.objects["Rig"], bpy.context.scene
    assert part("path_editing.live").update_all(scene) == 1  # the original is looked at again
    assert re.fullmatch(IS_LONGER, rig.beyond_mocap_ride.messages)
    np.testing.assert_allclose(shown(rig, [5, 20, 40]), was, atol=1e-5)
    rig.beyond_mocap_ride.curve.location.z += 0.5
    bpy.context.view_layer.update()
    assert part("path_editing.live").update_all(scene) == 1
    assert np.abs(shown(rig, [5, 20, 40]) - was).max() > 0.4
    choose(rig)
    assert bpy.ops.beyond_mocap.leave_path() == {"FINISHED"}
    assert whole(part, rig) == before


def test_each_button_is_one_step_with_a_rig_too(part):
    rig = path_edit_rigs.create_ik_rig()
    choose(rig)
    assert_one_step(bpy.ops.beyond_mocap.edit_path)
    assert_one_step(bpy.ops.beyond_mocap.bake_path)
    choose(bpy.data.objects["Hand Rig"])
    assert_one_step(bpy.ops.beyond_mocap.edit_path)
    assert_one_step(bpy.ops.beyond_mocap.leave_path)


def whole(part, rig):
    """All that an armature plays and how it stands, on frame 1."""
    bpy.context.scene.frame_set(1)
    data = rig.animation_data
    tracks = [(track.name, track.mute, [strip.name for strip in track.strips]) for track in data.nla_tracks]
    stands = [(tuple(b.location), tuple(b.rotation_quaternion), tuple(b.rotation_euler), b.rotation_mode)
              for b in rig.pose.bones]
    keys = bits(part, rig)[:3] if data.action is not None else None
    return keys, tracks, data.use_nla, stands, [tuple(row) for row in rig.matrix_world], len(bpy.data.scenes)


def start(rig, **settings):
    """Edit Path on an armature, its curve then bent to one side; the curve's object."""
    for name, value in settings.items():
        setattr(rig.beyond_mocap_ride, name, value)
    choose(rig)
    assert bpy.ops.beyond_mocap.edit_path() == {"FINISHED"}
    return rig.beyond_mocap_ride.curve


def bend(scene, drawn, part):
    """Move the curve and bend it; its riders follow."""
    drawn.location, drawn.rotation_euler = (4.0, 2.0, 0.0), (0.0, 0.0, 1.0)
    drawn.data.splines[0].bezier_points[-1].co.x += 1.0
    bpy.context.view_layer.update()
    part("path_editing.live").update_all(scene)


def refuses(verb, match):
    with pytest.raises(RuntimeError, match=match):
        verb()


def rigid(poses):
    """Places of bones (F, B, 4, 4) seen from the first of them."""
    return (np.linalg.inv(poses[:, :1]) @ poses)[..., :3, 3]


def test_what_a_body_carries_goes_along_and_what_lies_stays(part, recorded):
    rig = path_edit_rigs.add_props(recorded(), "Hips")
    frames, scene = np.arange(5, 65), bpy.context.scene
    hips = shown(rig, frames, ["Hips"])[:, 0, :3, 3]
    rest = np.array(rig.data.bones["sword"].matrix_local.to_3x3())
    for index, values in enumerate(((hips - hips[0]) @ rest).T):
        path_edit_rigs.add_keys(
            rig, path_edit_rigs.build_bone_path("sword", "location"), index, frames, values, "sword"
        )
    was = shown(rig, frames[::STEP], ["Hips", "sword", "bag"])
    stone = shown(rig, [5, 40], ["stone"])
    bend(scene, start(rig, plant=False, lean=False), part)
    now = shown(rig, frames[::STEP], ["Hips", "sword", "bag"])
    assert np.abs(now[..., :3, 3] - was[..., :3, 3]).max() > 1.0
    np.testing.assert_allclose(rigid(now)[:, 2], rigid(was)[:, 2], atol=1e-4)
    assert np.linalg.norm(rigid(now) - rigid(was), axis=-1).max() < 1e-3
    np.testing.assert_allclose(shown(rig, [5, 40], ["stone"]), stone, atol=1e-6)


def test_a_dog_rides_as_it_is_and_that_is_told(part):
    bpy.context.scene.render.fps = 30
    dog, frames = path_edit_rigs.create_quadruped(), np.arange(5, 65, STEP)
    was = shown(dog, frames)
    bend(bpy.context.scene, start(dog), part)
    now = shown(dog, frames)
    assert "no recognizable legs" in dog.beyond_mocap_ride.messages
    assert np.abs(now - was)[..., :3, 3].max() > 1.0
    np.testing.assert_allclose(rigid(now), rigid(was), atol=1e-4)


def test_muted_curves_stay_muted_and_half_frames_other_slots_and_drivers_are_kept(part, recorded):
    scene, rig = bpy.context.scene, path_edit_rigs.create_ik_rig()
    channels = part("core.channels")
    action, slot = channels.find_playing_action(rig)
    other = action.slots.new(id_type="OBJECT", name="Other")
    channels.add_curve(action, other, "location", 0, "").keyframe_points.insert(1, 5.0)
    spine = path_edit_rigs.build_bone_path("spine_01", "location")
    head = path_edit_rigs.build_bone_path("head", "rotation_euler")
    path_edit_rigs.add_keys(rig, spine, 1, [5, 40], [0.0, 5.0]).mute = True
    path_edit_rigs.add_keys(rig, head, 1, [5.5, 20.25, 33.3], [0.0, 0.5, 0.0])
    rig.pose.bones["head"].rotation_mode = "XYZ"
    driver = rig.driver_add('pose.bones["neck_01"].rotation_euler', 0).driver
    driver.type, driver.expression = "SCRIPTED", "0.2"
    rig.pose.bones["neck_01"].rotation_mode = "XYZ"
    bpy.context.view_layer.update()
    frames = np.arange(5, 65, STEP)
    upper = ["pelvis", "spine_01", "head", "neck_01", "hand_l"]
    was = shown(rig, frames, upper)
    bend(scene, start(rig, plant=False, lean=False), part)
    assert re.fullmatch(IS_LONGER, rig.beyond_mocap_ride.messages)
    np.testing.assert_allclose(rigid(shown(rig, frames, upper)), rigid(was), atol=1e-4)
    made, slot = channels.find_playing_action(rig)
    assert len(made.slots) == 1 and len(action.slots) == 2
    assert channels.collect_curves(made, slot)[path_edit_rigs.build_bone_path("spine_01", "location"), 1].mute


def test_the_controls_of_inverse_kinematics_stay_with_it(part):
    """No switch is turned: feet are moved by their controls, knees by their poles, the rest by the COG."""
    rig, scene = path_edit_rigs.create_ik_rig(), bpy.context.scene
    scene.render.fps = 30
    original = set(part("core.channels").collect_curves(*part("core.channels").find_playing_action(rig)))
    bend(scene, start(rig), part)
    now = part("core.channels").collect_curves(*part("core.channels").find_playing_action(rig))
    bones = {path.split('"')[1] for path, _ in set(now) - original}
    legs = {f"{bone}_{side}" for bone in ("thigh", "calf", "foot") for side in "lr"}
    assert {"pelvis"} <= bones and not bones & legs
    assert all("influence" not in path for path, _ in now)


def test_one_root_carries_all_where_it_travels(part, recorded):
    rig = recorded(rigs.create_unreal, root="SMOOTH")
    channels, scene = part("core.channels"), bpy.context.scene
    action, slot = channels.find_playing_action(rig)
    before = {place: channels.read_keys(curve)["co"] for place, curve in channels.collect_curves(action, slot).items()}
    bend(scene, start(rig, plant=False, lean=False), part)
    now = channels.collect_curves(*channels.find_playing_action(rig))
    changed = {path for (path, i), curve in now.items()
               if (path, i) not in before or not np.array_equal(channels.read_keys(curve)["co"], before[path, i])}
    assert {path.split('"')[1] for path in changed} == {"root"}


def test_one_that_is_hidden_or_shown_at_rest_rides_as_it_would_be_posed(part, ride):
    rig = path_edit_rigs.create_ik_rig()
    posed = ride(rig, bent=True)[1].motion.root_positions
    part("path_editing.edited_bodies").revert_path_edit(rig)
    rig.data.pose_position, rig.hide_viewport = "REST", True
    np.testing.assert_allclose(ride(rig, bent=True)[1].motion.root_positions, posed, atol=1e-6)
    assert rig.data.pose_position == "REST" and rig.hide_viewport and len(bpy.data.scenes) == 1


def test_motions_that_are_faster_slower_longer_and_shorter(core, part, recorded, ride):
    rig = path_edit_rigs.create_ik_rig()
    for settings in ({"speed": 0.8}, {"speed": 2.0}, {"delay": 0.5}, {"by_arc_length": False}):
        read, ridden = ride(rig, bent=True, **settings)
        assert max(off(core, rig, read, ridden).values()) < 5.0
    read, ridden = ride(rig, bent=False, plant=False, lean=False)
    assert max(off(core, rig, read, ridden).values()) < 0.1  # all that was written before is as it was again


def test_what_cannot_ride_is_said(part, recorded, tmp_path):
    scene = bpy.context.scene
    rig = path_edit_rigs.create_ik_rig()
    choose(rig)
    action = rig.animation_data.action
    rig.animation_data.action = None
    refuses(bpy.ops.beyond_mocap.edit_path, "plays no action")
    rig.animation_data.action = action
    rig.scale = (1.0, 2.0, 1.0)
    refuses(bpy.ops.beyond_mocap.edit_path, "one positive scale")
    rig.scale = (1.0, 1.0, 1.0)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    choose(camera)
    refuses(bpy.ops.beyond_mocap.edit_path, "armature")
    bpy.data.libraries.write(str(tmp_path / "rig.blend"), {rig})
    with bpy.data.libraries.load(str(tmp_path / "rig.blend"), link=True) as (theirs, mine):
        mine.objects = [rig.name]
    linked = mine.objects[0]
    scene.collection.objects.link(linked)
    bpy.context.view_layer.update()
    choose(linked)
    refuses(bpy.ops.beyond_mocap.edit_path, "linked")
    own = linked.override_create()
    scene.collection.objects.link(own)
    bpy.context.view_layer.update()
    was = shown(own, [5, 30], ["pelvis"])
    bend(scene, start(own), part)
    assert np.abs(shown(own, [5, 30], ["pelvis"]) - was).max() > 1.0
    assert not rig.beyond_mocap_ride.on
