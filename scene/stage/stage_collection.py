"""The collection "Stage": what the extension has put on a scene's stage, kept apart from what the user added to it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy

from ..core.names import find_named

if TYPE_CHECKING:
    from ...beyond_mocap.appearance.sports import Sport

NAME = "Stage"
FOCUS = "Stage focus"
STAGE_MARK = "beyond_mocap_stage"
"""Custom property of the collection and of everything that the extension adds to it."""

PITCH_SIZE = "beyond_mocap_pitch_size"
OLDER_NAMES = {"Grass", "Lines", "Sun", "Camera", FOCUS}  # objects of stages in older files, without that property


def find_stage(scene: bpy.types.Scene) -> bpy.types.Collection | None:
    """Find the scene's stage, of this or an earlier version."""
    found = next((one for one in scene.collection.children if one.get(STAGE_MARK) and one.library is None), None)
    if found is not None:
        return found
    by_name = scene.collection.children.get(NAME)
    return by_name if by_name is not None and list_own_objects(by_name) else None


def get_stage(scene: bpy.types.Scene) -> bpy.types.Collection:
    """Find the scene's stage, or create an empty one."""
    stage = find_stage(scene)
    if stage is None:
        stage = bpy.data.collections.new(NAME)
        stage[STAGE_MARK] = True
        scene.collection.children.link(stage)
    return stage


def list_own_objects(stage: bpy.types.Collection) -> list[bpy.types.Object]:
    """List the objects that the extension added to a stage."""
    if stage.get(STAGE_MARK):
        return [thing for thing in stage.objects if thing.get(STAGE_MARK)]
    base_names = {thing: thing.name.split(".")[0] for thing in stage.objects}
    whole = {"Grass", "Lines"} <= set(base_names.values())
    return [thing for thing, name in base_names.items() if whole and name in OLDER_NAMES]


def find_focus(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Find the empty that the following camera is attached to; None where there is no such camera."""
    stage = find_stage(scene)
    return find_named(stage.objects, FOCUS) if stage is not None else None


def find_sport(scene: bpy.types.Scene) -> "Sport":
    """Return the sport that the scene's stage is for."""
    from ...beyond_mocap.appearance.sports import load_sports

    return load_sports()[scene.beyond_mocap_stage.sport]


def find_pitch_size(scene: bpy.types.Scene) -> tuple[float, float]:
    """Return length and width of the scene's pitch in metres; the sport's regular size where there is none."""
    stage, regular = find_stage(scene), find_sport(scene).size
    return tuple(stage.get(PITCH_SIZE, regular)) if stage is not None else regular


def remove_objects(things: list[bpy.types.Object]) -> None:
    """Remove objects with the actions, meshes, lights and cameras that only they used."""
    data = {thing.data for thing in things} - {None}
    actions = {owner.animation_data.action for owner in (*things, *data)
               if getattr(owner, "animation_data", None) is not None} - {None}
    bpy.data.batch_remove(things)
    bpy.data.batch_remove([one for one in data if not one.users])
    bpy.data.batch_remove([one for one in actions if one.get(STAGE_MARK) and not one.users])
