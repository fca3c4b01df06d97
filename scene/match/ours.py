"""The collections and objects of a displayed match, each with a mark. When the match is displayed again or removed,
only
these are removed; other objects of the user stay.
"""

from __future__ import annotations

import bpy

from ...beyond_mocap.base.errors import InputError
from .load import TEAMS

MARK = "beyond_mocap_match"
PLAYER = "beyond_mocap_match_player"
"""Custom property of a player's armature: the player's id."""

ROOT = "Match"
PARTS = {"home": "Match Home", "away": "Match Away", "referee": "Match Referees", "ball": "Match Ball",
         "pitch": "Match Pitch", "cameras": "Match Cameras"}


def mark(thing):
    """Mark an object or action as part of the match; return it."""
    thing[MARK] = True
    return thing


def root(scene: bpy.types.Scene) -> bpy.types.Collection | None:
    """Find the collection "Match", wherever the user has moved it; None if no match is displayed. Linked ones do not
    count.
    """
    found = (one for one in scene.collection.children_recursive if one.get(MARK) == "root" and one.library is None)
    return next(found, None)


def part(scene: bpy.types.Scene, name: str) -> bpy.types.Collection:
    """Find one of COLLECTION_NAMES, or create it with its parents."""
    whole = root(scene)
    if whole is None:
        whole = bpy.data.collections.new(ROOT)
        whole[MARK] = "root"
        scene.collection.children.link(whole)
    found = next((one for one in whole.children if one.get(MARK) == name), None)
    if found is None:
        found = bpy.data.collections.new(PARTS[name])
        found[MARK] = name
        whole.children.link(found)
    return found


def include(layer: bpy.types.ViewLayer) -> None:
    """Include the match's collections, and those above them, in a view layer again: objects outside it cannot be
    animated.
    """
    _include(layer.layer_collection)


def _include(layer: bpy.types.LayerCollection) -> None:
    for one in layer.children:
        held = (one.collection, *one.collection.children_recursive)
        if any(collection.get(MARK) and collection.library is None for collection in held):
            one.exclude = False
            _include(one)


def bodies(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Find the armatures of the displayed match, team by team."""
    whole = root(scene)
    teams = [one[MARK] for one in whole.children if one.get(MARK) in TEAMS] if whole is not None else []
    return [thing for team in teams for thing in things(scene, team) if thing.type == "ARMATURE"]


def things(scene: bpy.types.Scene, name: str) -> list[bpy.types.Object]:
    """Find the displayed objects of one of COLLECTION_NAMES."""
    whole = root(scene)
    found = [one for one in whole.children if one.get(MARK) == name] if whole is not None else []
    return [thing for one in found for thing in one.objects if thing.get(MARK)]


def meshes(scene: bpy.types.Scene, name: str) -> list[bpy.types.Object]:
    """Find the displayed meshes of one of COLLECTION_NAMES."""
    return [thing for thing in things(scene, name) if thing.type == "MESH"]


def clear(scene: bpy.types.Scene) -> None:
    """Clear the displayed match, with actions and data that nothing else uses; emptied collections are removed too.

    The user's own actions and those with a fake user stay. What another scene displays too is only unlinked from this
    one.

    Args:
        scene: the scene.
    Raises:
        InputError: if that is not possible because both scenes have it in a collection of the user's.
    """
    whole = root(scene)
    if whole is None or _let_go(scene, whole):
        return
    others = {thing for other in _others(scene) for thing in other.objects}
    gone = [thing for thing in whole.all_objects if thing.get(MARK)]
    for thing in others.intersection(gone):
        for one in {whole, *whole.children_recursive}.intersection(thing.users_collection):
            one.objects.unlink(thing)
    gone = [thing for thing in gone if thing not in others]
    actions = {_action(owner) for thing in gone for owner in (thing, thing.data)} - {None}
    actions_of_users = [one for one in actions if not one.get(MARK) and one.library is None]
    data = {thing.data for thing in gone} - {None}
    bpy.data.batch_remove(gone)
    bpy.data.batch_remove([one for one in data if not one.users])
    bpy.data.batch_remove([one for one in actions if one.get(MARK) and not one.users])
    for one in actions_of_users:
        one.use_fake_user = True  # otherwise it would not be saved
    for one in [*whole.children, whole]:
        if not one.all_objects and not one.children:
            bpy.data.collections.remove(one)


def _others(scene: bpy.types.Scene) -> list[bpy.types.Scene]:
    return [one for one in bpy.data.scenes if one != scene]


def _let_go(scene: bpy.types.Scene, whole: bpy.types.Collection) -> bool:
    """Unlink from the scene what another scene also has of the match; return whether that was all of it."""
    shared = {one for other in _others(scene) for one in other.collection.children_recursive}
    tree = (scene.collection, *scene.collection.children_recursive)
    held = [whole] if whole in shared else [one for one in whole.children if one.get(MARK) and one in shared]
    ends = [(above, one) for one in held for above in tree if one in above.children[:]]
    stuck = next((above for above, _ in ends if above in shared), None)
    if stuck is not None:
        found = f"holds the match {whole.name!r} in two scenes"
        raise InputError(f"collection {stuck.name!r}", found, "a collection per scene", "move the match out of it")
    for above, one in ends:
        above.children.unlink(one)
    return whole in shared


def _action(owner) -> bpy.types.Action | None:
    found = getattr(owner, "animation_data", None)
    return found.action if found is not None else None
