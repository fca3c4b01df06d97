"""What the match's buttons share: the making of it and the showing of it, in the background."""

from __future__ import annotations

import bpy

from ..beyond_mocap.errors import InputError
from ..scene import session
from ..scene.match import load, show
from ..scene.measure import frames_per_second
from ..scene.settings import as_setting
from .verb import BackgroundVerb

MAKING = 0.85
"""Of the bar, the share of making where a match is made and shown."""


class MatchVerb(BackgroundVerb):
    """A verb that ends with a stretch of a match in the scene."""

    bl_options = {"REGISTER", "UNDO"}

    def known_library(self, wanted: load.Wanted):
        """The library where this session has it."""
        return session.library(wanted.library, wanted.unit)

    def apply(self, scene, result):
        """Pitch, bodies, ball, cameras; and lines about what came of it."""
        wanted, (library, scenery, lines), notes = result
        match = scene.beyond_mocap_match
        match.made = "" if match.folder else as_setting(wanted.folder)
        if scene != bpy.context.scene:
            raise InputError("match", f"scene {scene.name} is not shown in the window", "the scene that asked",
                             "choose it and press Show Match")
        session.keep_library(library, wanted.unit)
        first = match.first_frame
        took = show.show(bpy.context, scenery, first)
        match.shown, match.shown_start, match.shown_first = wanted.folder, scenery.start, first
        match.shown_rate = frames_per_second(scene)
        known = match.report.splitlines()
        match.told = "\n".join(line for line in dict.fromkeys((*lines, *notes)) if line not in known)
        for line in lines:
            self.report({"WARNING"}, line)
        seconds = scenery.end - scenery.start
        self.report({"INFO"}, f"{len(scenery.people)} people, {seconds:.1f} s, shown in {sum(took.values()):.1f} s")
