"""Operators of Synthesize: new takes, updates, other solutions, and the presets of its settings."""

import bpy
from bl_operators.presets import AddPresetBase
from bpy.props import BoolProperty, FloatProperty, IntProperty, StringProperty

from ..beyond_mocap.base.errors import InputError
from ..beyond_mocap.base.settings import list_settings
from ..scene.core import background, session
from ..scene.core.settings import find_active_player
from ..scene.result import freshness, plans, queue
from ..scene.result import synthesis_request as orders
from .operator_base import NEEDS_LIBRARY
from .take_queue import TakeOperator


class BEYOND_MOCAP_OT_synthesize(TakeOperator, bpy.types.Operator):
    """Find clips for the track and labels of every selected player and join them into one motion, shown as a preview
until it is applied or reverted"""

    bl_idname = "beyond_mocap.synthesize"
    bl_label = "Synthesize"


class BEYOND_MOCAP_OT_update(TakeOperator, bpy.types.Operator):
    """Regenerate only what changed in labels or track since the last synthesis; everything else stays bit for bit"""

    bl_idname = "beyond_mocap.update"
    bl_label = "Update"
    kind = "update"
    needs = (*TakeOperator.needs, "Synthesize first",
             lambda context: any(player.use and player.take for player in context.scene.beyond_mocap.players))

    def list_requests(self, context):
        """List the players that are out of date, or whose take is not in this session; without any, all selected ones.

        Drawn tracks are read again in any case, since `look` does not play what has to be played.
        """
        found = super().list_requests(context)
        if len(found) == 1:
            return found
        changed = [(player, how) for player, how in found if player.drawn_track is not None or session.find_take(
            player.take) is None or freshness.check_player(context.scene, player)[0]]
        return changed or found


class BEYOND_MOCAP_OT_update_live(TakeOperator, bpy.types.Operator):
    """Update one player, quickly or completely; Update Automatically runs this after an edit"""

    bl_idname = "beyond_mocap.update_live"
    bl_label = "Update Automatically"
    bl_options = {"UNDO", "INTERNAL"}
    pops_up = False
    player: bpy.props.StringProperty(name="Player", description="Name of the player in the list", options={"SKIP_SAVE"})
    kind: bpy.props.EnumProperty(name="Kind", items=(("quick", "Quick", "With a narrow search"),
                                                     ("whole", "Full", "In full quality, with figures")),
                                 description="Quality of the update")

    def list_requests(self, context):
        """Return the one player, from its take."""
        found = context.scene.beyond_mocap.players.get(self.player)
        if found is None:
            raise InputError(self.bl_label, f"no player {self.player!r}", "a player of the list")
        if self.kind == "whole":  # a quick take that the narrow search did not affect only lacks its figures
            made = session.find_take(found.take)
            return [(found, orders.SynthesisMode("whole" if made is None or made.take.is_cut_short else "update"))]
        return [(found, orders.SynthesisMode(self.kind))]


class BEYOND_MOCAP_OT_cancel(bpy.types.Operator):
    """Stop running jobs and clear the queue without changing anything"""

    bl_idname = "beyond_mocap.cancel"
    bl_label = "Cancel"
    bl_options = {"INTERNAL"}
    keep: BoolProperty(
        name="Finish Early", options={"SKIP_SAVE"},
        description="Finish with the best result found so far; waiting players stay as they are",
    )
    player: StringProperty(name="Player", options={"SKIP_SAVE"}, description="Remove only this player from the queue")

    @classmethod
    def description(cls, _context, properties):
        if properties.player:
            return f"Remove {properties.player} from the queue without changing it"
        if properties.keep:
            return "Finish early and keep the best result found so far"
        return "Cancel running and waiting jobs without changing anything"

    def execute(self, context):
        """Ask every job to end, or remove one player from the queue."""
        if self.player:
            queue.remove_player(self.player)
            context.window_manager.beyond_mocap_work.waiting = "\n".join(queue.list_players())
        elif self.keep:
            background.end_jobs()
        else:
            queue.clear_queue()
            background.cancel_jobs()
        return {"FINISHED"}


class BEYOND_MOCAP_OT_resynthesize_stretch(TakeOperator, bpy.types.Operator):
    """Search the seconds of the selected strip, of a selected label span or of the preview range again with other clips
where possible; everything else stays bit for bit"""

    bl_idname = "beyond_mocap.resynthesize_stretch"
    bl_label = "Resynthesize Stretch"
    start: FloatProperty(name="From", options={"SKIP_SAVE"}, unit="TIME_ABSOLUTE",
                         description="First second on the track's clock")
    end: FloatProperty(name="To", options={"SKIP_SAVE"}, unit="TIME_ABSOLUTE",
                       description="Last second on the track's clock; 0 for the selection")
    needs = "Synthesize first", lambda context: any(player.take for player in context.scene.beyond_mocap.players)

    def list_requests(self, context):
        """Return the seconds that are set, or those of the selection."""
        settings = context.scene.beyond_mocap
        if self.end > self.start:
            player = settings.players.get(self.player) if self.player else plans.find_shown_player(context.scene)
            if player is None:
                raise InputError("resynthesize stretch", f"no player {self.player!r}", "a player with a take")
            return [(player, orders.SynthesisMode("stretch", self.start, self.end))]
        player, start, end = plans.find_selected_range(context.scene)
        return [(player, orders.SynthesisMode("stretch", start, end))]


class BEYOND_MOCAP_OT_variants(TakeOperator, bpy.types.Operator):
    """Create several takes of the active player, each with other clips where possible; a row of numbers switches
between them, and Apply keeps the one shown"""

    bl_idname = "beyond_mocap.variants"
    bl_label = "Variants"
    count: IntProperty(name="How Many", default=3, min=2, max=9, description="How many takes to choose from")
    needs = (*NEEDS_LIBRARY, "Import tracking and select a player in step 2 first",
             lambda context: find_active_player(context.scene.beyond_mocap) is not None)

    def list_requests(self, context):
        """Return the active player."""
        player = find_active_player(context.scene.beyond_mocap)
        if player is None:
            raise InputError("variants", "no active player", "a player", "select one in step 2")
        return [(player, orders.SynthesisMode("variants", count=self.count))]


class BEYOND_MOCAP_OT_add_preset(AddPresetBase, bpy.types.Operator):
    """Save the settings of Synthesize (method, weights, windows) under a name, for this and all other files"""

    bl_idname = "beyond_mocap.add_preset"
    bl_label = "Add Synthesis Preset"
    preset_menu = "BEYOND_MOCAP_MT_presets"
    preset_subdir = "beyond_mocap/synthesis"
    preset_defines = ["settings = bpy.context.scene.beyond_mocap"]
    preset_values = [f"settings.{row.identifier}" for row in list_settings("synthesis") if row.in_preset]
