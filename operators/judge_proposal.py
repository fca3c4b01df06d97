"""Accept, refuse or step through what was proposed for a clip: by buttons and scripts, or by keys while it plays."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, IntProperty

from ..beyond_mocap.errors import BeyondMocapError, InputError
from ..scene import proposals
from ..scene.core.window import clear_status
from .annotate import SPACES
from .verb import Verb

WHAT = (
    ("ACCEPT", "Accept", "Put it among the clip's words, and go to the next one"),
    ("REFUSE", "Refuse", "Leave it out, and go to the next one"),
    ("NEXT", "Next", "Look at the next one"),
    ("PREVIOUS", "Previous", "Look at the one before"),
    ("ACCEPT_ALL", "Accept All", "Accept all that are still open"),
    ("REFUSE_ALL", "Refuse All", "Refuse all that are still open"),
)
KEYS = {
    "A": "ACCEPT", "RET": "ACCEPT", "NUMPAD_ENTER": "ACCEPT", "X": "REFUSE", "DEL": "REFUSE", "DOWN_ARROW": "NEXT",
    "RIGHT_ARROW": "NEXT", "UP_ARROW": "PREVIOUS", "LEFT_ARROW": "PREVIOUS",
}
STATUS = "A, Enter: accept   X: refuse   Up, Down: the one before, the next   Space: play   Esc: leave"


class ProposalVerb(Verb):
    """A verb about what was proposed for the active clip."""

    @classmethod
    def poll(cls, context):
        """Something is listed."""
        cls.poll_message_set("Open a clip with Annotate Clip first, and press Look Through")
        return context.object is not None and len(context.object.beyond_mocap_proposals.listed) > 0


class BEYOND_MOCAP_OT_judge_proposal(ProposalVerb, bpy.types.Operator):
    """Accept or refuse a proposal of the list, or step to another one"""

    bl_idname = "beyond_mocap.judge_proposal"
    bl_label = "Judge Proposal"

    what: EnumProperty(name="What", items=WHAT, default="ACCEPT", description="What becomes of it")
    index: IntProperty(
        name="Proposal", default=-1, min=-1, options={"SKIP_SAVE"},
        description="Its place in the list; -1: the chosen one",
    )

    @classmethod
    def description(cls, _context, properties):
        """What this button does."""
        return next(text for name, _, text in WHAT if name == properties.what)

    def do(self, context):
        """Do it, and say so."""
        self.report({"INFO"}, judged(context.object, self.what, self.index))


class BEYOND_MOCAP_OT_review_proposals(ProposalVerb, bpy.types.Operator):
    """Look through the proposals by keys while the clip plays: A or Enter accepts, X refuses, and the playhead goes to
the next one; Up and Down step, Esc leaves"""

    bl_idname = "beyond_mocap.review_proposals"
    bl_label = "Judge by Keys"

    def do(self, _context):
        """Keys need a window."""
        raise InputError("Judge by Keys", "no window", "a 3D view", "in scripts use Judge Proposal")

    def invoke(self, context, _event):
        """Take keys from now on; the first open proposal is shown."""
        if bpy.app.background or context.window is None:
            return self.execute(context)
        self.target = context.object.name
        _show_open(context.object)
        context.window_manager.modal_handler_add(self)
        self.tell(context, "")
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Our keys where an editor of time or space is under the pointer; all else is Blender's."""
        target = context.object
        listed = target is not None and target.name == self.target and len(target.beyond_mocap_proposals.listed) > 0
        if not listed:
            return self.left(context)
        held = event.ctrl or event.alt or event.oskey or event.shift
        if event.value != "PRESS" or held or not _over_editor(context, event):
            return {"PASS_THROUGH"}
        if event.type == "ESC":
            return self.left(context)
        if event.type not in KEYS:
            return {"PASS_THROUGH"}
        self.press(context, target, KEYS[event.type])
        return {"RUNNING_MODAL"} if proposals.left(target) else self.left(context)

    def press(self, context, target, what: str):
        """One key; a step for undo where words change."""
        try:
            told = judged(target, what)
        except BeyondMocapError as error:
            self.report({"WARNING"}, str(error))
            return
        self.tell(context, told)
        if what in ("ACCEPT", "REFUSE"):
            bpy.ops.ed.undo_push(message=told[:60])

    def tell(self, context, told: str):
        """What was done and what the keys do, in the status bar."""
        one = proposals.chosen(context.object)
        now = f"{one.name}, {one.confidence:.0%} sure" if one is not None else ""
        context.workspace.status_text_set("   |   ".join(part for part in (told, now, STATUS) if part))
        for area in context.window.screen.areas:
            area.tag_redraw()

    def left(self, context):
        """End."""
        self.cancel(context)
        return {"FINISHED"}

    def cancel(self, _context):
        """Blender takes the operator away, or it has ended."""
        clear_status()


def judged(target: bpy.types.Object, what: str, index: int = -1) -> str:
    """Carry out one of WHAT; returns a line for the user. InputError for a place that is not in the list."""
    group = target.beyond_mocap_proposals
    if what in ("NEXT", "PREVIOUS"):
        group.active = min(group.active, len(group.listed) - 1)
        proposals.go_on(target, 1 if what == "NEXT" else -1)
        return proposals.chosen(target).name
    how = proposals.accept if what.startswith("ACCEPT") else proposals.refuse
    if what.endswith("_ALL"):
        judged_now = [number for number, one in enumerate(group.listed) if one.state == "OPEN"]
        for number in judged_now:
            how(target, number)
        return f"{len(judged_now)} {'accepted' if what == 'ACCEPT_ALL' else 'refused'}"
    told = how(target, group.active if index < 0 else index)
    proposals.go_on(target, 1, only_open=True)
    count = proposals.left(target)
    return f"{told}; {count} left"


def _show_open(target: bpy.types.Object) -> None:
    """The chosen proposal, if nobody has judged it, else the next one that is open; the playhead goes there."""
    group = target.beyond_mocap_proposals
    one = proposals.chosen(target)
    if one is None or one.state != "OPEN":
        proposals.go_on(target, 1, only_open=True)
    group.active = group.active


def _over_editor(context, event) -> bool:
    """Whether the pointer is over an editor in which one annotates."""
    inside = (area for area in context.window.screen.areas
              if 0 <= event.mouse_x - area.x < area.width and 0 <= event.mouse_y - area.y < area.height)
    return any(area.type in SPACES for area in inside)
