"""A character of the file as a player's body."""

from __future__ import annotations

import bpy

from ..scene.characters import player_character
from ..scene.core.settings import find_active_player
from .operator_base import BaseOperator


def has_character(context) -> bool:
    """Whether the active player has a character and a motion."""
    player = find_active_player(context.scene.beyond_mocap)
    return player is not None and player.character is not None and player.body is not None


class BEYOND_MOCAP_OT_update_character(BaseOperator, bpy.types.Operator):
    """Give the active player's character the present motion of their body, such as after editing its keys"""

    bl_idname = "beyond_mocap.update_character"
    bl_label = "Update Body"
    needs = "Synthesize, then choose a character for the active player", has_character

    def do(self, context):
        player = find_active_player(context.scene.beyond_mocap)
        lines = player_character.show_character(context, player)
        player.character_note = "\n".join(lines)
        self.report({"INFO"}, f"{player.character.name} plays the motion of {player.name}")
