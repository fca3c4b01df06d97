"""Results: apply, revert or preview takes, their error curves, and the momentum of bodies."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..beyond_mocap.base.errors import InputError
from ..beyond_mocap.base.fixes import Fix
from ..beyond_mocap.base.settings.synthesis import FORMS
from ..scene.core import channels, session
from ..scene.core.measure import frames_per_second
from ..scene.core.settings import find_active_player
from ..scene.overlays import momentum_traces
from ..scene.result import key_layers, preview, quality
from .operator_base import NEEDS_NO_EDITING, BaseOperator
from .take_queue import update_automatic_strips


class ResultVerb(BaseOperator):
    """A verb about the results of one player, or of all selected players."""

    player: StringProperty(name="Player", options={"SKIP_SAVE"},
                           description="Player of the result; empty: all selected players")

    def list_players(self, context) -> list:
        """List the target players."""
        players = context.scene.beyond_mocap.players
        if self.player:
            if self.player not in players:
                raise InputError("player", self.player, "a name in the list", "check the list in step 2")
            return [players[self.player]]
        return [player for player in players if player.use]


class BEYOND_MOCAP_OT_accept(ResultVerb, bpy.types.Operator):
    """Apply the previewed take to the body, as one action or as an NLA strip for each piece of a clip, or convert an
applied result to the other form"""

    bl_idname = "beyond_mocap.accept"
    bl_label = "Apply"
    form: EnumProperty(name="As", items=FORMS, default="ACTION", description="Form of the applied take")
    needs = ("Synthesize first", lambda context: any(player.use and (player.take or player.result.state != "NONE")
                                                     for player in context.scene.beyond_mocap.players))

    def do(self, context):
        """Show takes that are not shown yet, then apply all."""
        players = [player for player in self.list_players(context) if player.take or player.result.state != "NONE"]
        for player in players:
            preview.check_body(player)
        not_shown = [player for player in players if not preview.is_shown(context.scene, player)]
        lost = [player.name for player in not_shown if session.find_take(player.take) is None]
        if lost or not players:
            found = f"no take of {', '.join(lost) or 'any player'} in this session"
            raise InputError("apply", found, "a take", "synthesize again",
                             fixes=(Fix("press", "beyond_mocap.synthesize"),))
        for line in (line for player in players for line in preview.revert_path_edit(player)):
            self.report({"INFO"}, line)
        for player in not_shown:
            preview.show_preview(context, player, player.take, {})
        bodies = [preview.apply_preview(context, player, self.form) for player in players]
        if bodies[-1].name in context.view_layer.objects:  # else its collection is excluded
            context.view_layer.objects.active = bodies[-1]
        kind = "one action each" if self.form == "ACTION" else "NLA strips"
        self.report({"INFO"}, f"applied as {kind}: {', '.join(player.name for player in players)}")


class BEYOND_MOCAP_OT_discard(ResultVerb, bpy.types.Operator):
    """Revert the preview: the body plays its previous animation again, and everything created for the preview is
removed"""

    bl_idname = "beyond_mocap.discard"
    bl_label = "Revert"
    needs = ("No preview is shown: Synthesize shows one",
             lambda context: any(player.use and player.result.state == "PREVIEW"
                                 for player in context.scene.beyond_mocap.players))

    def do(self, context):
        players = [player for player in self.list_players(context) if player.result.state == "PREVIEW"]
        if not players:
            raise InputError("revert", "no preview is shown", "a preview", "synthesize first")
        for player in players:
            preview.check_body(player)
        for player in players:
            for line in preview.revert_path_edit(player):
                self.report({"INFO"}, line)
            preview.revert_preview(context, player)
            update_automatic_strips(context, player)
        self.report({"INFO"}, f"reverted: {', '.join(player.name for player in players)}")


class BEYOND_MOCAP_OT_preview(ResultVerb, bpy.types.Operator):
    """Preview this variant; Apply keeps the variant that is shown"""

    bl_idname = "beyond_mocap.preview"
    bl_label = "Preview"
    number: IntProperty(name="Variant", default=1, min=1, description="Number of the variant, from 1")
    needs = ("No variants: press Variants first",
             lambda context: any(player.result.variants for player in context.scene.beyond_mocap.players))

    def do(self, context):
        """Show the variant on the named player, or the active one."""
        player = self.list_players(context)[0] if self.player else find_active_player(context.scene.beyond_mocap)
        if player is None:
            raise InputError("preview", "no player is active", "a player with variants", "click one in step 2")
        preview.show_variant(context, player, self.number - 1)
        update_automatic_strips(context, player)


class BEYOND_MOCAP_OT_keep_as_layer(BaseOperator, bpy.types.Operator):
    """Move your own keys on the active player's take to a layer with an influence; the take below gets its own keys
