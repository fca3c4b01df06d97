"""Passing scenes: their lists, their files, and their generation."""

import math

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from ..beyond_mocap.base.errors import InputError, format_count
from ..beyond_mocap.files import atomic
from ..beyond_mocap.passes import scene_json
from ..scene.core.measure import units_per_metre
from ..scene.passes import characters as shown
from ..scene.passes import generate as make
from ..scene.passes import hit_analysis as hits_shown
from ..scene.passes import scene_lists as order
from ..scene.passes.settings import SAMPLES
from .operator_base import BackgroundOperator, BaseOperator, ImportOperator, describe_error

ROWS = (("players", "Players", "Players of the scene"), ("passes", "Passes", "Passes in their order"))
WHAT = (("ADD", "Add", "Add a row at the end"), ("REMOVE", "Remove", "Remove the active row"),
        ("UP", "Up", "Move the active row up"), ("DOWN", "Down", "Move the active row down"))
ACTIVE = {"players": "active_player", "passes": "active_pass"}
RING = 3.0  # metres from the 3D cursor at which players are added


class BEYOND_MOCAP_OT_passes_list(BaseOperator, bpy.types.Operator):
    """Add, remove or move a player or a pass"""

    bl_idname = "beyond_mocap.passes_list"
    bl_label = "Players and Passes"
    rows: EnumProperty(name="List", items=ROWS, options={"SKIP_SAVE"}, description="List to change")
    what: EnumProperty(name="What", items=WHAT, options={"SKIP_SAVE"}, description="Change to make")

    @classmethod
    def description(cls, _context, properties):
        one = {"players": "player", "passes": "pass"}[properties.rows]
        if properties.what == "ADD" and one == "player":
            return (
                "Add a player near the 3D cursor, or with the selected armature as body if no other player uses it, "
                "at its place"
            )
        if properties.what == "ADD":
            return "Add a pass from the receiver of the last one"
        moved = {"UP": "earlier", "DOWN": "later"}.get(properties.what)
        return f"Move the active {one} {moved}" if moved else f"Remove the active {one}"

    def do(self, context):
        """Change the list."""
        settings = context.scene.beyond_mocap_passes
        if self.what == "ADD":
            return add_player_at_cursor(context) if self.rows == "players" else add_pass(settings)
        rows, number = getattr(settings, self.rows), getattr(settings, ACTIVE[self.rows])
        if not 0 <= number < len(rows):
            raise InputError(self.rows, "no active row", "a row of the list", "add one first")
        if self.what == "REMOVE":
            self.remove_row(settings, rows, number)
        else:
            self.move_row(settings, rows, number, number + (1 if self.what == "DOWN" else -1))

    def remove_row(self, settings, rows, number):
        """Remove a row; for a player also their passes, their Empty and what the scene has created for them."""
        if self.rows == "players":
            shown.check_characters(rows[number])
            shown.release_character(rows[number])
            name = rows[number].name
            for other in reversed(range(len(settings.passes))):
                if name in (settings.passes[other].who, settings.passes[other].to):
                    settings.passes.remove(other)
            order.remove_place(rows[number])
            settings.active_pass = max(0, min(settings.active_pass, len(settings.passes) - 1))
        else:
            order.remove_mark(rows[number].at)
        rows.remove(number)
        setattr(settings, ACTIVE[self.rows], max(0, min(number, len(rows) - 1)))

    def move_row(self, settings, rows, number, goal):
        """Exchange a row with its neighbour."""
        if not 0 <= goal < len(rows):
            raise InputError(self.rows, "it is at the end of the list", "a row that can move in that direction")
        rows.move(number, goal)
        setattr(settings, ACTIVE[self.rows], goal)


def add_player_at_cursor(context) -> None:
    """Add a player at the selected armature or near the 3D cursor."""
    settings, scene = context.scene.beyond_mocap_passes, context.scene
    count, units = len(settings.players), units_per_metre(scene)
    body = context.view_layer.objects.active
    is_free = body is not None and body.type == "ARMATURE" and body.library is None and body.select_get()
    if is_free and not any(row.body == body for row in settings.players):
        place, facing = measure_stance(scene, body)
        is_taken = any(row.name == body.name for row in settings.players)
        row = order.add_player(context, order.find_free_name(settings) if is_taken else body.name, place, facing)
        row.body = body
        return
    # the first three players on a triangle, more on a ring twice as wide
    angle = math.radians(90.0 + 120.0 * count) if count < 3 else math.radians(30.0 + 60.0 * (count - 3))
    ring = RING * (1.0 if count < 3 else 2.0)
    x, y = scene.cursor.location.x / units, scene.cursor.location.y / units
    order.add_player(context, order.find_free_name(settings), (x + ring * math.cos(angle), y + ring * math.sin(angle)),
                     angle + math.pi)


def measure_stance(scene, body) -> tuple[tuple[float, float], float]:
    """Measure where an armature stands on the current frame, and its heading in rad."""
    from ..beyond_mocap.motion.humanoid import compute_heading

    try:
        motion, first = hits_shown.read_motion(scene, body)
    except InputError:
        return order.measure_place(scene, body)
    row = min(max(scene.frame_current - first, 0), len(motion) - 1)
    return tuple(float(value) for value in motion.root_positions[row, :2]), float(compute_heading(motion)[row])


