"""Accept: keep the takes that are shown, as one action or as NLA strips."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, StringProperty

from ..beyond_mocap.base.settings.synthesis import FORMS
from ..beyond_mocap.errors import InputError
from ..scene import preview, session
from .verb import Verb


class ResultVerb(Verb):
    """A verb about the results of one player, or of all that are ticked."""

    player: StringProperty(
        name="Player", options={"SKIP_SAVE"}, description="Whose result; empty: of all ticked players",
    )

    def chosen(self, context) -> list:
        """The players in question."""
        players = context.scene.beyond_mocap.players
        if self.player:
            if self.player not in players:
                raise InputError("player", self.player, "a name in the list", "look at step 2")
            return [players[self.player]]
        return [player for player in players if player.use]


class BEYOND_MOCAP_OT_accept(ResultVerb, bpy.types.Operator):
    """Keep what is shown: the take stays on the body, as one action or as a strip for each piece of a clip.
Accepted results can be turned from one form into the other"""

    bl_idname = "beyond_mocap.accept"
    bl_label = "Accept"

    form: EnumProperty(name="As", items=FORMS, default="ACTION", description="What the take becomes")

    @classmethod
    def poll(cls, context):
        """There is something to accept."""
        cls.poll_message_set("Synthesize first")
        return any(player.use and (player.take or player.result.state != "NONE")
                   for player in context.scene.beyond_mocap.players)

    def do(self, context):
        """Show those that are not shown yet, then keep all."""
        players = [player for player in self.chosen(context) if player.take or player.result.state != "NONE"]
        for player in players:
            preview.check(player)
        unseen = [player for player in players if not preview.shown(context.scene, player)]
        lost = [player.name for player in unseen if session.made(player.take) is None]
        if lost or not players:
            found = f"no take of {', '.join(lost) or 'any player'} in this session"
            raise InputError("accept", found, "a take", "synthesize again")
        for line in (line for player in players for line in preview.off_path(player)):
            self.report({"INFO"}, line)
        for player in unseen:
            preview.show(context, player, player.take, {})
        bodies = [preview.keep(context, player, self.form) for player in players]
        if bodies[-1].name in context.view_layer.objects:  # else its collection is excluded
            context.view_layer.objects.active = bodies[-1]
        kind = "one action each" if self.form == "ACTION" else "NLA strips"
        self.report({"INFO"}, f"accepted as {kind}: {', '.join(player.name for player in players)}")
