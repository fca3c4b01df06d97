"""What the panel "Rig & Export" shows: the rig, its bone map, how to bake and how to export; saved with the scene."""

from __future__ import annotations

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ...beyond_mocap.base.errors import BeyondMocapError

ROOTS = (
    ("KEEP", "None", "The hips carry all of the motion; a root bone stays where it rests"),
    ("SMOOTH", "Smooth", "The root bone follows the body over the ground and turns with it; the hips keep the sway"),
    ("STRAIGHT", "Straight", "The root bone goes in a straight line from where the motion begins to where it ends"),
    ("IN_PLACE", "In Place", "The body stays where it begins and does not turn away; the hips keep the sway"),
)
STEPS = (
    ("AUTO", "Automatic", "Footprints where the legs are alike (80 to 125 %), else steps in proportion"),
    ("KEEP", "Footprints", "Feet stand where the source's stand, so that the body is on its track and meets the ball"),
    ("SCALE", "Proportion", "Steps and way in proportion to the legs: a child takes shorter steps and gets less far"),
)
IK = (
    ("MUTE", "Switch Off", "Constraints that hold driven bones are switched off by a key (influence 0)"),
    ("BAKE", "Bake Targets", "IK targets and poles follow hands, feet, knees and elbows; constraints stay as they are"),
)
FORMATS = (("FBX", "FBX", "Autodesk FBX (.fbx)"), ("GLB", "glTF", "glTF binary (.glb), always Y up"),
           ("USD", "USD", "Universal Scene Description (.usdc)"),
           ("BVH", "BVH", "Biovision hierarchy (.bvh): the skeleton alone, centimetres, Y up"))
ENGINES = (("BLENDER", "Blender", "Axes as Blender's exporters have them: Y up, -Z forward"),
           ("UNREAL", "Unreal", "For Unreal Engine: FBX in centimetres, X forward, Z up"),
           ("UNITY", "Unity", "For Unity: FBX with its scale as units, Y up, -Z forward"),
           ("GODOT", "Godot", "For Godot: Y up, -Z forward, in USD too"))
WHO = (("ACTIVE", "Active", "The active player's rig, else body; without players the active armature"),
       ("SELECTED", "Selected", "All selected armatures"),
       ("PLAYERS", "All Players", "The rig, else the body, of every ticked player"))


class BeyondMocapRigBone(bpy.types.PropertyGroup):
    """A line of the bone map; its name is the part of the body."""

    bone: StringProperty(name="Bone",
                         description="The bone, or control, that moves this part; empty where there is none")


def fill(settings: "BeyondMocapRig", again: bool = False) -> str:
    """Map the bones of the chosen rig: the map kept for its skeleton, else by names and structure (always, if `again`).

    Returns where the map came from. InputError where nothing is found."""
    from . import bone_maps

    rig = settings.target
    kept = None if again else bone_maps.kept(rig)
    table = kept or bone_maps.suggest(rig)
    show(settings, table)
    return "as kept for this skeleton" if kept else "by names and structure"


def show(settings: "BeyondMocapRig", table: dict[str, str]) -> None:
    """Put a map into the list."""
    from .bone_maps import PARTS

    settings.bones.clear()
    for part in PARTS:
        line = settings.bones.add()
        line.name, line.bone = part, table.get(part, "")


def table_of(settings: "BeyondMocapRig") -> dict[str, str]:
    """The map as the list shows it."""
    return {line.name: line.bone for line in settings.bones if line.bone}


def _chosen(settings, _context) -> None:
    """A rig was picked: its bones are mapped at once."""
    settings.bones.clear()
    settings.told = ""
    if settings.target is not None:
        try:
            settings.told = f"Bones mapped {fill(settings)}"
        except BeyondMocapError as error:
            settings.told = str(error)


class BeyondMocapRig(bpy.types.PropertyGroup):
    """Rig, map, baking, export."""

    source: PointerProperty(name="Source", type=bpy.types.Object, poll=lambda _, thing: thing.type == "ARMATURE",
                            description="The armature whose motion is baked; empty takes the active player's body")
    target: PointerProperty(
        name="Rig", type=bpy.types.Object, poll=lambda _, thing: thing.type == "ARMATURE", update=_chosen,
        description="The rig that the motion is baked to: Rigify, Mixamo, Unreal, MetaHuman or any humanoid",
    )
    bones: CollectionProperty(type=BeyondMocapRigBone, description="Which bone of the rig is which part of the body")
    active_bone: IntProperty(name="Part", min=0, description="The row that is chosen in the list")
    told: StringProperty(options={"HIDDEN"}, description="What the last step said")
    root: EnumProperty(name="Root Motion", items=ROOTS, default="KEEP", description="What the root bone carries")
    steps: EnumProperty(name="Steps", items=STEPS, default="AUTO", description="What legs of another length do")
    ik: EnumProperty(name="IK", items=IK, default="MUTE", description="What becomes of inverse kinematics on the rig")
    plants: BoolProperty(name="Plant Feet", default=True,
                         description="Hold standing feet on the ground with the rig's own legs")
    reduces: BoolProperty(name="Fewer Keys", default=False, description="Leave out keys that the curves do not need")
    tolerance: FloatProperty(name="Off by", default=0.002, min=0.0001, max=0.1, precision=4, unit="LENGTH",
                             subtype="DISTANCE",
                             description="Distance that hands, feet and head may be off after keys are left out")
    turn_tolerance: FloatProperty(name="Turned by", default=0.00872665, min=0.0001, max=0.5, subtype="ANGLE",
                                  description="Angle that a bone may be off after keys are left out")
    format: EnumProperty(name="Format", items=FORMATS, default="FBX", description="File format to export")
    engine: EnumProperty(name="For", items=ENGINES, default="BLENDER", description="Whose axes and units")
    who: EnumProperty(name="Who", items=WHO, default="ACTIVE", description="What is exported")
    own_rate: BoolProperty(name="Own Rate", default=False,
                           description="At the rate that was synthesized instead of the scene's")
    deform_only: BoolProperty(name="Deform Bones Only", default=True,
                              description="Leave controls and helper bones out of the file")
    meshes: BoolProperty(name="Meshes", default=True, description="Export the meshes that the armature moves, too")
