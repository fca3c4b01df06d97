"""A rig with all that hangs on it, once more: so that each player may have one."""

from __future__ import annotations

import bpy


def copied(rig: bpy.types.Object, name: str) -> bpy.types.Object:
    """A copy of an armature object and of its children, which share their data with the original; beside it in its
    collections. What pointed to the original within them points to the copy; the copy plays nothing."""
    family = [rig, *rig.children_recursive]
    twins = {one: one.copy() for one in family}
    for one, twin in twins.items():
        twin.name = name if one == rig else f"{name} {one.name}"
        for collection in one.users_collection:
            collection.objects.link(twin)
        if one.parent in twins:
            inverse = one.matrix_parent_inverse.copy()
            twin.parent, twin.matrix_parent_inverse = twins[one.parent], inverse
        _repoint(twin, twins)
    if twins[rig].animation_data is not None:
        twins[rig].animation_data.action = None
    return twins[rig]


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
