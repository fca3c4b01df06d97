"""Rigs: map bones, bake a motion onto a rig, simplify keys, export motions."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper

from ..beyond_mocap.base.errors import InputError
from ..beyond_mocap.files.bvh import bvh
from ..scene.core import action, channels, session
from ..scene.core.measure import frames_per_second
from ..scene.core.settings import active_player
from ..scene.path_editing import riders
from ..scene.result import bake
from ..scene.rigs import armature, bone_maps, export, rig, rig_bake
from ..scene.rigs.driven import Driven, check
from ..scene.rigs.fit import BakeOptions, source_of
from .verb import ExportVerb, Verb


class MapVerb(Verb):
    """Base of operators about the chosen rig's bone map."""

    needs = "Choose a rig first", lambda context: context.scene.beyond_mocap.rig.target is not None


class BEYOND_MOCAP_OT_map_bones(MapVerb, bpy.types.Operator):
    """Find the rig's bones by their names, or by their structure where names do not help"""

    bl_idname = "beyond_mocap.map_bones"
    bl_label = "Map Bones"

    def do(self, context):
        settings = context.scene.beyond_mocap.rig
        settings.told = f"Bones mapped {rig.fill(settings, again=True)}"


class BEYOND_MOCAP_OT_keep_bone_map(MapVerb, bpy.types.Operator):
    """Store this map for all armatures with the same bones; it is used whenever one of them is chosen"""

    bl_idname = "beyond_mocap.keep_bone_map"
    bl_label = "Store for Skeleton"
    bl_options = {"REGISTER"}

    def do(self, context):
        """Check the map and write it to the user's folder."""
        settings = context.scene.beyond_mocap.rig
        table = rig.table_of(settings)
        bone_maps.check(settings.target, table)
        if bone_maps.keep(settings.target, table) is None:
            raise InputError("bone map", "this Blender has no folder for the extension", "an installed extension",
                             "save it as a file")
        self.report({"INFO"}, f"Map stored for skeletons like {settings.target.name}")


class BEYOND_MOCAP_OT_save_bone_map(MapVerb, bpy.types.Operator, ExportHelper):
    """Write the bone map to a JSON file"""

    bl_idname = "beyond_mocap.save_bone_map"
    bl_label = "Save Bone Map"
    bl_options = {"REGISTER"}
    filename_ext = ".json"
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def do(self, context):
        if not self.filepath:
            raise InputError("bone map", "no file given", "a .json file", "choose where to write it")
        settings = context.scene.beyond_mocap.rig
        bone_maps.save(Path(bpy.path.abspath(self.filepath)), settings.target, rig.table_of(settings))


class BEYOND_MOCAP_OT_load_bone_map(MapVerb, bpy.types.Operator, ImportHelper):
    """Read the bone map from a JSON file"""

    bl_idname = "beyond_mocap.load_bone_map"
    bl_label = "Load Bone Map"
    filename_ext = ".json"
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def do(self, context):
        if not self.filepath:
            raise InputError("bone map", "no file given", "a .json file", "choose one")
        settings = context.scene.beyond_mocap.rig
        table = bone_maps.load(Path(bpy.path.abspath(self.filepath)))
        bone_maps.check(settings.target, table)
        rig.show(settings, table)


class BEYOND_MOCAP_OT_use_selected_rig(Verb, bpy.types.Operator):
    """Use the active armature as the rig"""

    bl_idname = "beyond_mocap.use_selected_rig"
    bl_label = "Use Active Armature"
    needs = "Select the rig first", lambda context: context.object is not None and context.object.type == "ARMATURE"

    def do(self, context):
        """Choose the rig; its bones are mapped at once."""
        check(context.object)
        context.scene.beyond_mocap.rig.target = context.object


TARGETS = (("CHOSEN", "The Chosen Rig", "The rig that the panel shows"),
           ("SELECTED", "Selected Armatures", "Bake the same motion onto every selected armature except the source"),
           ("PLAYERS", "All Selected Players",
            "Bake each selected player's motion onto their own rig, or a copy of the chosen one"))


