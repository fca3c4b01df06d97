"""Save and restore exactly what an object plays (action, slot, NLA, pose), and the user's scene for work that needs
Blender's importers, exporters or modes.
"""

from __future__ import annotations

import json
from contextlib import contextmanager, nullcontext

import bpy

from ..result.result import BeyondMocapBefore
from . import channels

TRANSFORMS = ("location", "rotation_quaternion", "rotation_euler", "rotation_axis_angle", "scale")


def save_playback(before: BeyondMocapBefore, target: bpy.types.Object) -> None:
    """Save what an object plays, and let it play nothing: its action is removed from it, its NLA tracks are off."""
    before.kept, before.made = True, False
    before.stance = json.dumps(read_stance(target))
    data = target.animation_data
    before.animated = data is not None
    if data is None:
        return
    before.action, slot = data.action, data.action_slot
    before.slot = slot.identifier if slot is not None else ""
    before.use_nla, before.influence = data.use_nla, data.action_influence
    before.blend, before.extrapolation = data.action_blend_type, data.action_extrapolation
    data.action = None
    data.use_nla, data.action_influence, data.action_blend_type = False, 1.0, "REPLACE"
    data.action_extrapolation = "HOLD"


def restore_playback(before: BeyondMocapBefore, target: bpy.types.Object, mark: str) -> None:
    """Restore what an object played and its pose.

    An action with the custom property `mark` that it plays now is removed; another one stays in the file.
    """
    channels.remove_marked_action(target, mark)
    current, _ = channels.find_playing_action(target)
    if current is not None and current != before.action and current.users == 1:
        current.use_fake_user = True
    if not before.animated:
        if target.animation_data is not None:
            target.animation_data.action = None
            target.animation_data_clear()
    else:
        data = target.animation_data_create()
        data.action = before.action
        if before.action is not None:
            data.action_slot = next((s for s in before.action.slots if s.identifier == before.slot), None)
        restore_nla(before, data)
    if before.stance:
        apply_stance(target, json.loads(before.stance))
    clear_saved_state(before)


def restore_nla(before: BeyondMocapBefore, data: bpy.types.AnimData) -> None:
    """Restore NLA, influence and blending."""
    data.use_nla, data.action_influence = before.use_nla, before.influence
    data.action_blend_type, data.action_extrapolation = before.blend, before.extrapolation


def clear_saved_state(before: BeyondMocapBefore) -> None:
    """Clear what was saved."""
    for name in ("kept", "made", "animated", "action", "slot", "use_nla", "influence", "blend", "extrapolation",
                 "stance"):
        before.property_unset(name)


def discard_saved_state(before: BeyondMocapBefore, mark: str) -> None:
    """Clear what was saved without restoring it; an unused action with `mark` is removed, others stay in the file."""
    action = before.action
    clear_saved_state(before)
    if action is not None:
        remove_unused_action(action, mark)


def remove_unused_action(action: bpy.types.Action, mark: str) -> None:
    """Remove an action with `mark` and no user; one without the mark stays in the file."""
    if action.users - action.use_fake_user:
        return
    if action.get(mark):
        bpy.data.actions.remove(action)
    else:
        action.use_fake_user = True


def read_stance(target: bpy.types.Object) -> dict:
    """Read the transforms of an object and its bones: name ("" for the object) -> rotation mode and transform
    properties.
    """
    bones = target.pose.bones if target.pose is not None else ()
    return {"": _read_transform(target), **{f"{bone.name}": _read_transform(bone) for bone in bones}}


def apply_stance(target: bpy.types.Object, stance: dict) -> None:
    """Apply the transforms that `read_stance` returned."""
    for name, (mode, *values) in stance.items():
        thing = target if not name else target.pose.bones.get(name)
        if thing is None:
            continue
        thing.rotation_mode = mode
        for place, value in zip(TRANSFORMS, values, strict=True):
            setattr(thing, place, value)


@contextmanager
def use_temporary_scene(name: str):
    """Use a temporary scene, in the window where there is one, else in the context.

    All data that is added meanwhile is removed at the end, and the earlier scene and view layer are shown again.
    """
    before, window = set(_collect_all_data()), bpy.context.window
    user_scene, layer = (window.scene, window.view_layer.name) if window is not None else (None, "")
    scene = bpy.data.scenes.new(name)
    try:
        if window is not None:
            window.scene = scene
        with nullcontext() if window is not None else bpy.context.temp_override(
                scene=scene, view_layer=scene.view_layers[0]):
            yield scene
    finally:
        if window is not None:
            window.scene = user_scene
            window.view_layer = user_scene.view_layers[layer]
        added = [item for key, item in _collect_all_data().items() if key not in before]
        bpy.data.batch_remove([item for item in added if not isinstance(item, bpy.types.Scene)])
        for item in [item for item in added if isinstance(item, bpy.types.Scene)]:
            bpy.data.scenes.remove(item)


def _read_transform(thing) -> list:
    """Read the transform of an object or bone."""
    return [thing.rotation_mode, *(list(getattr(thing, name)) for name in TRANSFORMS)]


def _collect_all_data() -> dict:
    """Return all data of the file by identity; newer Blender versions list some data under several names."""
    found = {}
    for name in dir(bpy.data):
        kind = getattr(bpy.data, name)
        if isinstance(kind, bpy.types.bpy_prop_collection) and name not in {"window_managers", "screens", "workspaces"}:
            found.update({item.session_uid: item for item in kind if hasattr(item, "session_uid")})
    return found
