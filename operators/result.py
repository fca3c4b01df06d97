"""Results: accept, discard or preview takes, and their error curves."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty

from ..beyond_mocap.base.errors import InputError
from ..beyond_mocap.base.settings.synthesis import FORMS
from ..scene.core import session
from ..scene.core.settings import active_player
from ..scene.result import preview, quality
from .turns import show_automatic
from .verb import Verb


class ResultVerb(Verb):
    """A verb about the results of one player, or of all that are ticked."""

    player: StringProperty(name="Player", options={"SKIP_SAVE"},
                           description="Whose result; empty: of all ticked players")

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
    needs = ("Synthesize first", lambda context: any(player.use and (player.take or player.result.state != "NONE")
                                                     for player in context.scene.beyond_mocap.players))

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


class BEYOND_MOCAP_OT_discard(ResultVerb, bpy.types.Operator):
    """Put the preview away: what the body played before is played again, and what was made for the preview goes"""

    bl_idname = "beyond_mocap.discard"
    bl_label = "Discard"
    needs = ("No preview is shown: Synthesize shows one",
             lambda context: any(player.use and player.result.state == "PREVIEW"
                                 for player in context.scene.beyond_mocap.players))

    def do(self, context):
        players = [player for player in self.chosen(context) if player.result.state == "PREVIEW"]
        if not players:
            raise InputError("discard", "no preview is shown", "a preview", "synthesize first")
        for player in players:
            for line in preview.off_path(player):
                self.report({"INFO"}, line)
            preview.discard(context, player)
            show_automatic(context, player)
        self.report({"INFO"}, f"discarded: {', '.join(player.name for player in players)}")


class BEYOND_MOCAP_OT_preview(ResultVerb, bpy.types.Operator):
    """Show this one of the variants that were made; Accept keeps the one that is shown"""

    bl_idname = "beyond_mocap.preview"
    bl_label = "Preview"
    number: IntProperty(name="Variant", default=1, min=1, description="Which one, from 1")
    needs = ("No variants: press Variants first",
             lambda context: any(player.result.variants for player in context.scene.beyond_mocap.players))

    def do(self, context):
        """Show it on the named player, or the active one."""
        player = self.chosen(context)[0] if self.player else active_player(context.scene.beyond_mocap)
        if player is None:
            raise InputError("preview", "no player is chosen", "a player with variants", "choose one in step 2")
        preview.show_variant(context, player, self.number - 1)
        show_automatic(context, player)


class BEYOND_MOCAP_OT_error_curves(Verb, bpy.types.Operator):
    """Show the active player's errors over time as curves in the Graph Editor: root error, slide of both feet, foot
corrections, jerk, speed, cuts. They are custom properties of the armature and go with the take"""

    bl_idname = "beyond_mocap.error_curves"
    bl_label = "Error Curves"
    remove: BoolProperty(name="Remove", options={"SKIP_SAVE"}, description="Take the curves away instead")

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("Synthesize first: the active player has no body with a take")
        player = active_player(context.scene.beyond_mocap)
        if player is None or player.body is None:
            return False
        return bool(player.take) or quality.has_error_curves(player.body)

    def do(self, context):
        player = active_player(context.scene.beyond_mocap)
        if player is None or player.body is None:
            raise InputError("error curves", "no player with a body", "one", "synthesize first")
        if player.body.library is not None or player.body.data.library is not None:
            raise InputError(f"body {player.body.name}", "linked from another file", "an armature of this file")
        if self.remove:
            quality.remove_error_curves(player.body)
        elif session.made(player.take) is None:
            raise InputError(f"player {player.name}", "no take in this session", "a take", "synthesize again")
        else:
            quality.write_error_curves(context.scene, player)
