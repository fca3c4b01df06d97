"""Which overlays are drawn over the 3D view, per scene."""

import bpy
from bpy.props import BoolProperty, StringProperty

from ..core import window
from ..core.properties import with_settings
from . import store

OVERLAYS = ("track", "footprints", "contacts", "seams", "moments", "speed", "heading", "ghosts")
"""The overlays, in the order in which they are drawn and listed."""

PATH_OVERLAYS = ("path_source", "path_new", "path_trackers", "path_residuals", "path_ghost")
"""The overlays of path editing, likewise; they show every armature that follows a path."""


def _update_overlays(_settings, context):
    """Prepare what is missing and redraw the views."""
    if context.scene is not None and not bpy.app.background:
        store.update_store(context.scene)
        window.redraw_editors()


@with_settings("view", update=_update_overlays)
class BeyondMocapView(bpy.types.PropertyGroup):
    """The overlays' switches."""

    def list_overlays(self) -> list[str]:
        """List the names of the overlays to draw."""
        return [name for name in OVERLAYS if getattr(self, name)] if self.show else []

    def list_path_overlays(self) -> list[str]:
        """List the names of the path overlays to draw."""
        return [name for name in PATH_OVERLAYS if getattr(self, name)] if self.show else []


class BeyondMocapMomentum(bpy.types.PropertyGroup):
    """Whether an armature shows its momentum."""

    attached_to = ("Object.beyond_mocap_momentum",)
    show: BoolProperty(name="Show Momentum", options={"HIDDEN"},
                       description="Draw the armature's centre of mass, flights, support polygon and ground force")
    message: StringProperty(name="Message", options={"HIDDEN"}, description="Why the momentum cannot be drawn")


class BeyondMocapPlayhead(bpy.types.PropertyGroup):
    """Texts about the current frame; on the window manager, so that undo leaves them alone."""

    attached_to = ("WindowManager.beyond_mocap_playhead",)
    why: StringProperty(description="Reasons for the clip at the playhead, line by line")
