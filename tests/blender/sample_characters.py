"""Characters as other programs make them: the rigs of `sample_rigs` with a skinned mesh in several materials."""

import importlib

import bpy
import numpy as np
from mathutils import Vector

MATERIALS = ("Skin", "Jersey", "Shorts", "Socks", "Boots", "Hair")


def add_mesh(rig, extension, table=None, name="Mesh"):
    """A skinned mesh on an armature, in its own units and axes: a body of usual proportions for its bones."""
    rooms = {one: importlib.import_module(f"{extension}.{one}")
             for one in ("scene.rigs.driven", "scene.rigs.bone_maps", "beyond_mocap.appearance.body",
                         "beyond_mocap.motion.quaternion")}
    driven = rooms["scene.rigs.driven"].DrivenRig(rig, table or rooms["scene.rigs.bone_maps"].find_bone_map(rig),
                                                  bpy.context.scene)
    body = rooms["beyond_mocap.appearance.body"].build_body(driven.skeleton)
    turn = rooms["beyond_mocap.motion.quaternion"]
    hips = driven.rest_heads("hips")[0]
    points = turn.rotate(turn.inverse(driven.upright), body.vertices) / driven.placement.scale + hips
    data = bpy.data.meshes.new(name)
    data.from_pydata(points.tolist(), [], body.faces)
    data.polygons.foreach_set("material_index", np.asarray(body.material, np.int32))
    data.polygons.foreach_set("use_smooth", np.ones(len(body.faces), bool))
    for part in MATERIALS:
        material = bpy.data.materials.new(part)
        material.use_nodes = True
        data.materials.append(material)
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    for joint, part in enumerate(driven.parts):
        bone = find_deform_bone(rig, driven.find_bone(part))
        group = thing.vertex_groups.get(bone) or thing.vertex_groups.new(name=bone)
        weights = np.sum(np.where(body.joints == joint, body.weights, 0.0), axis=1)
        for weight in np.unique(weights[weights > 1e-6]):
            group.add(np.flatnonzero(weights == weight).tolist(), float(weight), "ADD")
    thing.parent = rig
    thing.modifiers.new("Armature", "ARMATURE").object = rig
    return thing


def find_deform_bone(rig, control):
    """The deform bone at a control's place: a control rig's meshes are on other bones than its controls."""
    bones = rig.data.bones
    if bones[control].use_deform:
        return control
    at = Vector(bones[control].head_local)
    return min((bone for bone in bones if bone.use_deform), key=lambda bone: (Vector(bone.head_local) - at).length).name
