"""Make Match: everybody's motion and the ball, made by a process beside Blender, then shown."""

from __future__ import annotations

import bpy

from ..scene.match import child, load, order
from .match_verb import MAKING, MatchVerb


class BEYOND_MOCAP_OT_make_match(MatchVerb, bpy.types.Operator):
    """Find motion for everybody and the ball's course, from From to To, and show it. Other processes do the work, so
Blender stays free. ESC cancels: what is finished is kept, and pressing again goes on there"""

    bl_idname = "beyond_mocap.make_match"
    bl_label = "Make Match"
    kind = "match"
    left = "cancelled; what is finished is kept, and pressed again it goes on there"

    @classmethod
    def poll(cls, context):
        """A library and a match."""
        if not context.scene.beyond_mocap.library_folder:
            cls.poll_message_set("Choose the library's folder in step 1 first")
            return False
        cls.poll_message_set("Choose a tracking file of a match, or drop one into the view, first")
        return bool(context.scene.beyond_mocap_match.tracking_file)

    def order(self, context):
        """The command line, and what is shown of its results."""
        wanted = order.wanted(context.scene, order.folder_to_make(context.scene))
        return order.command(context.scene), wanted, self.known_library(wanted)

    @staticmethod
    def work(asked, progress, cancelled, hurry):
        """Make it in a process of its own, then expand it."""
        arguments, wanted, library = asked
        notes = child.run(arguments, lambda done, text: progress(MAKING * done, text), cancelled)
        shown = load.scenery(
            wanted, library, lambda done, text: progress(MAKING + (1.0 - MAKING) * done, text), cancelled
        )
        return wanted, shown, notes
