"""Load Sample: the extension's own sample for each task, from its files to a moving character, by one button."""

import math
from collections.abc import Callable
from typing import NamedTuple

import bmesh
import bpy
from bpy.props import EnumProperty
from mathutils import Euler

from ..scene.core import material, notices, sample, window
from ..scene.core.measure import units_per_metre
from ..scene.library import recordings
from ..scene.result import queue
from ..scene.stage import view_style
from .operator_base import BaseOperator

FPS = 30  # frames per second of the sample's scene, those of its clips
MATCH_SECONDS = (0.0, 8.0)  # s of the match that are shown
WINDING = ((0.0, 0.0), (3.0, 0.0), (5.3, 1.6), (4.0, 3.9), (0.7, 3.0), (-1.6, 4.6), (-3.7, 3.4))  # m, of a path
TARGET, TARGET_RADIUS = (9.0, 2.0, 1.2), 0.2  # m, of the throw's target
TARGET_COLOUR = (0.9, 0.35, 0.02)  # linear RGB
TILT = math.radians(70.0)  # of the free view, from straight down
NLA_SHARE = 0.3  # of the 3D view's height, for the NLA editor


class Sample(NamedTuple):
    """The sample of one task.

    Attributes:
        title: the task.
        text: what it is, as a tooltip.
        steps: functions of the context and of how operators are called; each begins when the work of the one before has
            ended.
        find: finds in a scene what has been generated, to be shown (called with the scene); nothing if a step failed.
        next_step: what to try then.
        task: the task of the tab that it belongs to.
        shows_empties: Blender's Empties are shown, since they are to be moved.
        heading: rad, direction of the free view; None looks through the scene's camera.
        seconds: length of the scene; what is longer extends it.
    """

    title: str
    text: str
    steps: tuple[Callable[[bpy.types.Context, str], None], ...]
    find: Callable[[bpy.types.Scene], list[bpy.types.Object]]
    next_step: str
    task: str
    heading: float | None = None
    shows_empties: bool = False
    seconds: float = 1.0


def import_player(_context, _how) -> None:
    """Import a player's track with its labels."""
    bpy.ops.beyond_mocap.import_tracking(filepath=str(sample.find_sample_path("match", "player1.csv")))


def synthesize_player(_context, how) -> None:
    """Build the library and generate the player's motion."""
    bpy.ops.beyond_mocap.synthesize(how)


def read_match(_context, how) -> None:
    """Read the tracking of a match."""
    bpy.ops.beyond_mocap.read_match(how, filepath=str(sample.find_sample_path("match", "small", "small.dat")))


def make_match(context, how) -> None:
    """Generate the match's first seconds."""
    match = context.scene.beyond_mocap_match
    match.start, match.end = MATCH_SECONDS
    bpy.ops.beyond_mocap.make_match(how)


def bend_path(context, _how) -> None:
    """Show a recorded run, and let it follow a winding path."""
    show_clip(context, "jogging_2_9.bvh")
    bpy.ops.beyond_mocap.edit_path(count=len(WINDING))
    points, units = context.view_layer.objects.active.data.splines[0].bezier_points, units_per_metre(context.scene)
    for point, place in zip(points, WINDING):
        point.handle_left_type = point.handle_right_type = "AUTO"
        point.co.xy = [units * metres for metres in place]
    bpy.ops.beyond_mocap.update_path()


def fill_passes(context, _how) -> None:
    """Fill the lists of three players who pass a ball."""
    context.scene.beyond_mocap_passes.library_folder = str(sample.find_sample_path("passes", "library"))
    bpy.ops.beyond_mocap.passes_sample(sample="three")


def make_passes(_context, how) -> None:
    """Generate the passing scene."""
    bpy.ops.beyond_mocap.passes_make(how)


def place_thrower(context, _how) -> None:
    """Show a standing player and add a target."""
    body = show_clip(context, "standing_2.bvh")
    target = create_target(context)
    body.beyond_mocap_throw.target = target


def create_target(context) -> bpy.types.Object:
    """Create the sphere that the ball is to hit."""
    mesh, shape, units = bpy.data.meshes.new("Target"), bmesh.new(), units_per_metre(context.scene)
    bmesh.ops.create_icosphere(shape, subdivisions=3, radius=TARGET_RADIUS * units)
    shape.to_mesh(mesh)
    shape.free()
    mesh.materials.append(material.get_material("Target", TARGET_COLOUR, 0.5))
    target = bpy.data.objects.new("Target", mesh)
    target.location = [units * metres for metres in TARGET]
    context.collection.objects.link(target)
    return target


