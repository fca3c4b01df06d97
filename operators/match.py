"""Operators of a match: read its files, synthesize and show a stretch of it, its cameras, its export."""

from pathlib import Path

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty, StringProperty

from ..beyond_mocap.base.errors import InputError, format_count
from ..beyond_mocap.base.fixes import Fix
from ..beyond_mocap.files.tracking import providers
from ..scene.core import channels, session, window
from ..scene.core.measure import frames_per_second
from ..scene.core.settings import to_setting_path
from ..scene.match import command_process as child
from ..scene.match import load, show
from ..scene.match import match_objects as ours
from ..scene.match import request as order
from ..scene.match.settings import find_active_player, format_float
from ..scene.rigs import export, rig
from ..scene.stage import cameras, eyes, stage
from .operator_base import NEEDS_LIBRARY, BackgroundOperator, BaseOperator, ExportOperator, ViewDropHandler

SYNTHESIS_SHARE = 0.85
"""Share of the progress bar for the synthesis, before a match is shown."""


class MatchVerb(BackgroundOperator):
    """An operator that ends with a stretch of a match in the scene."""

    bl_options = {"REGISTER", "UNDO"}

    @property
    def presents(self):
        """The first stretch that is shown is framed; one in place of another is not."""
        return not ours.find_armatures(bpy.context.scene)

    def find_library(self, wanted: "load.DisplayRequest"):
        """Find the library if this session has it."""
        return session.find_library(wanted.library, wanted.unit)

    def apply(self, scene, result):
        """Show pitch, characters, ball and cameras, and report messages."""
        wanted, (library, scenery, lines), notes = result
        match = scene.beyond_mocap_match
        match.made = "" if match.folder else to_setting_path(wanted.folder)
        if scene != bpy.context.scene:
            raise InputError("match", f"scene {scene.name} is not the window's scene", "the scene it was started in",
                             "switch to it and press Show Match")
        session.store_library(library, wanted.unit)
        first = match.first_frame
        took = show.show_match(bpy.context, scenery, first)
        match.shown, match.shown_start, match.shown_first = wanted.folder, scenery.start, first
        match.shown_rate = frames_per_second(scene)
        known, match.quality = match.report.splitlines(), scenery.quality
        match.messages = "\n".join(line for line in dict.fromkeys((*lines, *notes)) if line not in known)
        for line in lines:
            self.report({"WARNING"}, line)
        seconds = scenery.end - scenery.start
        self.report(
            {"INFO"}, f"{format_count(len(scenery.characters), 'player')}, {seconds:.1f} s, shown in "
            f"{sum(took.values()):.1f} s")


class BEYOND_MOCAP_OT_read_match(BackgroundOperator, bpy.types.Operator):
    """Read a provider's tracking of a match, fill the list of players, the teams' colours and the data report, and
select the first minute"""

    bl_idname = "beyond_mocap.read_match"
    bl_label = "Read Match"
    kind = "match file"
    filepath: StringProperty(name="File", subtype="FILE_PATH", options={"SKIP_SAVE"},
                             description="Tracking file; empty: the one in the panel")
    directory: StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE", "HIDDEN"})
    files: CollectionProperty(type=bpy.types.OperatorFileListElement, options={"SKIP_SAVE", "HIDDEN"})

    def order(self, context):
        """Choose the files; of several dropped files the largest is the tracking, and the others are found beside
        it.
        """
        dropped = [Path(self.directory, name) for name in sorted(file.name for file in self.files) if name]
        sizes = {path: path.stat().st_size if path.is_file() else 0 for path in dropped}
        chosen = str(max(dropped, key=sizes.get)) if self.directory and dropped else self.filepath
        return order.build_read_request(context.scene.beyond_mocap_match, bpy.path.abspath(chosen) if chosen else "")

    @staticmethod
    def run_job(asked, progress, cancelled, hurry):
        return order.read_match(asked, progress)

    def apply(self, scene, result):
        asked, read = result
        match = scene.beyond_mocap_match
        order.update_match(match, asked, read)
        scene.beyond_mocap.task = "MATCH"
        for line in match.report.splitlines()[:6]:
            self.report({"INFO"}, line)
        provider = providers.PROVIDERS.get(read.provider)
        self.report({"INFO"}, f"{format_count(len(read.players), 'player')}, {match.length_s / 60.0:.1f} minutes, "
                    + (provider.title if provider is not None else "skeletal tracking"))


class BEYOND_MOCAP_FH_match(ViewDropHandler, bpy.types.FileHandler):
    """Read a provider's tracking file dropped into the 3D view"""

    bl_idname = "BEYOND_MOCAP_FH_match"
    bl_label = "Match of All Players"
    bl_import_operator = "beyond_mocap.read_match"
    # dropped texts are labels; tracking as text is chosen by name
    bl_file_extensions = ".csv;.json;.jsonl;.joints;.xml;.dat;.gpx"


