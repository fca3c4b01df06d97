"""The settings of the panel "Rig & Export": the rig, its bone map, baking and export; saved with the scene."""

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
    ("KEEP", "None", "The hips carry the whole motion; a root bone stays at rest"),
    ("SMOOTH", "Smooth", "The root bone follows and turns with the body; the hips keep the sway"),
    ("STRAIGHT", "Straight", "The root bone moves in a straight line from the start of the motion to its end"),
    ("IN_PLACE", "In Place", "The body stays at its start position and heading; the hips keep the sway"),
)
STEPS = (
    ("AUTO", "Automatic", "Footprints for similar legs (80 to 125 %), else steps in proportion"),
    ("KEEP", "Footprints", "Keep the source's footprints, so that the body stays on its track and meets the ball"),
    ("SCALE", "Proportion", "Scale steps and path with the legs: a child takes shorter steps and travels less"),
)
IK = (
    ("MUTE", "Switch Off", "Switch off constraints on driven bones by a key (influence 0); IK targets stay at rest"),
    ("BAKE", "Bake Targets", "Bake IK targets and poles to follow hands, feet, knees and elbows, so that IK and FK can "
     "both be used; constraints stay on"),
)
FORMATS = (("FBX", "FBX", "Autodesk FBX (.fbx)"), ("GLB", "glTF", "glTF binary (.glb), always Y up"),
           ("USD", "USD", "Universal Scene Description (.usdc)"),
           ("BVH", "BVH", "Biovision hierarchy (.bvh): the skeleton alone, centimetres, Y up"),
           ("ABC", "Alembic", "Alembic (.abc): meshes that move point by point, without bones"))
"""In the order that saved files number them."""
ENGINES = (("BLENDER", "Blender", "Axes of Blender's exporters: Y up, -Z forward"),
           ("UNREAL", "Unreal", "For Unreal Engine: FBX in centimetres, X forward, Z up"),
           ("UNITY", "Unity", "For Unity: FBX with its scale as units, Y up, -Z forward"),
           ("GODOT", "Godot", "For Godot: Y up, -Z forward, in USD too"))
KEEP_ROOT = ("Add the joints that the library's recordings have above the hips, such as a root: in BVH files where "
             "they stood or below the body, in others standing still")
EXPORT_CHOICES = (("ACTIVE", "Active", "The active player's rig or body; without players the active armature"),
                  ("SELECTED", "Selected", "All selected armatures"),
                  ("PLAYERS", "All Players", "The rig or body of every selected player"))
ENGINE_PRESETS = (
    ("UNREAL", "Unreal Engine", "FBX in centimetres, Z up, the root bone as the skeleton's root"),
    ("UNITY", "Unity", "FBX with its scale as units, Y up"),
    ("GODOT", "Godot", "glTF binary, metres, Y up"),
    ("USD", "USD", "Universal Scene Description with meshes and skeletons"),
    ("ALEMBIC", "Alembic", "Meshes that move point by point, for any renderer"),
)
ENGINE_ROOTS = tuple(item for item in ROOTS if item[0] != "STRAIGHT")
DELIVERIES = (("ACTIVE", "Active Player", "The active player; without players the active armature"),
              ("PLAYERS", "Selected Players", "Every selected player of the list, one file for each"),
              ("MATCH", "Match", "Every player of the displayed match, one file for each"),
              ("SCENE", "Whole Scene", "Everything visible, in one file of USD, Alembic or glTF"))


class BeyondMocapRigBone(bpy.types.PropertyGroup):
    """A line of the bone map; its name is the part of the body"""

    bone: StringProperty(name="Bone",
                         description="Bone or control that moves this part; empty for none")


def fill_bone_map(settings: "BeyondMocapRig", ignores_stored: bool = False) -> str:
    """Map the bones of the chosen rig: the map stored for its skeleton, else by names and structure (always, if
    `ignores_stored`).

    Returns:
        Where the map came from, as text.
    Raises:
        InputError: if no map is found.
    """
    from . import bone_maps

    rig = settings.target
    stored = None if ignores_stored else bone_maps.load_stored_map(rig)
    table = stored or bone_maps.find_bone_map(rig)
    show_bone_map(settings, table)
    return "from the map stored for this skeleton" if stored else "by names and structure"


def show_bone_map(settings: "BeyondMocapRig", table: dict[str, str]) -> None:
    """Show a map in the list."""
    from .bone_maps import PARTS

    settings.bones.clear()
    for part in PARTS:
        line = settings.bones.add()
        line.name, line.bone = part, table.get(part, "")


def read_bone_list(settings: "BeyondMocapRig") -> dict[str, str]:
    """Read the map from the list."""
    return {line.name: line.bone for line in settings.bones if line.bone}


def _on_rig_chosen(settings, _context) -> None:
    """Map the bones of a newly chosen rig."""
    settings.bones.clear()
    settings.messages = ""
    if settings.target is not None:
        try:
            settings.messages = f"Bones mapped {fill_bone_map(settings)}"
        except BeyondMocapError as error:
            settings.messages = str(error)


class BeyondMocapRig(bpy.types.PropertyGroup):
    """Rig, bone map, baking and export"""

    source: PointerProperty(name="Source", type=bpy.types.Object, poll=lambda _, thing: thing.type == "ARMATURE",
                            description="Armature whose motion is baked; empty uses the active player's body")
    target: PointerProperty(
        name="Rig", type=bpy.types.Object, poll=lambda _, thing: thing.type == "ARMATURE", update=_on_rig_chosen,
        description="Rig that the motion is baked to: Rigify, Mixamo, Unreal, MetaHuman or any humanoid",
    )
    bones: CollectionProperty(type=BeyondMocapRigBone, description="Bones of the rig by part of the body")
    active_bone: IntProperty(name="Part", min=0, description="Active row of the list")
    messages: StringProperty(options={"HIDDEN"}, description="Messages of the last step")
    root: EnumProperty(name="Root Motion", items=ROOTS, default="KEEP", description="Motion of the root bone")
    steps: EnumProperty(name="Steps", items=STEPS, default="AUTO", description="Steps of legs with a different length")
    ik: EnumProperty(name="IK", items=IK, default="BAKE", description="Treatment of inverse kinematics on the rig")
    plants: BoolProperty(name="Plant Feet", default=True,
                         description="Plant feet in contact on the ground with the rig's own legs")
    reduces: BoolProperty(name="Simplify Keys", default=False, description="Remove keys that the curves do not need")
    tolerance: FloatProperty(name="Distance", default=0.002, min=0.0001, max=0.1, precision=4, unit="LENGTH",
                             subtype="DISTANCE",
                             description="Distance that hands, feet and head may be off after keys are removed")
    turn_tolerance: FloatProperty(name="Angle", default=0.00872665, min=0.0001, max=0.5, subtype="ANGLE",
                                  description="Angle that a bone may be off after keys are removed")
    format: EnumProperty(name="Format", items=FORMATS, default="FBX", description="File format to export")
    engine: EnumProperty(name="For", items=ENGINES, default="BLENDER", description="Program to export for")
    who: EnumProperty(name="Export", items=EXPORT_CHOICES, default="ACTIVE", description="Armatures to export")
    own_rate: BoolProperty(name="Take Rate", default=False,
                           description="Export at the frame rate of the take instead of the scene's")
    deform_only: BoolProperty(name="Deform Bones Only", default=True,
                              description="Leave controls and helper bones out of the file")
    meshes: BoolProperty(name="Meshes", default=True, description="Also export the meshes that the armature moves")
    keep_root: BoolProperty(name="Recorded Root", default=False, description=KEEP_ROOT)
