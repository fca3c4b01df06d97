"""Operators of notices: apply a fix and run the failed operator again, only run it again, or dismiss the notice."""

from pathlib import Path

import bpy
from bpy.props import IntProperty

from ..beyond_mocap.base.errors import BeyondMocapError, InputError
from ..scene.core import notices
from ..scene.result import bake
from ..scene.timeline import strips
from .operator_base import BaseOperator


class NoticeOperator(BaseOperator):
    """Base of operators about one notice: that of the number, else the newest of the scene."""

    notice: IntProperty(name="Notice", options={"SKIP_SAVE"}, description="Number of the notice; 0 for the newest")
    needs = "Nothing has failed", lambda context: notices.find_notice(context.scene) is not None

    def attempt(self, action):
        """Run `action`; an operator that it calls and that fails has left a notice, so its line is enough here."""
        try:
            action()
        except (BeyondMocapError, RuntimeError) as error:
            self.report({"ERROR"}, notices.read_failure(error))
            return {"CANCELLED"}
        return {"FINISHED"}

    def find_notice(self, context):
        """Find the notice; InputError if it is gone."""
        found = notices.find_notice(context.scene, self.notice)
        if found is None:
            raise InputError("notice", "it was dismissed", "a notice that is still shown")
        return found


class BEYOND_MOCAP_OT_apply_fix(NoticeOperator, bpy.types.Operator):
    """Do what this button says, then run again what failed, where that is enough"""

    bl_idname = "beyond_mocap.apply_fix"
    bl_label = "Apply Fix"
    bl_options = {"UNDO", "INTERNAL"}
    index: IntProperty(name="Fix", min=0, options={"SKIP_SAVE"}, description="Number of the fix among the notice's own")

    @classmethod
    def description(cls, context, properties):
        """Return what the button does."""
        row = notices.find_notice(context.scene, properties.notice)
        if row is None or properties.index >= len(row.fixes):
            return cls.__doc__
        fix = row.fixes[properties.index]
        if fix.kind == "press":
            return f"Run {fix.name}"
        return TOOLTIPS[fix.kind].format(value=fix.value, failed=row.name)

    def do(self, context):
        """Apply the fix, and run the failed operator again where that is enough."""
        row = self.find_notice(context)
        if self.index >= len(row.fixes):
            raise InputError("fix", f"number {self.index}", f"below {len(row.fixes)}")
        fix = row.fixes[self.index]
        number, other = row.number, {"unit": float(fix.value)} if fix.kind == "use_unit" else {}
        if not APPLY[fix.kind](context, row, fix.value):
            return
        try:
            notices.run_again(context.scene, number, **other)
        except RuntimeError as error:  # what ran again has failed; the fix has been applied
            self.report({"WARNING"}, notices.read_failure(error))


class BEYOND_MOCAP_OT_try_again(NoticeOperator, bpy.types.Operator):
    """Run again what failed, as it was called before"""

    bl_idname = "beyond_mocap.try_again"
    bl_label = "Try Again"
    bl_options = {"UNDO", "INTERNAL"}

    def do(self, context):
        """Run the operator of the notice."""
        notices.run_again(context.scene, self.find_notice(context).number)


class BEYOND_MOCAP_OT_dismiss_notice(NoticeOperator, bpy.types.Operator):
    """Remove this notice; nothing else changes"""

    bl_idname = "beyond_mocap.dismiss_notice"
    bl_label = "Dismiss"
    bl_options = {"INTERNAL"}

    def do(self, context):
        """Remove the notice."""
        notices.dismiss_notice(self.find_notice(context).number)


def _use_nearest(context, _row, _value) -> bool:
    context.scene.beyond_mocap.nearest = True
    return True


def _show_clips(context, _row, label) -> bool:
    """Show the clips with this label in the list of the library's panel."""
    context.scene.beyond_mocap.task = "LIBRARY"
    context.window_manager.beyond_mocap_clips.find = label
    if context.window_manager.beyond_mocap_clips.total == 0:
        bpy.ops.beyond_mocap.list_clips()
    return False


def _show_label(context, row, seconds) -> bool:
    """Go to the label's time, with the player's strips selected."""
    context.scene.frame_set(int(round(bake.compute_frame(context.scene, float(seconds)))))
    player = context.scene.beyond_mocap.players.get(row.player)
    if player is not None and context.mode == "OBJECT":
        strips.show_player(context, player)
    return False


def _choose_library(_context, row, _value) -> bool:
    bpy.ops.beyond_mocap.relink_library("INVOKE_DEFAULT", resumes=row.number)
    return False


def _use_labels(context, row, path) -> bool:
    """Import the file as the labels of the notice's player."""
    player = context.scene.beyond_mocap.players.get(row.player)
    if player is None:
        raise InputError("player", row.player, "a name in the list", "import the track again")
    strips.show_player(context, player)
    file = Path(bpy.path.abspath(path))
    bpy.ops.beyond_mocap.import_words(directory=f"{file.parent}/", files=[{"name": file.name}])
    return True


def _choose_labels(context, row, _value) -> bool:
    if (player := context.scene.beyond_mocap.players.get(row.player)) is not None:
        index = context.scene.beyond_mocap.players.find(player.name)
        context.scene.beyond_mocap.active_player = index
    bpy.ops.beyond_mocap.import_words("INVOKE_DEFAULT", resumes=row.number)
    return False


def _add_track(_context, _row, _value) -> bool:
    bpy.ops.beyond_mocap.import_tracking("INVOKE_DEFAULT")
    return False


def _use_all_players(context, row, _value) -> bool:
    settings = context.scene.beyond_mocap_match if row.room == "match" else context.scene.beyond_mocap
    for player in settings.players:
        player.use = True
    return True


def _press(_context, _row, name) -> bool:
    """Run an operator; one that works in the background leaves the notice until the user tries again."""
    return notices.find_operator(name)("INVOKE_DEFAULT", True) == {"FINISHED"}


APPLY = {"use_nearest": _use_nearest, "show_clips": _show_clips, "show_label": _show_label,
         "choose_library": _choose_library, "relink_library": _choose_library, "choose_labels": _choose_labels,
         "use_labels": _use_labels, "add_track": _add_track, "use_all_players": _use_all_players,
         "use_unit": lambda *_: True, "press": _press}
"""Kind of a fix -> (context, notice, value of the fix), which returns whether the failed operator may run again."""

TOOLTIPS = {"use_nearest": "Turn on Nearest Labels, and run {failed} again",
            "show_clips": "Show the library's clips with the label {value}",
            "show_label": "Go to the time of the label, and select its strips",
            "choose_library": "Choose the folder of clips, and run {failed} again",
            "relink_library": "Find the library beside this file or choose its folder, and run {failed} again",
            "choose_labels": "Choose a text file with the labels of this player",
            "use_labels": "Use {value} as the labels of this player",
            "add_track": "Import a file with the positions of a player",
            "use_all_players": "Select all players of the list, and run {failed} again",
            "use_unit": "Run {failed} again with this unit"}
