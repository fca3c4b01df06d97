"""Words to Text: a player's strips as a text of this file, in the text form."""

from __future__ import annotations

import bpy

from ..beyond_mocap.annotation import format_timeline
from ..scene import lanes
from ..scene.settings import active_player
from ..scene.subject import clip, name_of, subject
from .timeline_verb import TimelineVerb


class BEYOND_MOCAP_OT_words_to_text(TimelineVerb, bpy.types.Operator):
    """Write what the strips and key moments say into a text of this file, to be read or changed in the Text Editor. It
becomes the player's text in step 2"""

    bl_idname = "beyond_mocap.words_to_text"
    bl_label = "Words to Text"

    def do(self, context):
        """Into the player's text, where there is one, else a new one."""
        target = subject(context)
        words = format_timeline(lanes.read(target, name_of(target)))
        player = None if clip(context) else active_player(context.scene.beyond_mocap)
        text = player.annotation_text if player else None
        if text is None or text.library is not None:
            text = bpy.data.texts.new(f"{name_of(target)} words")
        text.clear()
        text.write(words)
        if player:
            player.annotation_text = text
        self.report({"INFO"}, f"{words.count(chr(10))} lines in the text {text.name}")
