"""Rigs: map bones, bake a motion onto a rig, simplify keys, export motions."""

from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper

from ..beyond_mocap.base.errors import InputError, format_some
from ..beyond_mocap.base.fixes import Fix
from ..beyond_mocap.files.bvh import bvh
from ..scene.characters import player_character
from ..scene.core import action, channels, session, take_record, window
from ..scene.core.settings import find_active_player, to_absolute_path
from ..scene.match import match_objects
from ..scene.rigs import armature, bone_maps, driven, engine_files, export, exporters, fit, rig, rig_bake
from .operator_base import BaseOperator, ExportOperator


class BoneMapOperator(BaseOperator):
    """Base of operators about the chosen rig's bone map."""

    needs = "Choose a rig first", lambda context: context.scene.beyond_mocap.rig.target is not None


class BEYOND_MOCAP_OT_map_bones(BoneMapOperator, bpy.types.Operator):
    """Find the rig's bones by their names, or by their structure where names do not help"""

    bl_idname = "beyond_mocap.map_bones"
    bl_label = "Map Bones"

    def do(self, context):
        settings = context.scene.beyond_mocap.rig
        settings.messages = f"Bones mapped {rig.fill_bone_map(settings, ignores_stored=True)}"


class BEYOND_MOCAP_OT_keep_bone_map(BoneMapOperator, bpy.types.Operator):
    """Store this map for all armatures with the same bones; it is used whenever one of them is chosen"""

    bl_idname = "beyond_mocap.keep_bone_map"
    bl_label = "Store for Skeleton"
    bl_options = {"REGISTER"}

    def do(self, context):
        """Check the map and write it to the user's folder."""
        settings = context.scene.beyond_mocap.rig
        table = rig.read_bone_list(settings)
        bone_maps.check_bone_map(settings.target, table)
        if bone_maps.store_bone_map(settings.target, table) is None:
            raise InputError("bone map", "this Blender has no folder for the extension", "an installed extension",
                             "save it as a file")
        self.report({"INFO"}, f"Map stored for skeletons like {settings.target.name}")


class BEYOND_MOCAP_OT_save_bone_map(BoneMapOperator, bpy.types.Operator, ExportHelper):
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
        bone_maps.write_bone_map(Path(bpy.path.abspath(self.filepath)), settings.target, rig.read_bone_list(settings))


class BEYOND_MOCAP_OT_load_bone_map(BoneMapOperator, bpy.types.Operator, ImportHelper):
    """Read the bone map from a JSON file"""

    bl_idname = "beyond_mocap.load_bone_map"
    bl_label = "Load Bone Map"
    filename_ext = ".json"
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def do(self, context):
        if not self.filepath:
            raise InputError("bone map", "no file given", "a .json file", "choose one")
        settings = context.scene.beyond_mocap.rig
        table = bone_maps.read_bone_map(Path(bpy.path.abspath(self.filepath)))
        bone_maps.check_bone_map(settings.target, table)
        rig.show_bone_map(settings, table)


class BEYOND_MOCAP_OT_use_selected_rig(BaseOperator, bpy.types.Operator):
    """Use the active armature as the rig"""

    bl_idname = "beyond_mocap.use_selected_rig"
    bl_label = "Use Active Armature"
    needs = "Select the rig first", lambda context: context.object is not None and context.object.type == "ARMATURE"

    def do(self, context):
        """Choose the rig; its bones are mapped at once."""
        driven.check_rig(context.object)
        context.scene.beyond_mocap.rig.target = context.object


TARGETS = (("CHOSEN", "The Chosen Rig", "The rig that the panel shows"),
           ("SELECTED", "Selected Armatures", "Bake the same motion onto every selected armature except the source"),
           ("PLAYERS", "All Selected Players",
            "Bake each selected player's motion onto their own rig, or a copy of the chosen one"))


