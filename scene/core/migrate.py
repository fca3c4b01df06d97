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

VERSION = 1  # 0: before the editor, without a number; also a scene that has not been saved


def bring_up(scene: bpy.types.Scene) -> None:
    """Migrate one scene's settings from the version they were saved with."""
    settings = scene.beyond_mocap
    if settings.version < 1:
        _know_bodies(settings)
    settings.version = max(settings.version, VERSION)


def _know_bodies(settings: BeyondMocapSettings) -> None:
    """From version 0: a body that plays what Bake wrote is an accepted result."""
    for player in settings.players:
        if player.body is None or player.result.state != "NONE":
            continue
        action, _ = channels.playing(player.body)
        if action is not None and action.get(bake.MARK):
            player.result.state = "ACCEPTED"


def on_load() -> None:
    """Migrate an opened file; there is no undo history yet, so this adds no step."""
    for scene in bpy.data.scenes:
        if scene.library is None:
            bring_up(scene)


def on_save() -> None:
    """Set the version of scenes that were added since."""
    for scene in bpy.data.scenes:
        if scene.library is None and scene.beyond_mocap.version != VERSION:
            scene.beyond_mocap.version = VERSION


WATCHER = Watcher(name="Migration of older files", loaded=on_load, saving=on_save)
