"""Annotate by keys while the match plays (the window's side of the core's `key_commands`), and the reference video."""

from dataclasses import replace

import bpy
from bpy.props import BoolProperty, FloatProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

from ...beyond_mocap.base.errors import BeyondMocapError, InputError
from ...scene.core import popup, window
from ...scene.timeline import key_annotation, video
from ...scene.timeline.video import add_driver
from ..operator_base import BaseOperator

SPACES = {"VIEW_3D": bpy.types.SpaceView3D, "NLA_EDITOR": bpy.types.SpaceNLA, "CLIP_EDITOR": bpy.types.SpaceClipEditor,
          "DOPESHEET_EDITOR": bpy.types.SpaceDopeSheetEditor, "SEQUENCE_EDITOR": bpy.types.SpaceSequenceEditor}
DIGITS = ("ZERO", "ONE", "TWO", "THREE", "FOUR", "FIVE", "SIX", "SEVEN", "EIGHT", "NINE")
KEYS = {
    **{name: str(digit) for digit, name in enumerate(DIGITS)},
    **{f"NUMPAD_{digit}": str(digit) for digit in range(10)},
    "EQUAL": "NEXT_PAGE", "NUMPAD_PLUS": "NEXT_PAGE", "PAGE_DOWN": "NEXT_PAGE",
    "MINUS": "PREVIOUS_PAGE", "NUMPAD_MINUS": "PREVIOUS_PAGE", "PAGE_UP": "PREVIOUS_PAGE",
    "RET": "ENTER", "NUMPAD_ENTER": "ENTER", "BACK_SPACE": "BACK", "ESC": "ESC", "I": "IN", "O": "OUT", "M": "MIRROR",
    "X": "REMOVE", "DEL": "REMOVE", "COMMA": "EARLIER", "PERIOD": "LATER", "LEFT_ARROW": "PREVIOUS",
    "RIGHT_ARROW": "NEXT", "UP_ARROW": "PREVIOUS_PLAYER", "DOWN_ARROW": "NEXT_PLAYER", "TAB": "NEXT_PLAYER",
}
MIN_HEIGHT = 10.0  # height in letters; the menu of a smaller editor is drawn in the largest one
REPEATING = {"EARLIER", "LATER", "PREVIOUS", "NEXT"}
STATUS = ("1-9: labels   I, O: in, out   M: mirror   Left, Right: key moments   Up, Down: players   , . : one frame   "
          "X: remove   H: hide the list   Space: play   Esc: stop")

_menu: dict = {}  # the drawn menu: its box, its two regions (as pointers), the label under the mouse
_running: list[bool] = []  # not empty while the operator runs


