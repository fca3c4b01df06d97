"""What is drawn over the 3D view, per scene."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty

OVERLAYS = ("track", "footprints", "contacts", "seams", "moments", "speed", "ghosts")
"""The overlays, in the order in which they are drawn and listed."""

PATH_OVERLAYS = ("path_source", "path_new", "path_trackers", "path_residuals", "path_ghost")
"""The overlays about riders, likewise; they are about every armature that rides a path."""

WHOSE = (
    ("ACTIVE", "Active Player", "Draw what is switched on of the active player"),
    ("TICKED", "Ticked Players", "Draw what is switched on of all ticked players"),
)
GHOSTS = (
    ("STEP", "Every", "A figure every so many seconds"),
    ("SEAMS", "At Cuts", "A figure at every cut between two clips"),
)


def _changed(_settings, context):
    """Let what is missing be prepared and the views be drawn again."""
    from .overlays import store

    if context.scene is not None and not bpy.app.background:
        store.sync(context.scene)
        store.redraw()


def _switch(name: str, description: str, default: bool = False) -> BoolProperty:
    return BoolProperty(name=name, description=description, default=default, update=_changed)


class BeyondMocapView(bpy.types.PropertyGroup):
    """The overlays' switches."""

    show: BoolProperty(
        name="Overlays", default=True, update=_changed, description="Draw the overlays that are switched on below"
    )
    players: EnumProperty(name="Of", items=WHOSE, update=_changed, description="Whose takes the overlays are about")
    track: _switch("Track", "The measured track, coloured by how far the body is off it")
    footprints: _switch("Footprints", "A shoe sole for every step, coloured by how far the standing foot slides")
    contacts: _switch("Contacts", "A disc under each foot that stands at the current frame")
    seams: _switch("Cuts", "A bar at every cut between two clips, with the clips' names, and why this clip is played")
    moments: _switch("Key Moments", "Where body and ball meet, the ball's way there, and the gap between the two")
    speed: _switch("Speed", "The asked speed as a curtain over the track, and the body's own as a line")
    ghosts: _switch("Ghosts", "Stick figures of the body before and behind the current frame")
    path_source: _switch("Original Path", "The path that the original motion goes, as it was fitted", True)
    path_new: _switch("New Path", "The path that is ridden, as the curve is understood: without corners", True)
    path_trackers: _switch(
        "Trackers", "At the current frame, where the body is on either path and where it heads", True
    )
    path_residuals: _switch("Residuals", "Lines from either path to the pelvis: what of the motion is not the path's")
    path_ghost: _switch("Original Motion", "The original as a stick figure at the current frame")
    shots: _switch("Ball Ways", "The ways that aimed and passed balls could take and take, strikes and bounces", True)
    ghosts_at: EnumProperty(name="Ghosts", items=GHOSTS, update=_changed, description="Where the figures stand")
    ghost_step: FloatProperty(
        name="Seconds", default=0.5, min=0.05, max=10.0, precision=2, unit="TIME_ABSOLUTE", update=_changed,
        description="Time from one figure to the next",
    )
    reach: FloatProperty(
        name="Around the Playhead", default=2.0, min=0.0, max=60.0, precision=1, unit="TIME_ABSOLUTE", update=_changed,
        description="Ghosts and texts within this time of the current frame are drawn; 0 draws none",
    )
    in_front: BoolProperty(
        name="In Front", default=False, update=_changed,
        description="Draw over everything, not only over what is behind",
    )

    def on(self) -> list[str]:
        """The names of the overlays that are to be drawn."""
        return [name for name in OVERLAYS if getattr(self, name)] if self.show else []

    def on_path(self) -> list[str]:
        """The names of the overlays about riders that are to be drawn."""
        return [name for name in PATH_OVERLAYS if getattr(self, name)] if self.show else []


class BeyondMocapPlayhead(bpy.types.PropertyGroup):
    """What there is to tell about the current frame; on the window manager, so that undo leaves it alone."""

    attached_to = ("WindowManager.beyond_mocap_playhead",)

    why: StringProperty(description="Lines on why the clip at the playhead is played")