def add_pass(settings) -> None:
    """Add a pass from the receiver of the last one to the next player in the list."""
    names = [row.name for row in settings.players]
    if len(names) < 2:
        raise InputError("passes", format_count(len(names), "player"), "two or more", "add players first")
    last = settings.passes[-1] if len(settings.passes) else None
    row = settings.passes.add()
    row.who = last.to if last is not None and last.to in names else names[0]
    row.to = names[(names.index(row.who) + 1) % len(names)]
    if last is not None:
        row.kind, row.bounces = last.kind, last.bounces
    settings.active_pass = len(settings.passes) - 1


class BEYOND_MOCAP_OT_passes_make(BackgroundOperator, bpy.types.Operator):
    """Generate the passing scene: characters and ball are created where there are none, and each flight of the ball
leads from one player's strike to the next"""

    bl_idname = "beyond_mocap.passes_make"
    bl_label = "Make Scene"
    presents = True
    kind = "passes"
    live: BoolProperty(name="Live", options={"HIDDEN", "SKIP_SAVE"},
                       description="Start as an update after an edit, with errors shown in the panel")
    needs = ("Add players and passes, or choose a sample",
             lambda context: len((settings := context.scene.beyond_mocap_passes).players) > 1
             and len(settings.passes) > 0)

    def order(self, context):
        """Build the order for the scene."""
        if not self.live:
            order.clear_examples()
        return make.build_order(context.scene)

    @staticmethod
    def run_job(asked, progress, cancelled, hurry):
        """Generate the passing scene."""
        return make.run_order(asked, progress, cancelled, hurry)

    def apply(self, scene, result):
        """Apply the result to characters and ball."""
        rows = {row.name for row in scene.beyond_mocap_passes.players}
        if missing := [one.name for one in result.passes.players if one.name not in rows]:
            raise InputError("players", f"{missing[0]} is no longer in the list", "the same players",
                             "press Make Scene again")
        make.apply_result(scene, result)
        self.report({"INFO"}, ", ".join(scene.beyond_mocap_passes.figures.splitlines()[:3]))

    def modal(self, context, event):
        """Let an update that an edit started end silently when the next edit starts another one."""
        if self.live and self.job.is_stale:
            self.stop_polling(context)
            return {"CANCELLED"}
        return super().modal(context, event)

    def report_failure(self, error):
        """Show the error of an update in the panel; the scene that is shown stays."""
        if not self.live:
            return super().report_failure(error)
        bpy.context.scene.beyond_mocap_passes.messages = str(describe_error(error))
        return {"CANCELLED"}


class BEYOND_MOCAP_OT_passes_clear(BaseOperator, bpy.types.Operator):
    """Remove the characters, ball and net that Make Scene has created; your own characters play their own motion
again, and the lists stay"""

    bl_idname = "beyond_mocap.passes_clear"
    bl_label = "Revert Scene"
    needs = "There is no scene to clear", lambda context: bool(context.scene.beyond_mocap_passes.made_of)

    def do(self, context):
        make.clear_scene(context.scene)


class BEYOND_MOCAP_OT_passes_sample(BaseOperator, bpy.types.Operator):
    """Replace the lists with a sample scene; players with the same name keep their characters"""

    bl_idname = "beyond_mocap.passes_sample"
    bl_label = "Sample Scene"
    sample: EnumProperty(name="Sample", items=SAMPLES, description="Sample scene to use")

    def do(self, context):
        """Parse the sample and set the lists."""
        order.fill_lists(context, scene_json.parse_scene(scene_json.SAMPLES[self.sample], self.sample))
        self.report({"INFO"}, "Move the players' Empties, edit the passes, then press Make Scene")


class BEYOND_MOCAP_OT_passes_from_json(ImportOperator, bpy.types.Operator):
    """Replace the lists with a scene from a SCENE.json file"""

    bl_idname = "beyond_mocap.passes_from_json"
    bl_label = "Scene from File"
    filename_ext = ".json"
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def do(self, context):
        """Read the file and set the lists."""
        path = self.find_chosen_file("one SCENE.json")
        order.fill_lists(context, scene_json.read_scene(path))


class BEYOND_MOCAP_OT_passes_to_json(BaseOperator, bpy.types.Operator, ExportHelper):
    """Write the scene to a SCENE.json file, for the command line or another blend file"""

    bl_idname = "beyond_mocap.passes_to_json"
    bl_label = "Scene to File"
    bl_options = {"REGISTER"}
    filename_ext = ".json"
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def do(self, context):
        """Build the scene and write it."""
        text = scene_json.format_scene(order.build_scene(context.scene))
        atomic.atomic_write(bpy.path.abspath(self.filepath), text)
        missing = order.list_lost_examples(context.scene.beyond_mocap_passes)
        self.report({"WARNING" if missing else "INFO"},
                    ", ".join(filter(None, (f"Written to {self.filepath}", missing))))
