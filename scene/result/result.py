"""A player's present result, and what its preview replaced: saved with the file, and part of undo."""

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, IntProperty, PointerProperty, StringProperty

STATES = (("NONE", "None", "No result"),
          ("PREVIEW", "Preview", "A take is shown; Apply keeps it, Revert restores the previous state"),
          ("ACCEPTED", "Applied", "A take is applied"))


class BeyondMocapBefore(bpy.types.PropertyGroup):
    """The animation of an object that a preview replaced."""

    kept: BoolProperty(description="Whether anything is stored here")
    made: BoolProperty(description="Whether the preview created the object itself")
    animated: BoolProperty(description="Whether the object had animation data")
    action: PointerProperty(type=bpy.types.Action, description="The action that it played")
    slot: StringProperty(description="The identifier of that action's slot")
    use_nla: BoolProperty(default=True, description="Whether its NLA tracks were played")
    influence: bpy.props.FloatProperty(default=1.0, description="The influence of its action")
    blend: StringProperty(default="REPLACE", description="How its action was blended with its NLA tracks")
    extrapolation: StringProperty(default="HOLD", description="How its action was extrapolated")
    stance: StringProperty(description="The pose of object and bones as JSON")


class BeyondMocapVariant(bpy.types.PropertyGroup):
    """One of several takes to choose from; its name is the take's."""

    quality: StringProperty(description="Figures of the take")
    moments: StringProperty(description="Its key moments")
    warnings: StringProperty(description="Its warnings")
    recipe: StringProperty(description="The steps to reproduce it, as JSON")
    summary: StringProperty(description="Its main figures")


class BeyondMocapResult(bpy.types.PropertyGroup):
    """A player's result. The fields below `state` store what the preview replaced."""

    state: EnumProperty(name="Result", items=STATES, default="NONE", description="State of this player's result")
    recipe: StringProperty(description="The steps to reproduce the newest take, as JSON")
    made_of: StringProperty(description="Fingerprints of the inputs of the newest take, as JSON")
    hand_keys: IntProperty(description="Number of manual keys that the newest take has kept")
    variants: CollectionProperty(type=BeyondMocapVariant, description="Alternative solutions")
    body: PointerProperty(type=bpy.types.Object, description="The player's body before the preview")
    motion: PointerProperty(type=BeyondMocapBefore, description="The animation of the body before the preview")
    track: PointerProperty(type=bpy.types.Curve, description="The track on the ground before the preview")
    mesh_made: BoolProperty(description="Whether the preview created the body's mesh")
    track_made: BoolProperty(description="Whether the preview created the track")
    was_accepted: BoolProperty(description="Whether a result was applied before the preview")
    take: StringProperty(description="The take before the preview")
    quality: StringProperty(description="Figures of that take")
    moments: StringProperty(description="Key moments of that take")
    warnings: StringProperty(description="Warnings of that take")
    recipe_before: StringProperty(description="The steps to reproduce that take")
    made_of_before: StringProperty(description="Fingerprints of the inputs of that take")


class BeyondMocapShared(bpy.types.PropertyGroup):
    """What the previews of all players share: the ball, the stage's camera, the scene's length."""

    ball: PointerProperty(type=BeyondMocapBefore, description="The animation of the ball before any preview")
    camera: PointerProperty(type=BeyondMocapBefore, description="The animation of the camera's focus before any "
                            "preview")
    end_before: IntProperty(description="The scene's last frame before any preview")
    end_set: IntProperty(description="The scene's last frame set by previews; 0 if unchanged")