SELECTION_ITEMS = (("ALL", "All", "Select all"), ("NONE", "None", "Select none"),
                   ("home", "Home", "Select the home team only"), ("away", "Away", "Select the away team only"),
                   ("ONE", "Active", "Select the active player only"))


class BEYOND_MOCAP_OT_tick_match(BaseOperator, bpy.types.Operator):
    """Select the players of the match"""

    bl_idname = "beyond_mocap.tick_match"
    bl_label = "Select Players"
    whom: EnumProperty(name="Players", items=SELECTION_ITEMS, default="ALL", description="Players to select")
    needs = "Press Read Match first", lambda context: len(context.scene.beyond_mocap_match.players) > 0

    @classmethod
    def description(cls, _context, properties):
        return next(item[2] for item in SELECTION_ITEMS if item[0] == properties.whom)

    def do(self, context):
        match = context.scene.beyond_mocap_match
        chosen = find_active_player(match)
        for player in match.players:
            alone = player == chosen if self.whom == "ONE" else player.team == self.whom
            player.use = self.whom == "ALL" or (self.whom != "NONE" and alone)


class BEYOND_MOCAP_OT_make_match(MatchVerb, bpy.types.Operator):
    """Synthesize all selected players and the ball from From to To, in other processes, and show them; ESC cancels,
and pressing the button again resumes with the finished work"""

    bl_idname = "beyond_mocap.make_match"
    bl_label = "Make Match"
    kind = "match"
    left = "cancelled; finished work is kept, press Make Match again to resume"
    needs = (*NEEDS_LIBRARY, "Choose a tracking file of a match, or drop one into the view, first",
             lambda context: bool(context.scene.beyond_mocap_match.tracking_file))

    def order(self, context):
        """Build the command line, and the request to display its result."""
        wanted = order.build_display_request(context.scene, order.choose_output_folder(context.scene))
        return order.build_command(context.scene), wanted, self.find_library(wanted)

    @staticmethod
    def run_job(asked, progress, cancelled, hurry):
        """Run the command in its own process, then load the result."""
        arguments, wanted, library = asked
        notes = child.run_command(arguments, lambda done, text: progress(SYNTHESIS_SHARE * done, text), cancelled)
        shown = load.load_section(wanted, library, lambda done, text: progress(SYNTHESIS_SHARE + (1.0 - SYNTHESIS_SHARE)
                                                                               * done, text), cancelled)
        return wanted, shown, notes


class BEYOND_MOCAP_OT_show_match(MatchVerb, bpy.types.Operator):
    """Show a stretch of a match, from From to To, with players in kits, ball, pitch and cameras, in place of the one
that is displayed"""

    bl_idname = "beyond_mocap.show_match"
    bl_label = "Show Match"
    kind = "match"
    needs = (*NEEDS_LIBRARY, "Press Make Match, or choose the folder of a match, first",
             lambda context: bool((match := context.scene.beyond_mocap_match).folder or match.made))

    def order(self, context):
        wanted = order.build_display_request(context.scene, order.choose_display_folder(context.scene))
        return wanted, self.find_library(wanted)

    @staticmethod
    def run_job(asked, progress, cancelled, hurry):
        wanted, library = asked
        return wanted, load.load_section(wanted, library, progress, cancelled), ()


class ShownMatchVerb(BaseOperator):
    """An operator on the displayed match."""

    needs = "Press Make Match or Show Match first", lambda context: bool(ours.find_armatures(context.scene))


class BEYOND_MOCAP_OT_match_second(ShownMatchVerb, bpy.types.Operator):
    """Go to a second of the displayed match and select a player, such as for a worst second on the match's report
page"""

    bl_idname = "beyond_mocap.match_second"
    bl_label = "Go to Match Second"
    seconds: FloatProperty(name="Second", options={"SKIP_SAVE"}, description="Second of the match's clock")
    player: StringProperty(name="Player", options={"SKIP_SAVE"}, description="ID in the feed; empty: none")

    def invoke(self, context, _event):
        return context.window_manager.invoke_props_dialog(self)

    def do(self, context):
        """Set the frame and select the body."""
        scene, shown = context.scene, context.scene.beyond_mocap_match
        rate = shown.shown_rate or frames_per_second(scene)  # keys keep their frames if the scene's rate changes
        frame = round(shown.shown_first + (self.seconds - shown.shown_start) * rate)
        last = _find_last_frame(scene)
        if not shown.shown_first <= frame <= last:
            end = shown.shown_start + (last - shown.shown_first) / rate
            expected = f"{format_float(shown.shown_start)} to {format_float(end)} s"
            raise InputError("match", f"{format_float(self.seconds)} s is not shown", expected,
                             "choose From and To around it and press Show Match",
                             fixes=(Fix("press", "beyond_mocap.show_match"),))
        body = _find_body(scene, self.player) if self.player else None
        scene.frame_set(frame)
        if body is not None and body.name in context.view_layer.objects and context.mode == "OBJECT":
            window.select_only(context, body)


