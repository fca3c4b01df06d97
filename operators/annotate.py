"""Annotate by Keys: words at the playhead by number keys while the match plays; a shell over the core's
`annotating`."""

from __future__ import annotations

from dataclasses import replace

import bpy
from bpy.props import StringProperty

from ..beyond_mocap.annotation import annotating
from ..beyond_mocap.annotation.annotating import Leave
from ..beyond_mocap.errors import BeyondMocapError, InputError
from ..scene import areas, popup
from ..scene.annotating import do, held, name_of, now, type_keys
from ..scene.core import window
from .verb import Verb

SPACES = {
    "VIEW_3D": bpy.types.SpaceView3D, "NLA_EDITOR": bpy.types.SpaceNLA, "CLIP_EDITOR": bpy.types.SpaceClipEditor,
    "DOPESHEET_EDITOR": bpy.types.SpaceDopeSheetEditor, "SEQUENCE_EDITOR": bpy.types.SpaceSequenceEditor,
}
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
LOWEST = 10.0  # letters; a lower editor has no room for the menu, and it is drawn in the largest one
REPEATING = {"EARLIER", "LATER", "PREVIOUS", "NEXT"}
STATUS = (
    "1-9: words   I, O: in, out   M: mirror   Left, Right: key moments   Up, Down: players   , . : a frame   "
    "X: remove   H: hide the list   Space: play   Esc: leave"
)

_menu: dict = {}  # what is drawn: the box, in which region and for which (by pointer), the word under the mouse
_running: list[bool] = []  # not empty while the user annotates


class BEYOND_MOCAP_OT_annotate(Verb, bpy.types.Operator):
    """Say what the player does by number keys, at the playhead while the match plays: a menu of words opens at the
pointer, greyed where the library has no such clip. The same key or Esc leaves"""

    bl_idname = "beyond_mocap.annotate"
    bl_label = "Annotate by Keys"
    keys: StringProperty(
        name="Keys", options={"SKIP_SAVE"},
        description="Keys to press at the playhead, with blanks between: '2 2 3 5 ENTER'; for scripts",
    )

    @classmethod
    def poll(cls, context):
        """There is somebody to say it of."""
        cls.poll_message_set("Import tracking in step 2 first, and choose a player of the list; or open a clip's words")
        return bool(name_of(context))

    def do(self, context):
        """Press the keys that a script gives."""
        keys = self.keys.upper().split()
        known = {*annotating.KEYS, *"0123456789"}
        strange = next((key for key in keys if key not in known), None)
        if strange or not keys:
            found = f"the key {strange}" if strange else "no keys"
            raise InputError("annotate", found, f"keys of {', '.join(sorted(known))}", "for example '2 2 3 5 ENTER'")
        told = type_keys(context, keys)
        self.report({"INFO"}, "; ".join(told) or "nothing to do")

    def invoke(self, context, event):
        """Begin, or end where it runs already."""
        if bpy.app.background or self.keys:
            return self.execute(context)
        if _running:
            unwatch()  # the running one sees this and ends
            return {"CANCELLED"}
        try:
            self.state, self.told = annotating.State(held(context.scene)), ""
            self.who = name_of(context)
            now(context)
        except BeyondMocapError as error:
            return self.failed(str(error))
        self.pointer, self.folded = None, False
        _watch()
        context.window_manager.modal_handler_add(self)
        context.workspace.status_text_set(STATUS)
        self.show(context, event)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Take our keys where an editor of time or space is under the pointer; pass on the rest."""
        if not _running:
            return self.left(context)
        area, region = _under(context, event)
        if area is None:
            return {"PASS_THROUGH"}
        if event.type in ("MOUSEMOVE", "LEFTMOUSE"):
            return self.moused(context, event, area, region)
        key = _key(event)
        if event.type == "H" and event.value == "PRESS" and not _held_down(event):
            self.folded = not self.folded
            self.show(context, event)
            return {"RUNNING_MODAL"}
        if key is None:
            return {"PASS_THROUGH"}
        if event.value == "PRESS" and (not event.is_repeat or key in REPEATING):
            self.press(context, event, lambda state, where: annotating.press(state, key, where))
        return self.left(context) if self.state is None else {"RUNNING_MODAL"}

    def press(self, context, event, how):
        """One key or click: the next state, and what it asks for."""
        try:
            self.who = name_of(context)
            before = replace(self.state, held=held(context.scene))
            self.state, commands = how(before, now(context))
            self.told = "" if commands else self.told
            if self.state.trail and not before.trail:
                self.pointer = (event.mouse_x, event.mouse_y)
            for command in commands:
                self.carry_out(context, command)
        except BeyondMocapError as error:
            self.told = str(error)
            self.report({"WARNING"}, self.told)
        self.show(context, event)

    def carry_out(self, context, command):
        """Do one thing; a step for undo where it changes words."""
        if isinstance(command, Leave):
            self.state = None
            return
        done = do(context, command)
        self.told, self.who = done.line, name_of(context)
        if done.words:
            bpy.ops.ed.undo_push(message=f"Annotate: {self.told}"[:60])

    def moused(self, context, event, area, region):
        """The mouse over the menu lights a row, a click chooses it; elsewhere it is Blender's."""
        word = None
        if _menu.get("region") == region.as_pointer():
            word = _menu["box"].word_at(event.mouse_x - region.x, event.mouse_y - region.y)
        if event.type == "LEFTMOUSE" and word is not None:
            if word and event.value == "PRESS":
                self.press(context, event, lambda state, where: annotating.pick(state, word, where))
            return {"RUNNING_MODAL"}
        if _menu.get("under") != region.as_pointer() and not self.state.trail:
            self.show(context, event)
        elif _menu.get("hovered") != word:
            _menu["hovered"] = word
            area.tag_redraw()
        return {"PASS_THROUGH"}

    def show(self, context, event):
        """Lay the menu out: at the pointer while words are chosen, else in the editor's corner."""
        area, region = _under(context, event)
        if area is None or self.state is None:
            return
        under = region
        if region.height < LOWEST * popup.letters():
            area, region = _largest(context)
        at = (self.pointer[0] - region.x, self.pointer[1] - region.y) if self.state.trail and self.pointer else None
        content = popup.content(self.state, self.who, self.told, self.folded)
        box = popup.laid_out(content, at, areas.free_part(area, region), popup.letters(), popup.width_of)
        _menu.update(box=box, region=region.as_pointer(), under=under.as_pointer(), hovered=None)
        window.redraw(*SPACES)

    def left(self, context):
        """End: nothing is drawn any more, and there is no step for undo beside those that were made."""
        self.cancel(context)
        return {"CANCELLED"}

    def cancel(self, context):
        """Blender takes the operator away (a file is loaded, the window closes), or it has ended."""
        unwatch()
        window.clear_status()
        window.redraw(*SPACES)


