"""Show Match: a stretch of a match that has been made, in the scene."""

from __future__ import annotations

import bpy

from ..scene.match import load, order
from .match_verb import MatchVerb


class BEYOND_MOCAP_OT_show_match(MatchVerb, bpy.types.Operator):
    """Show a stretch of a made match, from From to To: everybody in kit, ball, pitch and cameras. It takes the place of
the one that is shown"""

    bl_idname = "beyond_mocap.show_match"
    bl_label = "Show Match"
    kind = "match"

    @classmethod
    def poll(cls, context):
        """A library and a folder."""
        if not context.scene.beyond_mocap.library_folder:
            cls.poll_message_set("Choose the library's folder in step 1 first")
            return False
        cls.poll_message_set("Press Make Match, or choose the folder of a made match, first")
        match = context.scene.beyond_mocap_match
        return bool(match.folder or match.made)

    def order(self, context):
        """Folder and span."""
        wanted = order.wanted(context.scene, order.folder_to_show(context.scene))
        return wanted, self.known_library(wanted)

    @staticmethod
    def work(asked, progress, cancelled, hurry):
        """Expand it."""
        wanted, library = asked
        return wanted, load.scenery(wanted, library, progress, cancelled), ()
