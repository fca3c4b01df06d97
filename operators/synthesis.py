"""Synthesize: new takes, updates, other solutions, and the presets of its settings."""

from __future__ import annotations

import bpy
from bl_operators.presets import AddPresetBase
from bpy.props import BoolProperty, FloatProperty, IntProperty, StringProperty

from ..beyond_mocap.base.errors import InputError
from ..beyond_mocap.base.settings import rows_of
from ..scene.core import background, session
from ..scene.core.settings import active_player
from ..scene.result import freshness, orders, plans, queue
from .turns import TurnsVerb
from .verb import NEEDS_LIBRARY


class BEYOND_MOCAP_OT_synthesize(TurnsVerb, bpy.types.Operator):
    """Find clips for every ticked player's track and words, and join them into one motion.
It is shown as a preview, until it is accepted or discarded. Players queue; ESC cancels"""

    bl_idname = "beyond_mocap.synthesize"
    bl_label = "Synthesize"


class BEYOND_MOCAP_OT_update(TurnsVerb, bpy.types.Operator):
    """Make anew only what changes of the words or the track touch since the last Synthesize or Update.
The rest stays as it is, to the last bit; shown as a preview, until it is accepted or discarded.
After the file was opened again the take is made again as it was"""

    bl_idname = "beyond_mocap.update"
    bl_label = "Update"
    kind = "update"
    needs = (*TurnsVerb.needs, "Synthesize first",
             lambda context: any(player.use and player.take for player in context.scene.beyond_mocap.players))

    def wanted(self, context):
        """Where something is out of date about some of the players, only those; the others stay untouched. Drawn tracks
        are read anew in any case, since `look` does not play what has to be played."""
        found = super().wanted(context)
        if len(found) == 1:
            return found
        changed = [(player, how) for player, how in found
                   if player.drawn_track is not None or freshness.look(context.scene, player)[0]]
        return changed or found


class BEYOND_MOCAP_OT_update_live(TurnsVerb, bpy.types.Operator):
    """Update one player, quickly or as a whole; Live does it by itself"""

    bl_idname = "beyond_mocap.update_live"
    bl_label = "Live Update"
    bl_options = {"UNDO", "INTERNAL"}
    player: bpy.props.StringProperty(name="Player", description="Name of the player in the list", options={"SKIP_SAVE"})
    kind: bpy.props.EnumProperty(name="Kind", items=(("quick", "Quick", "By a narrow search"),
                                                     ("whole", "Whole", "As well as can be, with figures")),
                                 description="How it is made")

    def wanted(self, context):
        """The one player, from his take."""
        found = context.scene.beyond_mocap.players.get(self.player)
        if found is None:
            raise InputError("Live Update", f"no player {self.player!r}", "a player of the list")
        if self.kind == "whole":  # what was quick and yet as good as it can be only lacks its figures
            made = session.made(found.take)
            return [(found, orders.How("whole" if made is None or made.take.cut_short else "update"))]
        return [(found, orders.How(self.kind))]


class BEYOND_MOCAP_OT_cancel(bpy.types.Operator):
    """End what runs in the background and what waits: nothing changes"""

    bl_idname = "beyond_mocap.cancel"
    bl_label = "Cancel"
    bl_options = {"INTERNAL"}
    keep: BoolProperty(
        name="Finish Early", options={"SKIP_SAVE"},
        description="Come to an end with the best that has been found so far; players that wait are left as they are",
    )
    player: StringProperty(name="Player", options={"SKIP_SAVE"}, description="Only take this player out of the queue")

    @classmethod
    def description(cls, _context, properties):
        if properties.player:
            return f"Leave {properties.player} as it is: take it out of the queue"
        if properties.keep:
            return "Finish early: keep the best that has been found so far"
        return "Cancel what runs and what waits: nothing changes"

    def execute(self, context):
        """Ask every job to end."""
        if self.player:
            queue.remove(self.player)
            context.window_manager.beyond_mocap_work.waiting = "\n".join(queue.names())
        elif self.keep:
            background.end()
        else:
            queue.clear()
            background.stop()
        return {"FINISHED"}


class BEYOND_MOCAP_OT_resynthesize_stretch(TurnsVerb, bpy.types.Operator):
    """Search these seconds anew, without the clips that are shown there where that can be: those of the selected strip
of an accepted result, of a selected span of words, or the preview range. All else stays to the last bit"""

    bl_idname = "beyond_mocap.resynthesize_stretch"
    bl_label = "Resynthesize Stretch"
    start: FloatProperty(name="From", options={"SKIP_SAVE"}, unit="TIME_ABSOLUTE",
                         description="Second on the track's clock")
    end: FloatProperty(name="To", options={"SKIP_SAVE"}, unit="TIME_ABSOLUTE",
                       description="Second on the track's clock; 0: as selected")
    needs = "Synthesize first", lambda context: any(player.take for player in context.scene.beyond_mocap.players)

    def wanted(self, context):
        """The seconds that were named, or those of what is selected."""
        settings = context.scene.beyond_mocap
        if self.end > self.start:
            player = settings.players.get(self.player) if self.player else plans.player_shown(context.scene)
            if player is None:
                raise InputError("a stretch made anew", f"no player {self.player!r}", "a player with a take")
            return [(player, orders.How("stretch", self.start, self.end))]
        player, start, end = plans.selected_stretch(context.scene)
        return [(player, orders.How("stretch", start, end))]


class BEYOND_MOCAP_OT_variants(TurnsVerb, bpy.types.Operator):
    """Make several takes of the active player, each without the footage of those before where that can be.
They are switched by the row of numbers; Accept keeps the one that is shown, the others go"""

    bl_idname = "beyond_mocap.variants"
    bl_label = "Variants"
    count: IntProperty(name="How Many", default=3, min=2, max=9, description="How many takes to choose from")
    needs = (*NEEDS_LIBRARY, "Import tracking and choose a player in step 2 first",
             lambda context: active_player(context.scene.beyond_mocap) is not None)

    def wanted(self, context):
        """The active player."""
        player = active_player(context.scene.beyond_mocap)
        if player is None:
            raise InputError("variants", "no player is chosen", "a player", "choose one in step 2")
        return [(player, orders.How("variants", count=self.count))]


class BEYOND_MOCAP_OT_add_preset(AddPresetBase, bpy.types.Operator):
    """Keep the settings of Synthesize (method, weights, windows) under a name, for this and all other files"""

    bl_idname = "beyond_mocap.add_preset"
    bl_label = "Add Synthesis Preset"
    preset_menu = "BEYOND_MOCAP_MT_presets"
    preset_subdir = "beyond_mocap/synthesis"
    preset_defines = ["settings = bpy.context.scene.beyond_mocap"]
    preset_values = [f"settings.{row.identifier}" for row in rows_of("synthesis") if row.in_preset]