class BEYOND_MOCAP_OT_bake_to_rig(BaseOperator, bpy.types.Operator):
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
        return find_source_body(settings) is not None

    def do(self, context):
        """Prepare all bakes before the first rig is changed."""
        scene, settings = context.scene, context.scene.beyond_mocap
        options, work = build_bake_options(settings.rig), []
        for body, target, table in self.list_bakes(context):
            source = fit.read_source(body, scene)
            work.append((rig_bake.prepare_bake(target, table, source, scene, options), target, table))
        lines = []
        for prepared, target, table in work:
            baked = rig_bake.apply_bake(prepared)
            if settings.rig.reduces:
                baked.messages.append(reduce_rig_keys(target, table, settings.rig))
            lines += [f"{prepared.name} on {target.name}: {len(baked.frames)} frames", *baked.messages]
        if not all(export.list_meshes(scene, target) for _, target, _ in work):
            window.show_bones()  # without a mesh, bones are all there is to see
        settings.rig.messages = "\n".join(lines)
        for line in lines[:1] if len(work) == 1 else lines:
            self.report({"INFO"}, line)

    def list_bakes(self, context) -> list:
        """List (source body, rig, map) of all bakes."""
        settings = context.scene.beyond_mocap
        chosen = settings.rig
        if self.targets == "PLAYERS":
            return self.list_player_bakes(context)
        body = find_source_body(settings)
        if self.targets == "CHOSEN":
            driven.check_rig(chosen.target, body)
            if not chosen.bones:
                rig.fill_bone_map(chosen)
            return [(body, chosen.target, rig.read_bone_list(chosen))]
        rigs = [one for one in context.selected_objects if one.type == "ARMATURE" and one != body]
        if not rigs:
            raise InputError("bake to rig", "no armature besides the source is selected", "rigs", "select them")
        for one in rigs:
            driven.check_rig(one, body)
        return [(body, one, find_bone_map(chosen, one)) for one in rigs]

    def list_player_bakes(self, context) -> list:
        """List the bakes of all selected players; missing rigs are copied."""
        settings = context.scene.beyond_mocap
        players = [player for player in settings.players if player.use and player.body is not None]
        if not players:
            raise InputError("bake to rig", "no selected player has a body", "a result", "synthesize first")
        players_without_rig = [player for player in players if player.rig is None]
        if players_without_rig:
            driven.check_rig(settings.rig.target)
        for player in players:
            driven.check_rig(player.rig or settings.rig.target, player.body)
            fit.read_source(player.body, context.scene)
        for target in {player.rig or settings.rig.target for player in players} if players_without_rig else ():
            driven.DrivenRig(target, find_bone_map(settings.rig, target), context.scene)  # before anything is copied
        free = settings.rig.target if all(player.rig != settings.rig.target for player in players) else None
        for player in players_without_rig:
            player.rig = free or armature.copy_rig(settings.rig.target, f"{player.name} rig")
            free = None
        context.view_layer.update()
        return [(player.body, player.rig, find_bone_map(settings.rig, player.rig)) for player in players]


class BEYOND_MOCAP_OT_unbake(BaseOperator, bpy.types.Operator):
    """Remove the baked action from the rig and the file, and restore the rig's previous state"""

    bl_idname = "beyond_mocap.unbake"
    bl_label = "Remove Bake"
    needs = ("The chosen rig has no baked motion",
             lambda context: (target := context.scene.beyond_mocap.rig.target) is not None
             and bool((channels.find_playing_action(target)[0] or {}).get(rig_bake.MARK)))

    def do(self, context):
        rig_bake.remove_bake(context.scene.beyond_mocap.rig.target)


class BEYOND_MOCAP_OT_reduce_keys(BaseOperator, bpy.types.Operator):
    """Remove keys of the rig's action that its curves do not need: hands, feet, head and bones stay within the
tolerances"""

    bl_idname = "beyond_mocap.reduce_keys"
    bl_label = "Simplify Keys"
    needs = BEYOND_MOCAP_OT_unbake.needs

    def do(self, context):
        """Reduce the keys and report the numbers."""
        chosen = context.scene.beyond_mocap.rig
        chosen.messages = reduce_rig_keys(chosen.target, find_bone_map(chosen, chosen.target), chosen)
        self.report({"INFO"}, chosen.messages)


