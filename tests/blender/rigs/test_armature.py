"""A skeleton becomes an armature and comes back the same."""

import importlib

import bpy
import numpy as np
import pytest
import synthetic_motion


@pytest.fixture
def armature(extension):
    return importlib.import_module(f"{extension.__name__}.scene.rigs.armature")


def assert_same(a, b, tolerance):
    assert a.names == b.names and a.parents == b.parents and a.end_parents == b.end_parents
    np.testing.assert_allclose(a.offsets, b.offsets, atol=tolerance)
    np.testing.assert_allclose(a.end_offsets, b.end_offsets, atol=tolerance)


def test_there_and_back_is_exact(core, armature):
    skeleton = synthetic_motion.build_skeleton(core)
    body = armature.create_armature(bpy.context, skeleton, "Body")
    assert_same(armature.build_skeleton(body, bpy.context.scene), skeleton, 0.0)


def test_from_bones_alone(core, armature):
    skeleton = synthetic_motion.build_skeleton(core)
    body = armature.create_armature(bpy.context, skeleton, "Body")
    del body.data[armature.SKELETON_PROPERTY]
    derived = armature.build_skeleton(body, bpy.context.scene)
    order = [derived.names.index(name) for name in skeleton.names]
    np.testing.assert_allclose(derived.offsets[order], skeleton.offsets, atol=5e-7)
    assert [derived.names[derived.parents[i]] for i in order[1:]] == [skeleton.names[p] for p in skeleton.parents[1:]]
    ends = {derived.names[p]: offset for p, offset in zip(derived.end_parents, derived.end_offsets)}
    for parent, offset in zip(skeleton.end_parents, skeleton.end_offsets):
        np.testing.assert_allclose(ends[skeleton.names[parent]], offset, atol=5e-7)


def test_edited_bones_count_more_than_what_was_kept(core, armature):
    body = armature.create_armature(bpy.context, synthetic_motion.build_skeleton(core), "Body")
    with armature._edit_mode(bpy.context, body):
        body.data.edit_bones["LeftLeg"].head.z -= 0.05
    changed = armature.build_skeleton(body, bpy.context.scene)
    np.testing.assert_allclose(changed.offsets[changed.index("LeftLeg")], [0.01, 0, -0.46], atol=1e-6)


@pytest.mark.parametrize("scale_length", (0.01, 0.3048, 1.0))
def test_unit_scale(core, armature, scale_length):
    skeleton = synthetic_motion.build_skeleton(core)
    bpy.context.scene.unit_settings.scale_length = scale_length
    body = armature.create_armature(bpy.context, skeleton, "Body")
    knee = body.data.bones["LeftLeg"].head_local - body.data.bones["LeftUpLeg"].head_local
    assert knee.length * scale_length == pytest.approx(np.linalg.norm([0.01, 0, 0.41]), rel=1e-5)
    assert_same(armature.build_skeleton(body, bpy.context.scene), skeleton, 0.0)
    assert min(min(b.head_local.z, b.tail_local.z) for b in body.data.bones) == pytest.approx(
        0, abs=1e-5 / scale_length
    )


def test_scaled_object(core, armature):
    skeleton = synthetic_motion.build_skeleton(core)
    body = armature.create_armature(bpy.context, skeleton, "Body")
    body.scale = (2, 2, 2)
    np.testing.assert_allclose(armature.build_skeleton(body, bpy.context.scene).offsets, 2 * skeleton.offsets,
                               atol=1e-6)
    body.scale = (2, 1, 1)
    with pytest.raises(core("base.errors").InputError, match="Ctrl-A"):
        armature.build_skeleton(body, bpy.context.scene)


def test_the_active_object_and_its_mode_stay(core, armature):
    mesh = bpy.data.objects.new("Mesh", bpy.data.meshes.new("Mesh"))
    bpy.context.scene.collection.objects.link(mesh)
    bpy.context.view_layer.objects.active = mesh
    bpy.ops.object.mode_set(mode="EDIT")
    armature.create_armature(bpy.context, synthetic_motion.build_skeleton(core), "Body")
    assert bpy.context.view_layer.objects.active == mesh and mesh.mode == "EDIT"


def test_not_an_armature(core, armature):
    with pytest.raises(core("base.errors").InputError, match="select one"):
        armature.build_skeleton(None, bpy.context.scene)


def test_fingers_are_kept_but_not_displayed(core, armature):
    plain = synthetic_motion.build_skeleton(core)
    left, count = plain.index("LeftForeArm"), len(plain)
    skeleton = core("motion.skeleton").Skeleton(
        (*plain.names, "LeftHand", "LeftThumb1"), (*plain.parents, left, count),
        np.vstack([plain.offsets, [[0.0, 0.0, -0.25], [0.03, 0.0, -0.03]]]),
        (*(parent for parent in plain.end_parents if parent != left), count + 1),
        np.vstack([[offset for parent, offset in zip(plain.end_parents, plain.end_offsets) if parent != left],
                   [[0.02, 0.0, -0.01]]]))
    body = armature.create_armature(bpy.context, skeleton, "Body")
    hidden = {bone.name for bone in body.data.bones if bone.collections
              and not any(one.is_visible for one in bone.collections)}
    assert hidden == {"LeftThumb1"}
    assert_same(armature.build_skeleton(body, bpy.context.scene), skeleton, 0.0)