class BEYOND_MOCAP_OT_bake_to_rig(Verb, bpy.types.Operator):
    """Bake the active player's motion, or the source armature's, onto the rig as keys on its controls, with feet
planted; the rig's previous action is kept"""

    bl_idname = "beyond_mocap.bake_to_rig"
    bl_label = "Bake to Rig"
    targets: EnumProperty(name="Onto", items=TARGETS, default="CHOSEN", options={"SKIP_SAVE"},
                          description="Rigs that get the motion")

    @classmethod
    def poll(cls, context):
        settings = context.scene.beyond_mocap
        rigs = (settings.rig.target, *(player.rig for player in settings.players))
        if not any(rigs) and not any(o.type == "ARMATURE" for o in context.selected_objects):
            cls.poll_message_set("Choose the rig to bake to")
            return False
        cls.poll_message_set("Synthesize and press Apply first, or choose a source armature that moves")
        return source_body(settings) is not None

    def do(self, context):
        """Prepare all bakes before the first rig is changed."""
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
        """List (source body, its player or None, rig, map) of all bakes."""
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
            raise InputError("bake to rig", "no armature besides the source is selected", "rigs", "select them")
        for one in rigs:
            check(one, body)
        return [(body, player, one, table_for(chosen, one)) for one in rigs]

    def pairs_of_players(self, context) -> list:
        """List the bakes of all selected players; missing rigs are copied."""
        settings = context.scene.beyond_mocap
        players = [player for player in settings.players if player.use and player.body is not None]
        if not players:
            raise InputError("bake to rig", "no selected player has a body", "a result", "synthesize first")
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
            player.rig = free or armature.copy_rig(settings.rig.target, f"{player.name} rig")
            free = None
        context.view_layer.update()
        return [(player.body, player, player.rig, table_for(settings.rig, player.rig)) for player in players]


class BEYOND_MOCAP_OT_unbake(Verb, bpy.types.Operator):
    """Remove the baked action from the rig and the file, and restore the rig's previous state"""

    bl_idname = "beyond_mocap.unbake"
    bl_label = "Remove Bake"
    needs = ("The chosen rig has no baked motion",
             lambda context: (target := context.scene.beyond_mocap.rig.target) is not None
             and bool((channels.playing(target)[0] or {}).get(rig_bake.MARK)))

    def do(self, context):
        rig_bake.remove_bake(context.scene.beyond_mocap.rig.target)


class BEYOND_MOCAP_OT_reduce_keys(Verb, bpy.types.Operator):
    """Remove keys of the rig's action that its curves do not need: hands, feet, head and bones stay within the
tolerances"""

    bl_idname = "beyond_mocap.reduce_keys"
    bl_label = "Simplify Keys"
    needs = BEYOND_MOCAP_OT_unbake.needs

    def do(self, context):
        """Reduce the keys and report the numbers."""
        chosen = context.scene.beyond_mocap.rig
        chosen.told = reduced(chosen.target, table_for(chosen, chosen.target), chosen)
        self.report({"INFO"}, chosen.told)


def source_body(settings) -> bpy.types.Object | None:
    """Find the armature whose motion is baked; None where there is none."""
    player = active_player(settings)
    return settings.rig.source or (player.body if player is not None else None)


def standing_of(scene: bpy.types.Scene, player):
    """Build a function from scene frames (F,) to foot contacts (F, 2) of the player's take or path edit; None without.
    """
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
    """Build the bake options from the panel's settings."""
    keeps = {"AUTO": None, "KEEP": True, "SCALE": False}[settings.steps]
    return BakeOptions(settings.root, keeps, settings.ik == "BAKE", settings.plants)


def table_for(settings, target: bpy.types.Object) -> dict[str, str]:
    """Find the map for a rig: the panel's where its bones are the same, else a stored or newly found one."""
    if settings.target is not None and settings.bones \
            and bone_maps.fingerprint(settings.target) == bone_maps.fingerprint(target):
        return rig.table_of(settings)
    return bone_maps.kept(target) or bone_maps.suggest(target)


def reduced(target: bpy.types.Object, table: dict[str, str], settings) -> str:
    """Reduce the keys; returns a message."""
    from ..scene.rigs import key_reduction

    before, after = key_reduction.reduce(target, table, bpy.context.scene, settings.tolerance, settings.turn_tolerance)
    return f"Keys: {after} of {before} remain"