def find_source_body(settings) -> bpy.types.Object | None:
    """Find the armature whose motion is baked; None where there is none."""
    player = find_active_player(settings)
    return settings.rig.source or (player.body if player is not None else None)


def build_bake_options(settings) -> "fit.BakeOptions":
    """Build the bake options from the panel's settings."""
    keeps = {"AUTO": None, "KEEP": True, "SCALE": False}[settings.steps]
    return fit.BakeOptions(settings.root, keeps, settings.ik == "BAKE", settings.plants)


def find_bone_map(settings, target: bpy.types.Object) -> dict[str, str]:
    """Find the map for a rig: the panel's where its bones are the same, else a stored or newly found one."""
    if settings.target is not None and settings.bones \
            and bone_maps.compute_rig_fingerprint(settings.target) == bone_maps.compute_rig_fingerprint(target):
        return rig.read_bone_list(settings)
    return bone_maps.load_stored_map(target) or bone_maps.find_bone_map(target)


def reduce_rig_keys(target: bpy.types.Object, table: dict[str, str], settings) -> str:
    """Reduce the keys; returns a message."""
    from ..scene.rigs import key_reduction

    before, after = key_reduction.reduce_keys(target, table, bpy.context.scene, settings.tolerance,
                                              settings.turn_tolerance)
    return f"Keys: {after} of {before} remain"


class BEYOND_MOCAP_OT_export_motion(ExportOperator, bpy.types.Operator):
    """Export the displayed motion of a rig, with its meshes, to a file; it is baked to one action first and the scene
stays unchanged"""

    bl_idname = "beyond_mocap.export_motion"
    bl_label = "Export Motion"
    filter_glob: StringProperty(default="*.fbx;*.glb;*.usdc;*.abc;*.bvh", options={"HIDDEN"})
    format: EnumProperty(name="Format", items=rig.FORMATS, default="FBX", description="Format of the file")
    engine: EnumProperty(name="For", items=rig.ENGINES, default="BLENDER", description="Program to export for")
    who: EnumProperty(name="Export", items=rig.EXPORT_CHOICES, default="ACTIVE", description="Armatures to export")
    root: EnumProperty(name="Root Motion", items=rig.ROOTS, default="KEEP", description="Motion of the root bone")
    own_rate: BoolProperty(name="Take Rate", default=False, description="Export at the frame rate of the take")
    deform_only: BoolProperty(name="Deform Bones Only", default=True, description="Leave out control bones")
    meshes: BoolProperty(name="Meshes", default=True, description="Also export the meshes that the armature moves")
    keep_root: BoolProperty(name="Recorded Root", default=False, description=rig.KEEP_ROOT)
    needs = ("Synthesize and press Apply first, or select an armature that moves",
             lambda context: bool((settings := context.scene.beyond_mocap).players) or settings.rig.target is not None
             or any(one.type == "ARMATURE" for one in context.selected_objects))

    def invoke(self, context, event):
        """Copy the panel's settings, then open the file browser."""
        settings = context.scene.beyond_mocap.rig
        for name in ("format", "engine", "who", "root", "own_rate", "deform_only", "meshes", "keep_root"):
            setattr(self, name, getattr(settings, name))
        return super().invoke(context, event)

    def do(self, context):
        path = self.output_path()
        rigs = self.list_rigs(context)
        options = export.ExportOptions(path, self.format, self.engine, rate=self.find_rate(context), root=self.root,
                                       deform_only=self.deform_only, meshes=self.meshes,
                                       above=self.read_root(context) if self.keep_root else ())
        for line in export.export_motion(context, rigs, options):
            self.report({"INFO"}, line)
        names = format_some([one.name for one in rigs])
        left_out = player_character.describe_left_out(context.scene.beyond_mocap, rigs)
        self.report({"INFO"}, f"Written: {path} with {names}{left_out}")

    def list_rigs(self, context) -> list[bpy.types.Object]:
        """List the armatures to export."""
        if self.who == "SELECTED":
            return [one for one in context.selected_objects if one.type == "ARMATURE"]
        settings = context.scene.beyond_mocap
        player = find_active_player(settings)
        if self.who == "ACTIVE" and settings.rig.target is not None and (
                settings.rig.source or player is None or player.rig is None):
            return [settings.rig.target]
        return engine_files.list_delivered_rigs(context, self.who)

    def read_root(self, context) -> tuple:
        """Read the joints above the hips in the library's recordings; InputError without a built library."""
        from ..beyond_mocap.library.common_skeleton import read_joints_above_hips

        settings = context.scene.beyond_mocap
        unit = settings.library_unit or None
        library = session.find_library(to_absolute_path(settings.library_folder), unit)
        if library is None:
            raise InputError("export", "no library is built, whose recordings have a root", "the library of step 1",
                             "press Build Library, or switch Recorded Root off",
                             fixes=(Fix("press", "beyond_mocap.build_library"),))
        above = read_joints_above_hips(library, None, unit)
        if not above:
            self.report({"WARNING"}, "The library's recordings have no joint above the hips; none is added")
        return above

    def find_rate(self, context) -> float | None:
        """Find the frame rate of the active player's take; None for the scene's."""
        if not self.own_rate:
            return None
        player = find_active_player(context.scene.beyond_mocap)
        rate = take_record.read_rate(player.body) if player is not None and player.body is not None else None
        if rate is None:
            self.report({"WARNING"}, "The take's rate is not known; exported at the scene's frame rate. "
                                     "Press Synthesize and Apply to store it")
        return rate


