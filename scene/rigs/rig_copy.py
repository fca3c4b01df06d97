"""A rig with all that hangs on it, once more: so that each player may have one."""

from __future__ import annotations

import bpy


def copied(rig: bpy.types.Object, name: str) -> bpy.types.Object:
    """A copy of an armature object and of its children, which share their data with the original; beside it in its
    collections, or in the scene's own where these are another file's. What pointed to the original within them points
    to the copy; the copy plays nothing."""
    family = [rig, *rig.children_recursive]
    twins = {one: one.copy() for one in family}
    for one, twin in twins.items():
        twin.name = name if one == rig else f"{name} {one.name}"
        for collection in _open_to(one):
            collection.objects.link(twin)
        if one.parent in twins:
            inverse = one.matrix_parent_inverse.copy()
            twin.parent, twin.matrix_parent_inverse = twins[one.parent], inverse
        _repoint(twin, twins)
    data = twins[rig].animation_data
    if data is not None:
        data.action = None
        for track in list(data.nla_tracks):
            data.nla_tracks.remove(track)
    return twins[rig]


def _open_to(thing: bpy.types.Object) -> list[bpy.types.Collection]:
    """The collections of an object that take another one: not linked ones, nor those of a library override."""
    found = [one for one in thing.users_collection if one.library is None and one.override_library is None]
    return found or [bpy.context.scene.collection]


def _repoint(thing: bpy.types.Object, twins: dict) -> None:
    holders = [*thing.constraints, *thing.modifiers]
    if thing.pose is not None:
        holders += [constraint for bone in thing.pose.bones for constraint in bone.constraints]
    for holder in holders:
        targets = list(getattr(holder, "targets", ())) or []
        for one in (holder, *targets):
            for pointer in ("target", "pole_target", "object", "space_object"):
                if getattr(one, pointer, None) in twins:
                    setattr(one, pointer, twins[getattr(one, pointer)])
    for driver in thing.animation_data.drivers if thing.animation_data else ():
        for variable in driver.driver.variables:
            for target in variable.targets:
                if target.id in twins:
                    target.id = twins[target.id]
