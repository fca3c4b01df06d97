"""Migrate files of earlier versions when they are opened, scene by scene, by the version in each scene's settings.

Every step can run again on migrated data without changing it. What needs other files (a track, a text on disk) is not
done here, but by Bring to the Timeline when the user asks for it.
"""

from __future__ import annotations

import bpy

from ..result import bake
from . import channels
from .live import Watcher
from .settings import BeyondMocapSettings

VERSION = 2  # 1: tracks were rendered; 0: before the editor, without a number; also a scene that has not been saved


def migrate_scene(scene: bpy.types.Scene) -> None:
    """Migrate one scene's settings from the version they were saved with."""
    settings = scene.beyond_mocap
    if settings.version < 1:
        _mark_accepted_bodies(settings)
    if settings.version < 2:
        _hide_tracks(scene)
    settings.version = max(settings.version, VERSION)


def _mark_accepted_bodies(settings: BeyondMocapSettings) -> None:
    """From version 0: a body that plays what Bake wrote is an accepted result."""
    for player in settings.players:
        if player.body is None or player.result.state != "NONE":
            continue
        action, _ = channels.find_playing_action(player.body)
        if action is not None and action.get(bake.MARK):
            player.result.state = "ACCEPTED"


def _hide_tracks(scene: bpy.types.Scene) -> None:
    """From version 1: the coloured tracks on the ground are for the views alone."""
    names = {bake.build_track_name(player) for player in scene.beyond_mocap.players}
    room = scene.collection.children.get(bake.COLLECTION)
    for thing in room.objects if room is not None else ():
        if thing.name in names and thing.type == "CURVE" and thing.library is None:
            thing.hide_render = True


def on_load() -> None:
    """Migrate an opened file; there is no undo history yet, so this adds no step."""
    for scene in bpy.data.scenes:
        if scene.library is None:
            migrate_scene(scene)


def on_save() -> None:
    """Set the version of scenes that were added since."""
    for scene in bpy.data.scenes:
        if scene.library is None and scene.beyond_mocap.version != VERSION:
            scene.beyond_mocap.version = VERSION


WATCHER = Watcher(name="Migration of older files", loaded=on_load, saving=on_save)
