"""Bake to Rig: a player's motion, or any armature's, onto somebody's own rig; and away again."""

from __future__ import annotations

import bpy
import numpy as np
from bpy.props import EnumProperty

from ..beyond_mocap.errors import InputError
from ..scene import bake, bone_maps, channels, rig, rig_bake, rig_copy, session
from ..scene.measure import frames_per_second
from ..scene.ride import riders
from ..scene.rigs import bake_record
from ..scene.rigs.driven import Driven, check
from ..scene.rigs.fit import BakeOptions
from ..scene.rigs.source import source_of
from ..scene.settings import active_player
from .verb import Verb

TARGETS = (
    ("CHOSEN", "The Chosen Rig", "The rig that the panel shows"),
    ("SELECTED", "Selected Armatures", "The same motion onto every selected armature but the source"),
    (
        "PLAYERS",
        "All Ticked Players",
        "Each ticked player's motion onto that player's rig, or a copy of the chosen one",
    ),
)


class BEYOND_MOCAP_OT_bake_to_rig(Verb, bpy.types.Operator):
    """Bake the active player's motion, or the source armature's, onto the rig: as keys on its controls, with its feet
on the ground. What the rig played before is kept as an action"""

    bl_idname = "beyond_mocap.bake_to_rig"
    bl_label = "Bake to Rig"

    targets: EnumProperty(
        name="Onto", items=TARGETS, default="CHOSEN", options={"SKIP_SAVE"}, description="Which rigs get the motion"
    )

    @classmethod
    def poll(cls, context):
        """A rig and something to bake."""
        settings = context.scene.beyond_mocap
        rigs = (settings.rig.target, *(player.rig for player in settings.players))
        if not any(rigs) and not any(o.type == "ARMATURE" for o in context.selected_objects):
            cls.poll_message_set("Choose the rig to bake to")
            return False
        cls.poll_message_set("Synthesize and accept first, or choose a source armature that moves")
        return source_body(settings) is not None

    def do(self, context):
        """All is worked out before the first rig is changed."""
        scene, settings = context.scene, context.scene.beyond_mocap
        wishes, work = wishes_of(settings.rig), []
        for body, player, target, table in self.pairs(context):
            source = source_of(body, scene, standing_of(scene, player))
            work.append((rig_bake.fitted(target, table, source, scene, wishes), target, table))
        lines = []
        for fitted, target, table in work:
            baked = rig_bake.lay(fitted)
            if settings.rig.reduces:
                baked.told.append(reduced(target, table, settings.rig))
            lines += [f"{fitted.name} on {target.name}: {len(baked.frames)} frames", *baked.told]
        settings.rig.told = "\n".join(lines)
        for line in lines[:1] if len(work) == 1 else lines:
            self.report({"INFO"}, line)

    def pairs(self, context) -> list:
        """(source body, its player or None, rig, map) of all that is to be baked."""
        settings = context.scene.beyond_mocap
        chosen = settings.rig
        if self.targets == "PLAYERS":
            return self.pairs_of_players(context)
        body, player = source_body(settings), active_player(settings) if chosen.source is None else None
        if self.targets == "CHOSEN":
            check(chosen.target, body)
            if not chosen.bones:
                rig.fill(chosen)
            return [(body, player, chosen.target, rig.table_of(chosen))]
        rigs = [one for one in context.selected_objects if one.type == "ARMATURE" and one != body]
        if not rigs:
            raise InputError("bake to rig", "no armature is selected beside the source", "rigs", "select them")
        for one in rigs:
            check(one, body)
        return [(body, player, one, table_for(chosen, one)) for one in rigs]

    def pairs_of_players(self, context) -> list:
        """Each ticked player's own rig, made where it is missing."""
        settings = context.scene.beyond_mocap
        players = [player for player in settings.players if player.use and player.body is not None]
        if not players:
            raise InputError("bake to rig", "no ticked player has a body", "players with a result", "synthesize first")
        lacking = [player for player in players if player.rig is None]
        if lacking:
            check(settings.rig.target)
        for player in players:
            check(player.rig or settings.rig.target, player.body)
            source_of(player.body, context.scene)
        for target in {player.rig or settings.rig.target for player in players} if lacking else ():
            Driven(target, table_for(settings.rig, target), context.scene)  # before anything is copied
        free = settings.rig.target if all(player.rig != settings.rig.target for player in players) else None
        for player in lacking:
            player.rig = free or rig_copy.copied(settings.rig.target, f"{player.name} rig")
            free = None
        context.view_layer.update()
        return [(player.body, player, player.rig, table_for(settings.rig, player.rig)) for player in players]


