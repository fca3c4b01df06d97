"""What a player's result is just now, and what it took the place of: saved, and known to undo."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, IntProperty, PointerProperty, StringProperty

STATES = (("NONE", "None", "Nothing has been made"),
          ("PREVIEW", "Preview", "A take is shown; Accept keeps it, Discard brings back what was there"),
          ("ACCEPTED", "Accepted", "A take has been kept"))


class BeyondMocapBefore(bpy.types.PropertyGroup):
    """What an object played before a preview took its place."""

    kept: BoolProperty(description="Whether anything is kept here")
    made: BoolProperty(description="Whether the object itself was made by the preview")
    animated: BoolProperty(description="Whether the object had animation data")
    action: PointerProperty(type=bpy.types.Action, description="The action that it played")
    slot: StringProperty(description="The identifier of that action's slot")
    use_nla: BoolProperty(default=True, description="Whether its NLA tracks were played")
    influence: bpy.props.FloatProperty(default=1.0, description="The influence of its action")
    blend: StringProperty(default="REPLACE", description="How its action was blended with its NLA tracks")
    extrapolation: StringProperty(default="HOLD", description="What its action did beyond its ends")
    stance: StringProperty(description="How it stood, object and bones, as JSON")


class BeyondMocapVariant(bpy.types.PropertyGroup):
    """One of several takes to choose from; its name is the take's."""

    quality: StringProperty(description="Lines about the take")
    moments: StringProperty(description="Lines about its key moments")
    warnings: StringProperty(description="Warnings about it")
    recipe: StringProperty(description="The steps that make it again, as JSON")
    summary: StringProperty(description="Its figures in a few words")


class BeyondMocapResult(bpy.types.PropertyGroup):
    """A player's result. The fields behind `state` say what was there before the preview."""

    state: EnumProperty(name="Result", items=STATES, default="NONE", description="How far this player's result is")
    recipe: StringProperty(description="The steps that make the newest take again, as JSON")
    made_of: StringProperty(description="Fingerprints of what the newest take was made of, as JSON")
    hand_keys: IntProperty(description="How many hand-made keys the newest take has kept")
    variants: CollectionProperty(type=BeyondMocapVariant, description="Other solutions, side by side")
    body: PointerProperty(type=bpy.types.Object, description="The player's body before the preview")
    motion: PointerProperty(type=BeyondMocapBefore, description="What the body played before the preview")
    track: PointerProperty(type=bpy.types.Curve, description="The track on the ground before the preview")
    mesh_made: BoolProperty(description="Whether the preview dressed the body")
    track_made: BoolProperty(description="Whether the preview drew the track")
    was_accepted: BoolProperty(description="Whether an accepted result was there before the preview")
    take: StringProperty(description="The take before the preview")
    quality: StringProperty(description="Lines about that take")
    moments: StringProperty(description="Lines about that take's key moments")
    warnings: StringProperty(description="Warnings about that take")
    recipe_before: StringProperty(description="The steps that make that take again")
    made_of_before: StringProperty(description="Fingerprints of what that take was made of")


class BeyondMocapShared(bpy.types.PropertyGroup):
    """What all players' previews have in common: the ball, the stage's camera, the scene's length."""

    ball: PointerProperty(type=BeyondMocapBefore, description="What the ball played before any preview")
    camera: PointerProperty(type=BeyondMocapBefore, description="What the camera's focus played before any preview")
    end_before: IntProperty(description="The scene's last frame before any preview")
    end_set: IntProperty(description="The scene's last frame as previews have set it; 0 where they have not")