back, and updates keep the layer"""

    bl_idname = "beyond_mocap.keep_as_layer"
    bl_label = "Keep as Layer"
    fade: FloatProperty(name="Fade", default=key_layers.FADE_SECONDS, min=0.0, max=60.0, soft_max=2.0,
                        unit="TIME_ABSOLUTE",
                        description="Seconds beside your keys over which their difference from the take fades")
    needs = (*NEEDS_NO_EDITING, "Key a pose of the active player's body first",
             lambda context: (player := find_active_player(context.scene.beyond_mocap)) is not None
             and preview.is_shown(context.scene, player))

    def do(self, context):
        """Keep the keys, and report which bones they are on."""
        body = find_active_player(context.scene.beyond_mocap).body
        layer = key_layers.keep_as_layer(body, frames_per_second(context.scene), self.fade)
        self.report({"INFO"}, f"{body.name}: own keys kept as the layer {layer.name}")


class BEYOND_MOCAP_OT_remove_layer(BaseOperator, bpy.types.Operator):
    """Remove this layer of your own keys"""

    bl_idname = "beyond_mocap.remove_layer"
    bl_label = "Remove Layer"
    number: IntProperty(name="Layer", default=1, min=1, options={"SKIP_SAVE"},
                        description="Number of the layer, from 1")
    needs = ("The active player's body has no layers of own keys",
             lambda context: bool((player := find_active_player(context.scene.beyond_mocap)) is not None
                                  and key_layers.list_layers(player.body)))

    def do(self, context):
        body = find_active_player(context.scene.beyond_mocap).body
        channels.check_local(body)
        channels.check_editable(body)
        count = len(key_layers.list_layers(body))
        if self.number > count:
            raise InputError("layer", f"number {self.number}", f"1 to {count}", "choose one of them")
        key_layers.remove_layer(body, self.number - 1)


class BEYOND_MOCAP_OT_error_curves(BaseOperator, bpy.types.Operator):
    """Show the active player's errors over time as curves in the Graph Editor: root error, foot slide, foot
corrections, jerk, speed, cuts"""

    bl_idname = "beyond_mocap.error_curves"
    bl_label = "Error Curves"
    remove: BoolProperty(name="Remove", options={"SKIP_SAVE"}, description="Remove the curves instead")

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("Synthesize first: the active player has no body with a take")
        player = find_active_player(context.scene.beyond_mocap)
        if player is None or player.body is None:
            return False
        return bool(player.take) or quality.has_error_curves(player.body)

    def do(self, context):
        player = find_active_player(context.scene.beyond_mocap)
        if player is None or player.body is None:
            raise InputError("error curves", "the active player has no body", "a body", "synthesize first",
                             fixes=(Fix("press", "beyond_mocap.synthesize"),))
        if player.body.library is not None or player.body.data.library is not None:
            raise InputError(f"body {player.body.name}", "is linked from another file", "an armature of this file")
        if self.remove:
            quality.remove_error_curves(player.body)
        elif session.find_take(player.take) is None:
            raise InputError(f"player {player.name}", "has no take in this session", "a take", "synthesize again",
                             fixes=(Fix("press", "beyond_mocap.synthesize"),))
        else:
            quality.write_error_curves(context.scene, player)


class BEYOND_MOCAP_OT_show_momentum(BaseOperator, bpy.types.Operator):
    """Draw centre of mass, flights, support polygon and ground force of the selected armatures over the 3D view"""

    bl_idname = "beyond_mocap.show_momentum"
    bl_label = "Show Momentum"
    remove: BoolProperty(name="Remove", options={"SKIP_SAVE"}, description="Hide them instead")
    needs = (*NEEDS_NO_EDITING, "Select an armature with a motion",
             lambda context: bool(_list_selected_armatures(context)))

    def do(self, context):
        """Show or hide the momentum of all selected armatures."""
        chosen = _list_selected_armatures(context)
        channels.check_local(*chosen)
        if not self.remove:
            momentum_traces.show_momentum(context.scene, chosen)
            return
        showing = [body for body in chosen if body.beyond_mocap_momentum.show]
        if not showing:
            raise InputError(f"armature {chosen[0].name}", "does not show its momentum", "an armature that shows it",
                             "press Show Momentum")
        momentum_traces.hide_momentum(showing)


def _list_selected_armatures(context) -> list[bpy.types.Object]:
    """List the selected armatures and those of selected characters."""
    chosen = [thing.find_armature() or thing for thing in context.selected_objects]
    return list(dict.fromkeys(thing for thing in chosen if thing.type == "ARMATURE"))
