"""The collections and objects of a displayed match, each with a mark. When the match is displayed again or removed,
only these are removed; other objects of the user stay.
"""

from __future__ import annotations

import bpy

from ...beyond_mocap.base.errors import InputError, format_count
from ..stage import cameras
from .load import TEAMS

MARK = "beyond_mocap_match"
PLAYER_PROPERTY = "beyond_mocap_match_player"
"""Custom property of a player's armature: the player's id."""

ROOT = "Match"
COLLECTION_NAMES = {"home": "Match Home", "away": "Match Away", "referee": "Match Referees", "ball": "Match Ball",
                    "pitch": "Match Pitch", "cameras": "Match Cameras"}
"""The last two are of version 0.1: now the scene's stage has pitch and cameras."""


def mark_object(thing):
    """Mark an object or action as part of the match; return it."""
    thing[MARK] = True
    return thing


def find_root(scene: bpy.types.Scene) -> bpy.types.Collection | None:
    """Find the collection "Match", wherever the user has moved it; None if no match is displayed. Linked ones do not
    count.
    """
    found = (one for one in scene.collection.children_recursive if one.get(MARK) == "root" and one.library is None)
    return next(found, None)


def create_collection(scene: bpy.types.Scene, name: str) -> bpy.types.Collection:
    """Find one of COLLECTION_NAMES, or create it with its parents."""
    root_collection = find_root(scene)
    if root_collection is None:
        root_collection = bpy.data.collections.new(ROOT)
        root_collection[MARK] = "root"
        scene.collection.children.link(root_collection)
    found = next((one for one in root_collection.children if one.get(MARK) == name), None)
    if found is None:
        found = bpy.data.collections.new(COLLECTION_NAMES[name])
        found[MARK] = name
        root_collection.children.link(found)
    return found


def include_collections(layer: bpy.types.ViewLayer) -> None:
    """Include the match's collections, and those above them, in a view layer again: objects outside it cannot be
    animated.
    """
    _include_children(layer.layer_collection)


def _include_children(layer: bpy.types.LayerCollection) -> None:
    for one in layer.children:
        collections = (one.collection, *one.collection.children_recursive)
        if any(collection.get(MARK) and collection.library is None for collection in collections):
            one.exclude = False
            _include_children(one)


def describe_left_out(scene: bpy.types.Scene, bodies: list[bpy.types.Object]) -> list[str]:
    """Describe the players of the displayed match that are not among these armatures: one line, or none."""
    count = len(find_armatures(scene)) - len(bodies)
    return [f"{format_count(count, 'player')} left out: in an excluded collection"] if count else []


def find_armatures(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Find the armatures of the displayed match, team by team."""
    root_collection = find_root(scene)
    teams = [one[MARK] for one in root_collection.children
             if one.get(MARK) in TEAMS] if root_collection is not None else []
    return [thing for team in teams for thing in find_objects(scene, team) if thing.type == "ARMATURE"]


def find_objects(scene: bpy.types.Scene, name: str) -> list[bpy.types.Object]:
    """Find the displayed objects of one of COLLECTION_NAMES."""
    root_collection = find_root(scene)
    found = [one for one in root_collection.children if one.get(MARK) == name] if root_collection is not None else []
    return [thing for one in found for thing in one.objects if thing.get(MARK)]


def find_meshes(scene: bpy.types.Scene, name: str) -> list[bpy.types.Object]:
    """Find the displayed meshes of one of COLLECTION_NAMES."""
    return [thing for thing in find_objects(scene, name) if thing.type == "MESH"]


def clear_match(scene: bpy.types.Scene) -> None:
    """Clear the displayed match, with actions and data that nothing else uses; emptied collections are removed too.

    The user's own actions and those with a fake user stay. What another scene displays too is only unlinked from this
    one.

    Args:
        scene: the scene.
    Raises:
        InputError: if that is not possible because both scenes have it in a collection of the user's.
    """
    root_collection = find_root(scene)
    if root_collection is None or _unlink_shared(scene, root_collection):
        return
    others = {thing for other in _find_other_scenes(scene) for thing in other.objects}
    removed = [thing for thing in root_collection.all_objects if thing.get(MARK)]
    for thing in others.intersection(removed):
        for one in {root_collection, *root_collection.children_recursive}.intersection(thing.users_collection):
            one.objects.unlink(thing)
    removed = [thing for thing in removed if thing not in others]
    actions = {_find_action(owner) for thing in removed for owner in (thing, thing.data)} - {None}
    actions_of_users = [one for one in actions if not one.get(MARK) and one.library is None]
    data = {thing.data for thing in removed} - {None}
    bpy.data.batch_remove(removed)
    bpy.data.batch_remove([one for one in data if not one.users])
    bpy.data.batch_remove([one for one in actions if one.get(MARK) and not one.users])
    for one in actions_of_users:
        one.use_fake_user = True  # otherwise it would not be saved
    for one in [*root_collection.children, root_collection]:
        if not one.all_objects and not one.children:
            bpy.data.collections.remove(one)
    cameras.update_cameras(scene)


def _find_other_scenes(scene: bpy.types.Scene) -> list[bpy.types.Scene]:
    return [one for one in bpy.data.scenes if one != scene]


def _unlink_shared(scene: bpy.types.Scene, root_collection: bpy.types.Collection) -> bool:
    """Unlink from the scene what another scene also has of the match; return whether that was all of it."""
    shared = {one for other in _find_other_scenes(scene) for one in other.collection.children_recursive}
    tree = (scene.collection, *scene.collection.children_recursive)
    shared_collections = [root_collection] if root_collection in shared else [one for one in root_collection.children
                                                                              if one.get(MARK) and one in shared]
    ends = [(above, one) for one in shared_collections for above in tree if one in above.children[:]]
    blocking = next((above for above, _ in ends if above in shared), None)
    if blocking is not None:
        found = f"holds the match {root_collection.name!r} in two scenes"
        raise InputError(f"collection {blocking.name!r}", found, "a collection per scene", "move the match out of it")
    for above, one in ends:
        above.children.unlink(one)
    return root_collection in shared


def _find_action(owner) -> bpy.types.Action | None:
    found = getattr(owner, "animation_data", None)
    return found.action if found is not None else None