class BEYOND_MOCAP_OT_annotate(BaseOperator, bpy.types.Operator):
    """Annotate the player's actions with number keys while the match plays; press the same key or Esc to stop"""

    bl_idname = "beyond_mocap.annotate"
    bl_label = "Annotate by Keys"
    keys: StringProperty(name="Keys", options={"SKIP_SAVE"},
                         description="Keys to press at the playhead, separated by spaces, for scripts: '2 2 3 5 ENTER'")
    needs = ("Import tracking data and choose a player in the list first, or open a clip's labels",
             lambda context: bool(key_annotation.describe_subject(context)))

    def do(self, context):
        """Press the keys of a script."""
        from ...beyond_mocap.annotation import key_commands as annotating

        keys = self.keys.upper().split()
        names = sorted(key for key in annotating.KEYS if not key[0].isdigit())
        known = {*names, *"0123456789"}
        unknown = next((key for key in keys if key not in known), None)
        if unknown or not keys:
            found = f"the key {unknown}" if unknown else "no keys"
            raise InputError("annotate", found, f"keys of {', '.join(['0 to 9', *names])}",
                             "for example '2 2 3 5 ENTER'")
        lines = key_annotation.type_keys(context, keys)
        self.report({"INFO"}, "; ".join(lines) or "Nothing to do")

    def invoke(self, context, event):
        """Start, or stop if it runs already."""
        from ...beyond_mocap.annotation import key_commands as annotating

        if bpy.app.background or self.keys:
            return self.execute(context)
        if _running:
            stop_drawing()  # the running operator detects this and ends
            return {"CANCELLED"}
        try:
            self.state, self.message = annotating.AnnotationState(key_annotation.find_combinations(context.scene)), ""
            self.player_name = key_annotation.describe_subject(context)
            key_annotation.compute_now(context)
        except BeyondMocapError as error:
            return self.report_failure(error)
        self.pointer, self.is_folded = None, False
        _start_drawing()
        context.window_manager.modal_handler_add(self)
        window.show_status(STATUS)
        self.update_menu(context, event)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Handle the table's keys if an editor of `SPACES` is under the pointer; pass on all other events."""
        from ...beyond_mocap.annotation import key_commands as annotating

        if not _running:
            return self.stop(context)
        area, region = _find_editor(context, event)
        if area is None:
            return {"PASS_THROUGH"}
        if event.type in ("MOUSEMOVE", "LEFTMOUSE"):
            return self.handle_mouse(context, event, area, region)
        key = _find_key(event)
        if event.type == "H" and event.value == "PRESS" and not _has_modifier(event):
            self.is_folded = not self.is_folded
            self.update_menu(context, event)
            return {"RUNNING_MODAL"}
        if key is None:
            return {"PASS_THROUGH"}
        if event.value == "PRESS" and (not event.is_repeat or key in REPEATING):
            self.press_key(context, event, lambda state, where: annotating.handle_key(state, key, where))
        return self.stop(context) if self.state is None else {"RUNNING_MODAL"}

    def press_key(self, context, event, handle):
        """Handle one key or click: compute the next state and run its commands.

        Args:
            handle: from the state and the playhead to the next state and its commands.
        """
        try:
            self.player_name = key_annotation.describe_subject(context)
            before = replace(self.state, available=key_annotation.find_combinations(context.scene))
            self.state, commands = handle(before, key_annotation.compute_now(context))
            self.message = "" if commands else self.message
            if self.state.trail and not before.trail:
                self.pointer = (event.mouse_x, event.mouse_y)
            for command in commands:
                self.run_command(context, command)
        except BeyondMocapError as error:
            self.message = str(error)
            self.report({"WARNING"}, self.message)
        self.update_menu(context, event)

    def run_command(self, context, command):
        """Run one command; add an undo step if it changes labels."""
        from ...beyond_mocap.annotation import key_commands as annotating

        if isinstance(command, annotating.StopAnnotating):
            self.state = None
            return
        result = key_annotation.run_command(context, command)
        self.message, self.player_name = result.line, key_annotation.describe_subject(context)
        if result.changed_labels:
            bpy.ops.ed.undo_push(message=f"Annotate: {self.message}"[:60])

    def handle_mouse(self, context, event, area, region):
        """Highlight the row under the mouse; a click chooses it. Events outside the menu are passed on."""
        from ...beyond_mocap.annotation import key_commands as annotating

        word = None
        if _menu.get("region") == region.as_pointer():
            word = _menu["box"].word_at(event.mouse_x - region.x, event.mouse_y - region.y)
        if event.type == "LEFTMOUSE" and word is not None:
            if word and event.value == "PRESS":
                self.press_key(context, event, lambda state, where: annotating.select_label(state, word, where))
            return {"RUNNING_MODAL"}
        if _menu.get("under") != region.as_pointer() and not self.state.trail:
            self.update_menu(context, event)
        elif _menu.get("hovered") != word:
            _menu["hovered"] = word
            area.tag_redraw()
        return {"PASS_THROUGH"}

    def update_menu(self, context, event):
        """Update the menu: at the pointer while labels are chosen, else in the editor's corner."""
        area, region = _find_editor(context, event)
        if area is None or self.state is None:
            return
        under = region
        if region.height < MIN_HEIGHT * popup.measure_font_size():
            area, region = _find_largest_editor(context)
        at = (self.pointer[0] - region.x, self.pointer[1] - region.y) if self.state.trail and self.pointer else None
        content = popup.build_content(self.state, self.player_name, self.message, self.is_folded)
        box = popup.place_menu(content, at, window.find_free_region(area, region), popup.measure_font_size(),
                               popup.measure_text)
        _menu.update(box=box, region=region.as_pointer(), under=under.as_pointer(), hovered=None)
        window.redraw_editors(*SPACES)

    def stop(self, context):
        """Stop: remove the menu; the operator itself adds no undo step."""
        self.cancel(context)
        return {"CANCELLED"}

    def cancel(self, context):
        """Clean up, also when Blender ends the operator (a file is loaded, the window closes)."""
        stop_drawing()
        window.clear_status()
        window.redraw_editors(*SPACES)


def stop_drawing() -> None:
    """Stop drawing the menu."""
    window.remove_overlay(_draw)
    _running.clear()
    _menu.clear()


def unregister() -> None:
    """Remove the menu with the extension."""
    stop_drawing()


def _start_drawing() -> None:
    """Start drawing the menu in every editor of `SPACES`."""
    stop_drawing()
    _running.append(True)
    for space in SPACES.values():
        window.add_overlay(space, _draw)


def _draw() -> None:
    if _menu.get("region") == bpy.context.region.as_pointer():
        popup.draw_menu(_menu["box"], _menu.get("hovered") or "")


def _find_key(event: bpy.types.Event) -> str | None:
    """Find the key of an event; None for other keys, also with Ctrl, Alt or the system's key."""
    if event.type == "TAB" and event.shift:
        return "PREVIOUS_PLAYER"
    return None if _has_modifier(event) else KEYS.get(event.type)