def throw_at_target(_context, how) -> None:
    """Generate the throw."""
    bpy.ops.beyond_mocap.throw_at_target(how)


def import_markers(_context, _how) -> None:
    """Import a recording of optical markers."""
    bpy.ops.beyond_mocap.import_markers(filepath=str(sample.find_sample_path("markers", "walk.trc")))


def reconstruct_body(_context, how) -> None:
    """Reconstruct the body from the markers."""
    bpy.ops.beyond_mocap.reconstruct_markers(how)


def show_clip(context, path: str) -> bpy.types.Object:
    """Show a clip of the sample's library on an armature with a body; return the armature."""
    motion, _ = recordings.read_recording(context.scene.beyond_mocap, path)
    return recordings.show_recording(context, motion, path, dressed=True)


def find_bodies(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Find the armatures that move."""
    return [thing for thing in scene.objects if thing.type == "ARMATURE" and thing.animation_data is not None
            and thing.animation_data.action is not None]


def find_path(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Find the armatures that follow a path, with their curves."""
    bodies = [thing for thing in find_bodies(scene) if thing.beyond_mocap_ride.on]
    return [*bodies, *(body.beyond_mocap_ride.curve for body in bodies)]


def find_throw(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Find the armatures that throw, with their targets."""
    bodies = [thing for thing in find_bodies(scene) if thing.beyond_mocap_throw.made]
    return [*bodies, *(body.beyond_mocap_throw.target for body in bodies)]


SAMPLES = {
    "PLAYER": Sample("Player", "The track and labels of a player who dribbles, passes and runs on",
                     (import_player, synthesize_player), find_bodies, "move a strip in the NLA editor and press Update",
                     task="PLAYER"),
    "MATCH": Sample("Match", "Eight seconds of a match with nine players and a ball", (read_match, make_match),
                    find_bodies, "choose another time and press Make Match", task="MATCH"),
    "PATH": Sample("Path", "A recorded run that follows a winding path", (bend_path,), find_path,
                   "press Tab and move a point of the curve; the run follows", task="PATH", heading=math.radians(20.0),
                   seconds=6.0),
    "PASSES": Sample("Passes", "Three players who pass a ball", (fill_passes, make_passes), find_bodies,
                     "move a player's Empty; the passes follow", task="BALL", heading=math.radians(28.0),
                     shows_empties=True),
    "THROW": Sample("Throw", "A player who throws a ball at a target", (place_thrower, throw_at_target), find_throw,
                    "move the target; the throw follows", task="BALL", heading=math.radians(-50.0), seconds=4.0),
    "MARKERS": Sample("Markers", "A walk recorded with optical markers", (import_markers, reconstruct_body),
                      find_bodies, "see the figures under Reconstruct", task="MARKERS", heading=math.radians(28.0)),
}


class BEYOND_MOCAP_OT_load_sample(BaseOperator, bpy.types.Operator):
    """Load the sample of a task and generate its motion; a scene with content stays as it is, since the sample gets a
scene of its own"""

    bl_idname = "beyond_mocap.load_sample"
    bl_label = "Load Sample"
    which: EnumProperty(name="Sample", items=[(key, one.title, one.text) for key, one in SAMPLES.items()],
                        description="Task whose sample to load")
    needs = ("Leave edit mode first (Tab)", lambda context: context.mode == "OBJECT",
             "Wait for the work that is running", lambda context: not context.window_manager.beyond_mocap_work.kind)

    @classmethod
    def description(cls, _context, properties):
        return f"{SAMPLES[properties.which].text}; a scene with content stays as it is"

    def do(self, context):
        """Take all steps at once."""
        wanted = SAMPLES[self.which]
        prepare_scene(context, wanted)
        for step in wanted.steps:
            step(bpy.context, "EXEC_DEFAULT")
        self.show(bpy.context)

    def attempt(self, action):
        """Turn the error of a step's operator, which has left a notice, into a failure."""
        try:
            return super().attempt(action)
        except RuntimeError as error:
            self.report({"ERROR"}, notices.read_failure(error))
            return {"CANCELLED"}

    def invoke(self, context, _event):
        """Take the first step, and the others as the work in the background goes on."""
        if bpy.app.background:
            return self.execute(context)
        wanted = SAMPLES[self.which]
        self.steps, self.has_waited = list(wanted.steps), False
        if self.attempt(lambda: prepare_scene(context, wanted)) != {"FINISHED"}:
            return {"CANCELLED"}
        show_first(bpy.context, wanted)
        self.scene = bpy.context.scene.session_uid
        self.clock = window.start_timer(context)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Take the next step when the work of the last one has ended; then show the result."""
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if context.window_manager.beyond_mocap_work.kind or queue.is_busy():
            self.has_waited = True
            return {"RUNNING_MODAL"}
        if context.scene.session_uid == self.scene and self.steps:
            step = self.steps.pop(0)
            if self.attempt(lambda: step(context, "INVOKE_DEFAULT")) == {"FINISHED"}:
                return {"RUNNING_MODAL"}
        self.cancel(context)
        if context.scene.session_uid != self.scene or self.steps or not SAMPLES[self.which].find(context.scene):
            return {"CANCELLED"}
        self.show(context)
        # the work in the background has made its own step of undo, which contains everything
        return {"CANCELLED"} if self.has_waited else {"FINISHED"}

    def cancel(self, context):
        """Stop waiting."""
        window.stop_timer(context, self.clock)

    def show(self, context):
        """Show the result in the 3D view, play it, and say what to try."""
        wanted = SAMPLES[self.which]
        show_last(context, wanted)
        self.report({"INFO"}, f"{wanted.title} sample: {wanted.next_step}")


def prepare_scene(context, wanted: Sample) -> None:
    """Prepare a scene without content for a sample: library, frame rate, pitch and light."""
    library = sample.find_sample_path("library")
    if not is_free(context.scene):
        context.window.scene = bpy.data.scenes.new(f"Sample {wanted.title}")
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = FPS, 1.0
    scene.frame_start, scene.frame_end = 1, round(FPS * wanted.seconds)
    scene.beyond_mocap.library_folder, scene.beyond_mocap.task = str(library), wanted.task
    if wanted.task != "MATCH":  # which adds a pitch of its own size
        scene.beyond_mocap_stage.stands = False  # which would hide the sky near a player
        bpy.ops.beyond_mocap.add_stage()


def is_free(scene: bpy.types.Scene) -> bool:
    """Return whether a scene has no content: no objects, video, markers, players, or library but the sample's."""
    folder, editor = scene.beyond_mocap.library_folder, scene.sequence_editor
    has_video = editor is not None and len(editor.strips_all) > 0
    return (not scene.objects and not has_video and not len(scene.timeline_markers)
            and not scene.beyond_mocap.players and (not folder or sample.is_in_sample(folder)))


def show_first(context, wanted: Sample) -> None:
    """Prepare the window while the motion is generated."""
    if wanted.task == "PLAYER":
        window.open_editor(context, "NLA_EDITOR", "HORIZONTAL", NLA_SHARE)


def show_last(context, wanted: Sample) -> None:
    """Look at what was generated, and play it."""
    if (area := window.find_view(context)) is None:
        return
    scene = context.scene
    view_style.style_view(area.spaces.active, wanted.shows_empties)
    if wanted.task == "PLAYER":
        show_strips(context)
    if wanted.heading is None:
        window.look_through_camera(context)
    else:
        view = area.spaces.active.region_3d
        view.view_perspective, view.view_rotation = "PERSP", Euler((TILT, 0.0, wanted.heading)).to_quaternion()
        scene.frame_set((scene.frame_start + scene.frame_end) // 2)  # what moves is then in the middle of the view
        window.frame_objects(context, wanted.find(scene))
        scene.frame_set(scene.frame_start)
    if not context.screen.is_animation_playing:
        with context.temp_override(area=area):
            bpy.ops.screen.animation_play()


def show_strips(context) -> None:
    """Show the player's labels alone in the NLA editor, from the first to the last."""
    area = window.find_largest_editor(context.window.screen, "NLA_EDITOR")
    if area is None:
        return
    region = next(region for region in area.regions if region.type == "WINDOW")
    with context.temp_override(area=area, region=region):
        bpy.ops.beyond_mocap.choose_player()
        bpy.ops.nla.view_all()
