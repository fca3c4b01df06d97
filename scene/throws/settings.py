"""Settings in the panel "Throws & Kicks", and the throw that an armature stores; saved with the file."""

import bpy
from bpy.props import BoolProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from ..core.properties import with_settings
from ..result.result import BeyondMocapBefore

DEFAULT_BALLS = {"throw": "baseball", "kick": "football"}
LIMBS = {"throw": "hand", "kick": "foot"}
MARK = "beyond_mocap_thrown"  # custom property of data created for a throw; no property group has its name


@with_settings("throw", "throw.ball")
class BeyondMocapThrow(bpy.types.PropertyGroup):
    """Settings of an armature's throw or kick, and its result."""

    attached_to = ("Object.beyond_mocap_throw",)

    target: PointerProperty(name="Target", type=bpy.types.Object,
                            description="Object whose origin the ball has to hit; if empty, the 3D cursor")
    ball: PointerProperty(name="Ball", type=bpy.types.Object, poll=lambda _own, thing: thing.type in {"MESH", "EMPTY"},
                          description="Ball to throw, or to kick from where it is; if empty, a ball is created")
    throw_model: StringProperty(
        name="Throw Model", subtype="FILE_PATH",
        description="Trained model (.npz) of throws; if empty, the included one of synthetic throws, which does not "
        "follow recorded pitches closely",
    )
    kick_model: StringProperty(
        name="Kick Model", subtype="FILE_PATH",
        description="Trained model (.npz) of kicks; if empty, the included one of synthetic kicks, which follows "
        "recorded kicks to 13 to 16 cm only; the word recorded chooses the included one of five recorded kicks",
    )
    made_of: StringProperty(name="Settings Digest", options={"HIDDEN"},
                            description="Settings that the preview was generated with")
    asked: IntProperty(name="Requested Frame", options={"HIDDEN"}, description="Requested frame of the release")
    made: StringProperty(name="Action", options={"HIDDEN"}, description="Throw or kick in preview; empty without one")
    rigged: BoolProperty(name="On Rig", options={"HIDDEN"}, description="The preview is on the controls of a rig")
    release: FloatProperty(name="Release", options={"HIDDEN"}, description="Scene frame on which the ball leaves")
    figures: StringProperty(name="Figures", options={"HIDDEN"}, description="Figures of the preview, one per line")
    messages: StringProperty(name="Messages", options={"HIDDEN"}, description="Status and warnings")
    before: PointerProperty(type=BeyondMocapBefore, description="Animation of the armature before the preview")
    flown: PointerProperty(name="Flying Ball", type=bpy.types.Object, options={"HIDDEN"},
                           description="Ball of the preview")
    hold: StringProperty(name="Hold", options={"HIDDEN"}, description="Range in which the hand holds the ball")
    ball_before: PointerProperty(type=BeyondMocapBefore, description="Animation of the ball before the preview")
    curve: PointerProperty(name="Trajectory", type=bpy.types.Object, description="Curve of the ball's trajectory")


def find_thrower(context: bpy.types.Context) -> bpy.types.Object | None:
    """Find the armature to animate: the active object, a selected one, or the one whose ball or target is active."""
    active = context.view_layer.objects.active
    selected = [thing for thing in (active, *context.selected_objects) if thing is not None and thing.type
                == "ARMATURE"]
    if selected or active is None:
        return selected[0] if selected else None
    bodies = [thing for thing in context.scene.objects if thing.type == "ARMATURE" and thing.beyond_mocap_throw.made]
    return next((body for body in bodies if active in (body.beyond_mocap_throw.flown, body.beyond_mocap_throw.target)),
                None)