def _has_modifier(event: bpy.types.Event) -> bool:
    return event.ctrl or event.alt or event.oskey or event.shift


def _find_editor(context, event) -> tuple[bpy.types.Area | None, bpy.types.Region | None]:
    """Find the editor of `SPACES` and its main region under the pointer."""
    area = next((area for area in context.window.screen.areas if area.type in SPACES
                 and _contains_pointer(area, event)), None)
    visible = [region for region in area.regions if min(region.width, region.height) > 1] if area else []
    under_pointer = [region for region in visible if _contains_pointer(region, event)]
    if not under_pointer or any(region.type != "WINDOW" for region in under_pointer):
        return None, None
    return area, under_pointer[0]


def _find_largest_editor(context) -> tuple[bpy.types.Area, bpy.types.Region]:
    """Find the largest editor of `SPACES` and its main region."""
    area = max((a for a in context.window.screen.areas if a.type in SPACES), key=lambda a: a.width * a.height)
    return area, next(region for region in area.regions if region.type == "WINDOW")


def _contains_pointer(place, event) -> bool:
    return 0 <= event.mouse_x - place.x < place.width and 0 <= event.mouse_y - place.y < place.height


class VideoOperator(BaseOperator):
    """An operator for the reference video."""

    needs = "Load a reference video first", lambda context: context.scene.beyond_mocap.video.clip is not None


class BEYOND_MOCAP_OT_show_video(VideoOperator, bpy.types.Operator):
    """Show the reference video in a movie clip editor beside the 3D view"""

    bl_idname = "beyond_mocap.show_video"
    bl_label = "Show Beside 3D View"

    def do(self, context):
        """Restore the video's driver if it is lost, and show the video."""
        add_driver(context.scene)
        show_clip_editor(context, context.scene.beyond_mocap.video.clip)


def show_clip_editor(context: bpy.types.Context, clip: bpy.types.MovieClip) -> None:
    """Show a clip in an open clip editor, else in the left half of the largest 3D view, else not at all."""
    area = window.open_editor(context, "CLIP_EDITOR", "VERTICAL", 0.45)
    if area is None:
        return
    space = area.spaces.active
    space.mode, space.view = "TRACKING", "CLIP"
    space.clip = clip
    for part in ("show_region_toolbar", "show_region_ui", "show_region_hud"):
        if hasattr(space, part):
            setattr(space, part, False)
    space.lock_selection = False
    area.tag_redraw()


FILES = "*.mp4;*.mov;*.avi;*.mkv;*.webm;*.m4v;*.mpg;*.mpeg;*.mts;*.png;*.jpg;*.jpeg;*.tif;*.tiff;*.bmp;*.exr"


class BEYOND_MOCAP_OT_load_video(BaseOperator, ImportHelper, bpy.types.Operator):
    """Load a movie or an image sequence to watch beside the match while you annotate; it plays at its own speed"""

    bl_idname = "beyond_mocap.load_video"
    bl_label = "Load Reference Video"
    filter_glob: StringProperty(default=FILES, options={"HIDDEN"})
    rate: FloatProperty(
        name="Frames per Second", default=0.0, min=0.0, max=1000.0, precision=3,
        description="Frame rate of the video; 0 uses the movie file's, or for an image sequence the scene's",
    )
    show: BoolProperty(name="Show", default=True, description="Show the video in an editor beside the 3D view")

    def invoke(self, context, event):
        return ImportHelper.invoke(self, context, event)

    def do(self, context):
        """Load and drive the video, then open an editor for it."""
        if not self.filepath:
            raise InputError("video", "no file given", "a movie, or the first picture of a sequence", "choose a file")
        clip, scene = video.load_clip(bpy.path.abspath(self.filepath)), context.scene
        video.show_clip(scene, clip, self.rate or None)
        if self.show:
            show_clip_editor(context, clip)
        rate = scene.beyond_mocap.video.rate
        self.report({"INFO"}, f"{clip.name}: {clip.frame_duration} frames at {rate:.6g} per second")


class BEYOND_MOCAP_OT_move_video(VideoOperator, bpy.types.Operator):
    """Move the reference video by a number of its frames relative to the track"""

    bl_idname = "beyond_mocap.move_video"
    bl_label = "Move Reference Video"
    frames: IntProperty(name="Frames", default=1, description="Frames of the video by which it starts later")

    def do(self, context):
        video = context.scene.beyond_mocap.video
        video.begins += self.frames / video.rate


class BEYOND_MOCAP_OT_remove_video(BaseOperator, bpy.types.Operator):
    """Remove the reference video from the scene; the movie clip stays in the file"""

    bl_idname = "beyond_mocap.remove_video"
    bl_label = "Remove Reference Video"
    needs = "No reference video is loaded", lambda context: context.scene.beyond_mocap.video.clip is not None

    def do(self, context):
        video.remove_video(context.scene)