class BEYOND_MOCAP_OT_deliver(BaseOperator, bpy.types.Operator):
    """Write files for an engine or another program into a folder, one for each player or one of the whole scene; the
scene stays unchanged"""

    bl_idname = "beyond_mocap.deliver"
    bl_label = "Deliver"
    bl_options = {"REGISTER", "PRESET"}
    directory: StringProperty(name="Folder", subtype="DIR_PATH", options={"SKIP_SAVE"},
                              description="Folder for the files; those of the same names are replaced")
    filter_folder: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    preset: EnumProperty(name="For", items=rig.ENGINE_PRESETS, default="UNREAL",
                         description="Program to deliver to")
    who: EnumProperty(name="Deliver", items=rig.DELIVERIES, default="ACTIVE",
                      description="What is delivered")
    root: EnumProperty(name="Root Motion", items=rig.ENGINE_ROOTS, default="SMOOTH",
                       description="Motion of the root bone")
    meshes: BoolProperty(name="Meshes", default=True, description="Also deliver the meshes that armatures move")

    def invoke(self, context, _event):
        """Choose the folder."""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def draw(self, _context):
        """Draw the settings beside the file browser."""
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.prop(self, "preset")
        layout.prop(self, "who")
        column = layout.column()
        column.active = self.who != "SCENE"
        column.prop(self, "root")
        column.prop(self, "meshes")

    def do(self, context):
        """Write the files and report them."""
        if not self.directory:
            raise InputError("export", "no folder given", "a folder to write to", "choose a folder")
        folder = Path(bpy.path.abspath(self.directory))
        if self.who == "SCENE":
            suffix = exporters.SUFFIXES[engine_files.PRESETS[self.preset].format]
            name = Path(bpy.data.filepath).stem or "scene"
            lines = engine_files.deliver_scene(context, folder / f"{name}{suffix}", self.preset)
        else:
            rigs = engine_files.list_delivered_rigs(context, self.who)
            if self.who == "MATCH":
                for line in match_objects.describe_left_out(context.scene, rigs):
                    self.report({"WARNING"}, line)
            lines = engine_files.deliver_players(context, rigs, folder, self.preset, self.root, meshes=self.meshes)
        for line in lines:
            self.report({"INFO"}, line)


class BEYOND_MOCAP_OT_export_bvh(BaseOperator, bpy.types.Operator, ExportHelper):
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
        motion = action.read_motion(context.object, context.scene)
        for note in bvh.write_bvh(bpy.path.abspath(self.filepath), motion):
            self.report({"INFO"}, note)
        left_out = player_character.describe_left_out(context.scene.beyond_mocap, [context.object])
        self.report({"INFO"}, f"{len(motion)} frames of {context.object.name} written to {self.filepath}{left_out}")