def unwatch() -> None:
    """Take the drawing of the menu away."""
    window.undraw(_draw)
    _running.clear()
    _menu.clear()


def _watch() -> None:
    """Let the menu be drawn in every editor in which one annotates."""
    unwatch()
    _running.append(True)
    for space in SPACES.values():
        window.draw(space, _draw)


def _draw() -> None:
    if _menu.get("region") == bpy.context.region.as_pointer():
        popup.draw(_menu["box"], _menu.get("hovered") or "")


def _key(event: bpy.types.Event) -> str | None:
    """What a Blender event means; None for what is not ours, also with Ctrl, Alt or the system's key."""
    if event.type == "TAB" and event.shift:
        return "PREVIOUS_PLAYER"
    return None if _held_down(event) else KEYS.get(event.type)


def _held_down(event: bpy.types.Event) -> bool:
    return event.ctrl or event.alt or event.oskey or event.shift


def _under(context, event) -> tuple[bpy.types.Area | None, bpy.types.Region | None]:
    """The editor and its main region under the pointer, if one annotates in it."""
    area = next((area for area in context.window.screen.areas if area.type in SPACES and _holds(area, event)), None)
    shown = [region for region in area.regions if min(region.width, region.height) > 1] if area else []
    held_by = [region for region in shown if _holds(region, event)]
    if not held_by or any(region.type != "WINDOW" for region in held_by):
        return None, None
    return area, held_by[0]


def _largest(context) -> tuple[bpy.types.Area, bpy.types.Region]:
    """The largest editor in which one annotates, with its main region."""
    area = max((a for a in context.window.screen.areas if a.type in SPACES), key=lambda a: a.width * a.height)
    return area, next(region for region in area.regions if region.type == "WINDOW")


def _holds(place, event) -> bool:
    return 0 <= event.mouse_x - place.x < place.width and 0 <= event.mouse_y - place.y < place.height
