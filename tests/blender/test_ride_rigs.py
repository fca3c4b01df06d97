"""Path editing on armatures of every kind: their own path changes nothing, another one is gone to the millimetre by the
bones that are seen, what was before comes back, and what cannot be done is said."""

import importlib

import bpy
import numpy as np
import pytest
import ride_rigs
import rigs
from test_ride import SAMPLE, bits, choose
from test_rigs import rigify  # noqa: F401  (a fixture)

STEP = 6


@pytest.fixture
def part(extension):
    return lambda name: importlib.import_module(f"{extension.__name__}.scene.{name}")


@pytest.fixture
def recorded(part, core):
    """Two seconds of a recorded jog with a turn, on an armature of its own."""
    bpy.context.scene.render.fps = 30
    clip = core("files.bvh").read(SAMPLE / "jogging_turn_left.bvh").motion
    clip = core("motion.motion").resample(clip, 30.0).frames(0, 60)

    def make(onto=None, **wishes):
        scene = bpy.context.scene
        body = part("armature").create(bpy.context, clip.skeleton, "Body")
        part("action").write(body, clip, scene, ride_rigs.START)
        if onto is None:
            return body
        rig = onto() if callable(onto) else rigs.rigify(onto)
        bake = part("rig_bake")
        bake.bake(rig, part("bone_maps").suggest(rig), bake.source_of(body, scene), scene, bake.Wishes(**wishes))
        bpy.data.objects.remove(body)
        return rig

    return make


@pytest.fixture
def ride(part, core):
    """Put an armature on its own path, or on a bent one, as Edit Path does. Gives the carrier's reading and the ridden."""

    def go(rig, bent, **settings):
        scene, recipe = bpy.context.scene, core("ride")
        wanted = recipe.RideSettings(**settings)
        carrier = part("ride.carrier").carrier_of(rig)
        carrier.check()
        read = carrier.read(scene)
        source = recipe.prepare(read.motion, wanted, read.standing)
        path = source.path
        if bent:
            along = np.linspace(0.0, 1.0, 80)
            line = np.column_stack([3.0 + 1.2 * source.arc.length * along, 1.2 * np.sin(4.0 * along), 0.0 * along])
            path = core("polish.path_line").through(line, "bent")
        ridden = recipe.ride(source, path, wanted)
        if not rig.beyond_mocap_ride.on:
            carrier.begin()
            rig.beyond_mocap_ride.on = True
        carrier.write(scene, read, ridden, "a digest")
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
    bones = list(read.rig.carried.parts.shown.values())
    places = core("motion.motion").forward_kinematics(ridden.motion)[0][rows]
    seen = shown(rig, read.first + rows, bones)[..., :3, 3]
    return dict(zip(read.rig.carried.parts.shown, 1000 * np.linalg.norm(seen - places, axis=-1).max(axis=0)))


def tuned(rig, part, path, value=0.0):
    """A property of the rig set, its curve gone."""
    action, slot = part("channels").playing(rig)
    for (where, _), curve in part("channels").curves(action, slot).items():
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
    return ride_rigs.walk_ik()


def hand_rig_of_few_keys(recorded, part, _):
    return ride_rigs.walk_ik(every=6, interpolation="BEZIER")


def without_root(recorded, part, _):
    return ride_rigs.walk_ik(root=False, cog=False)


def unreal_root_travels(recorded, part, _):
    return recorded(rigs.unreal, root="SMOOTH", bakes_ik=True)


def unreal_root_stays(recorded, part, _):
    return recorded(rigs.unreal, bakes_ik=True)


def odd_modes(recorded, part, _):
    def make():
        rig = rigs.mixamo()
        for number, bone in enumerate(rig.pose.bones):
            bone.rotation_mode = ("XYZ", "AXIS_ANGLE", "ZYX", "QUATERNION", "YXZ")[number % 5]
        return rig

    rig = recorded(make)
    rig.constraints.new("LIMIT_SCALE")  # so that it is no plain one
    return rig


def moved_object(recorded, part, _):
    return ride_rigs.onto_object(recorded(), part("channels"))


def moved_object_under_moved_empty(recorded, part, _):
    rig = ride_rigs.onto_object(recorded(), part("channels"))
    ride_rigs.under_empty(rig)
    rig.delta_location, rig.delta_rotation_euler = (0.3, 0.2, 0.1), (0.0, 0.0, 0.4)
    return rig


def under_scaled_empty(recorded, part, _):
    rig = recorded()
    ride_rigs.under_empty(rig, 2.0)
    rig.scale = (0.5, 0.5, 0.5)
    return rig


def strips(recorded, part, _):
    return ride_rigs.onto_strip(recorded(), scale=1.3)


def cyclic(recorded, part, _):
    rig = ride_rigs.walk_ik(frames=31)
    ride_rigs.cycled(rig, part("channels"))
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 5, 70
    return rig


KINDS = [rigify_fk, rigify_ik, hand_rig, hand_rig_of_few_keys, without_root, unreal_root_travels, unreal_root_stays, odd_modes,
         moved_object, moved_object_under_moved_empty, under_scaled_empty, strips, cyclic]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_its_own_path_changes_nothing_and_another_is_gone_to_the_millimetre(core, part, recorded, ride, rigify, kind):  # noqa: F811
    rig = kind(recorded, part, rigify)
    bpy.context.view_layer.update()
    before = whole(part, rig)
    carrier = part("ride.carrier").carrier_of(rig)
    assert type(carrier).__name__ == "RigCarrier"
    count = len(carrier.read(bpy.context.scene).motion)
    assert whole(part, rig) == before  # looking changes nothing
    frames = np.arange(0, count, STEP)
    first = carrier.read(bpy.context.scene).first
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
    part("ride.riders").end(rig)
    bpy.context.scene.frame_set(1)
    assert whole(part, rig) == before


def whole(part, rig):
    """All that an armature plays and how it stands, on frame 1."""
    bpy.context.scene.frame_set(1)
    data = rig.animation_data
    tracks = [(track.name, track.mute, [strip.name for strip in track.strips]) for track in data.nla_tracks]
    stands = [(tuple(b.location), tuple(b.rotation_quaternion), tuple(b.rotation_euler), b.rotation_mode) for b in rig.pose.bones]
    keys = bits(part, rig)[:3] if data.action is not None else None
    return keys, tracks, data.use_nla, stands, [tuple(row) for row in rig.matrix_world], len(bpy.data.scenes)