def _find_body(scene: bpy.types.Scene, player: str) -> bpy.types.Object:
    """Find a player's armature; InputError if the player is not displayed."""
    known = {thing.get(ours.PLAYER_PROPERTY): thing for thing in ours.find_armatures(scene)}
    if player not in known:
        raise InputError("match", f"{player} is not shown", f"one of {', '.join(map(str, known))}",
                         "select the player and press Show Match", fixes=(Fix("press", "beyond_mocap.show_match"),))
    return known[player]


def _find_last_frame(scene: bpy.types.Scene) -> int:
    """Find the last frame with a motion; the scene's last frame if there is none."""
    actions = [channels.find_playing_action(body)[0] for body in ours.find_armatures(scene)]
    return round(max((action.frame_range[1] for action in actions if action is not None), default=scene.frame_end))


CAMERA_ITEMS = (("STAND", "Broadcast", "Look from the stand, following the ball"),
                ("EYES", "Eyes", "Look through the eyes of the selected player, or of the active one in the list"))


class BEYOND_MOCAP_OT_match_camera(ShownMatchVerb, bpy.types.Operator):
    """Look through one of the match's cameras"""

    bl_idname = "beyond_mocap.match_camera"
    bl_label = "Match Camera"
    which: EnumProperty(name="Which", items=CAMERA_ITEMS, default="STAND", description="Camera to look through")
    player: StringProperty(name="Player", options={"SKIP_SAVE"}, description="ID of the player; empty: the active one")

    @classmethod
    def description(cls, context, properties):
        chosen = find_active_player(context.scene.beyond_mocap_match)
        if properties.which == "EYES" and chosen is not None:
            return f"Look through the eyes of the selected player, or of {chosen.name or chosen.feed_id} if none is"
        return next(item[2] for item in CAMERA_ITEMS if item[0] == properties.which)

    def do(self, context):
        """Make it the scene's camera, and look through it in the 3D view."""
        scene = context.scene
        if self.which == "EYES":
            camera = eyes.create_eyes_camera(scene, self.find_body(context), show.find_ball(scene))
        else:
            camera = cameras.get_camera(scene, "BROADCAST")
        scene.camera = camera
        window.look_through_camera(context)

    def find_body(self, context) -> bpy.types.Object:
        """Find the armature that is named, selected, or active in the list."""
        shown, active = ours.find_armatures(context.scene), context.active_object
        if not self.player and active is not None:
            active = active.parent if active.type == "MESH" else active
            if active in shown and active.select_get():
                return active
        chosen = find_active_player(context.scene.beyond_mocap_match)
        return _find_body(context.scene, self.player
                          or (chosen.feed_id if chosen else shown[0].get(ours.PLAYER_PROPERTY)))


FORMATS = [one for one in rig.FORMATS if one[0] != "BVH"]


class BEYOND_MOCAP_OT_match_export(ExportOperator, bpy.types.Operator):
    """Write the displayed match to one file, with a skeleton and meshes for every player, the ball and the pitch; the
scene is not changed"""

    bl_idname = "beyond_mocap.match_export"
    bl_label = "Export Match"
    filter_glob: StringProperty(default="*.fbx;*.glb;*.usdc;*.abc", options={"HIDDEN"})
    format: EnumProperty(name="Format", items=FORMATS, default="GLB", description="File format")
    engine: EnumProperty(name="For", items=rig.ENGINES, default="BLENDER", description="Target program")
    root: EnumProperty(name="Root Motion", items=rig.ROOTS, default="KEEP", description="Motion of the root bone")
    pitch: BoolProperty(name="Pitch", default=True, description="Include grass, lines and goals")
    needs = "Show a match first", lambda context: bool(ours.find_armatures(context.scene))

    def do(self, context):
        path = self.output_path()
        scene = context.scene
        bodies = [body for body in ours.find_armatures(scene) if body.name in context.view_layer.objects]
        for line in ours.describe_left_out(scene, bodies):
            self.report({"WARNING"}, line)
        wanted = export.ExportOptions(path, self.format, self.engine, None, self.root)
        things = ours.find_meshes(scene, "ball") + (stage.find_pitch(scene) if self.pitch else [])
        for line in export.export_motion(context, bodies, wanted, things):
            self.report({"INFO"}, line)
        self.report({"INFO"}, f"Written: {path}")