class BEYOND_MOCAP_OT_export_motion(ExportVerb, bpy.types.Operator):
    """Export the displayed motion of a rig, with its meshes, to a file; it is baked to one action first and the scene
stays unchanged"""

    bl_idname = "beyond_mocap.export_motion"
    bl_label = "Export Motion"
    filter_glob: StringProperty(default="*.fbx;*.glb;*.usdc;*.bvh", options={"HIDDEN"})
    format: EnumProperty(name="Format", items=rig.FORMATS, default="FBX", description="Format of the file")
    engine: EnumProperty(name="For", items=rig.ENGINES, default="BLENDER", description="Program to export for")
    who: EnumProperty(name="Export", items=rig.WHO, default="ACTIVE", description="Armatures to export")
    root: EnumProperty(name="Root Motion", items=rig.ROOTS, default="KEEP", description="Motion of the root bone")
    own_rate: BoolProperty(name="Take Rate", default=False, description="Export at the frame rate of the take")
    deform_only: BoolProperty(name="Deform Bones Only", default=True, description="Leave out control bones")
    meshes: BoolProperty(name="Meshes", default=True, description="Also export the meshes that the armature moves")
    needs = ("Synthesize and press Apply first, or select an armature that moves",
             lambda context: bool((settings := context.scene.beyond_mocap).players) or settings.rig.target is not None
             or any(one.type == "ARMATURE" for one in context.selected_objects))

    def invoke(self, context, event):
        """Copy the panel's settings, then open the file browser."""
        settings = context.scene.beyond_mocap.rig
        for name in ("format", "engine", "who", "root", "own_rate", "deform_only", "meshes"):
            setattr(self, name, getattr(settings, name))
        return super().invoke(context, event)

    def do(self, context):
        path = self.out()
        rigs = self.rigs(context)
        wanted = export.Wanted(path, self.format, self.engine, rate=self.rate(context), root=self.root,
                               deform_only=self.deform_only, meshes=self.meshes)
        for line in export.write(context, rigs, wanted):
            self.report({"INFO"}, line)
        self.report({"INFO"}, f"Written: {path}")

    def rigs(self, context) -> list[bpy.types.Object]:
        """List the armatures to export."""
        settings = context.scene.beyond_mocap
        if self.who == "SELECTED":
            return [one for one in context.selected_objects if one.type == "ARMATURE"]
        if self.who == "PLAYERS":
            chosen = [player.rig or player.body for player in settings.players if player.use]
            return [one for one in chosen if one is not None]
        player = active_player(settings)
        if settings.rig.target is not None and (settings.rig.source or player is None or player.rig is None):
            return [settings.rig.target]
        if player is not None and (player.rig or player.body) is not None:
            return [player.rig or player.body]
        active = context.object
        return [active] if active is not None and active.type == "ARMATURE" else []

    def rate(self, context) -> float | None:
        """Find the frame rate of the active player's take; None for the scene's."""
        if not self.own_rate:
            return None
        player = active_player(context.scene.beyond_mocap)
        made = session.made(player.take) if player is not None and player.take else None
        return made.take.motion.fps if made is not None else None


class BEYOND_MOCAP_OT_export_bvh(Verb, bpy.types.Operator, ExportHelper):
    """Write the active armature's motion as BVH: centimetres, Y up, at the scene's frame rate"""

    bl_idname = "beyond_mocap.export_bvh"
    bl_label = "Export BVH"
    bl_options = {"REGISTER"}
    filename_ext = ".bvh"
    filter_glob: StringProperty(default="*.bvh", options={"HIDDEN"})
    needs = "Select an armature first", lambda context: context.object is not None and context.object.type == "ARMATURE"

    def do(self, context):
        """Read the action, write the file."""
        if not self.filepath:
            raise InputError("export", "no file given", "a .bvh file", "choose where to write it")
        motion = action.read(context.object, context.scene)
        for note in bvh.write(bpy.path.abspath(self.filepath), motion):
            self.report({"INFO"}, note)
        self.report({"INFO"}, f"{len(motion)} frames written to {self.filepath}")