class BEYOND_MOCAP_OT_unbake(Verb, bpy.types.Operator):
    """Take the baked action off the rig and out of the file: it plays and stands as before"""

    bl_idname = "beyond_mocap.unbake"
    bl_label = "Remove Bake"

    @classmethod
    def poll(cls, context):
        """A rig that was baked."""
        cls.poll_message_set("The chosen rig plays nothing that was baked here")
        target = context.scene.beyond_mocap.rig.target
        playing = channels.playing(target)[0] if target is not None else None
        return playing is not None and bool(playing.get(bake_record.MARK))

    def do(self, context):
        """Off with it."""
        bake_record.remove(context.scene.beyond_mocap.rig.target)


class BEYOND_MOCAP_OT_reduce_keys(Verb, bpy.types.Operator):
    """Leave out keys of the rig's action that its curves do not need: hands, feet, head and bones stay within the
tolerances below"""

    bl_idname = "beyond_mocap.reduce_keys"
    bl_label = "Leave Out Keys"

    poll = BEYOND_MOCAP_OT_unbake.poll

    def do(self, context):
        """Fewer keys, told how many."""
        chosen = context.scene.beyond_mocap.rig
        chosen.told = reduced(chosen.target, table_for(chosen, chosen.target), chosen)
        self.report({"INFO"}, chosen.told)


def source_body(settings) -> bpy.types.Object | None:
    """The armature whose motion is baked; None where there is none."""
    player = active_player(settings)
    return settings.rig.source or (player.body if player is not None else None)


def standing_of(scene: bpy.types.Scene, player):
    """Function from scene frames (F,) to which feet stand (F, 2) in the player's take, or on the path that his body
    rides; None where there is none."""
    if player is not None and player.body is not None and player.body.beyond_mocap_ride.on:
        return riders.standing(player.body)
    made = session.made(player.take) if player is not None and player.take else None
    if made is None:
        return None
    take, fps = made.take, frames_per_second(scene)

    def standing(frames: np.ndarray) -> np.ndarray:
        at = np.round((frames - bake.frame_at(scene, take.start_time)) * take.motion.fps / fps).astype(int)
        inside = (at >= 0) & (at < len(take.contacts))
        return take.contacts[np.clip(at, 0, len(take.contacts) - 1)] & inside[:, None]

    return standing


def wishes_of(settings) -> BakeOptions:
    """How the panel says to bake."""
    keeps = {"AUTO": None, "KEEP": True, "SCALE": False}[settings.steps]
    return BakeOptions(settings.root, keeps, settings.ik == "BAKE", settings.plants)


def table_for(settings, target: bpy.types.Object) -> dict[str, str]:
    """The map for a rig: the panel's where its bones are the same, else what is kept or found."""
    if settings.target is not None and settings.bones \
            and bone_maps.fingerprint(settings.target) == bone_maps.fingerprint(target):
        return rig.table_of(settings)
    return bone_maps.kept(target) or bone_maps.suggest(target)


def reduced(target: bpy.types.Object, table: dict[str, str], settings) -> str:
    """Leave out keys, and a line about it."""
    from ..scene import key_reduction

    before, after = key_reduction.reduce(target, table, bpy.context.scene, settings.tolerance, settings.turn_tolerance)
    return f"keys: {after} of {before} left"
