"""Files that an earlier version of the extension has saved: what they hold is brought into today's form when they are
opened, scene by scene, by the version number that each scene's settings keep.

Everything here may run again on data that is already in today's form and then changes nothing. What would need other
files (a track, a text on disk) is not done here: Bring to the Timeline does it when the user asks for it.
"""

from __future__ import annotations

import bpy

from ..result import bake
from . import channels
from .live import Watcher
from .settings import BeyondMocapSettings

VERSION = 1  # 0: before the editor, when no number was kept yet; also a scene that has not been saved


def bring_up(scene: bpy.types.Scene) -> None:
    """Bring one scene's settings from the version that they were saved with to today's."""
    settings = scene.beyond_mocap
    if settings.version < 1:
        _know_bodies(settings)
    settings.version = max(settings.version, VERSION)


def _know_bodies(settings: BeyondMocapSettings) -> None:
    """From 0: a body that plays what Bake wrote is an accepted result."""
    for player in settings.players:
        if player.body is None or player.result.state != "NONE":
            continue
        action, _ = channels.playing(player.body)
        if action is not None and action.get(bake.MARK):
            player.result.state = "ACCEPTED"


def on_load() -> None:
    """A file has been opened: nothing can be undone yet, so that this is no step of its own."""
    for scene in bpy.data.scenes:
        if scene.library is None:
            bring_up(scene)


def on_save() -> None:
    """Scenes that were made since are of today's form."""
    for scene in bpy.data.scenes:
        if scene.library is None and scene.beyond_mocap.version != VERSION:
            scene.beyond_mocap.version = VERSION


WATCHER = Watcher(name="Files of earlier versions", loaded=on_load, saving=on_save)
