"""What went wrong, kept until it is fixed or dismissed: the line, its fixes as buttons, and the call that failed.

A notice has one place: the panel that it belongs to, or a pop-up at the pointer where no such panel is in front.

The rows are on the window manager: neither saved with a file nor undone. Panels draw them, operators post and clear
them.
"""

import itertools
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import bpy
from bpy.props import BoolProperty, CollectionProperty, IntProperty, StringProperty

from ...beyond_mocap.base.errors import BeyondMocapError
from ...beyond_mocap.base.fixes import Fix
from . import window
from .live import Watcher, call_soon


class BeyondMocapFix(bpy.types.PropertyGroup):
    """One way out of a notice; `name` is what its button says"""

    kind: StringProperty(description="Kind of the fix")
    value: StringProperty(description="What the fix needs")
    icon: StringProperty(description="Icon of its button")


class BeyondMocapNotice(bpy.types.PropertyGroup):
    """One notice; `name` is what failed"""

    number: IntProperty(description="Number of the notice in this session")
    scene: StringProperty(description="The scene that it belongs to")
    topic: StringProperty(description="What it is about; a newer notice about the same replaces it")
    room: StringProperty(description="The feature whose panel shows it")
    found: StringProperty(description="What is wrong and where")
    step: StringProperty(description="What is expected, and what to do")
    player: StringProperty(description="The player that it is about")
    is_error: BoolProperty(description="Whether something failed")
    operator: StringProperty(description="The operator that failed")
    arguments: StringProperty(description="The arguments it was called with")
    fixes: CollectionProperty(type=BeyondMocapFix, description="Ways out, the best first")


class BeyondMocapNotices(bpy.types.PropertyGroup):
    """All notices"""

    attached_to = ("WindowManager.beyond_mocap_notices",)
    rows: CollectionProperty(type=BeyondMocapNotice, description="The notices, the oldest first")
    shown: IntProperty(description="Number of the first notice that the pop-up shows")


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Subject:
    """What a notice is about.

    Attributes:
        topic: a newer notice about the same topic replaces the older one.
        room: the feature whose panel shows it.
        title: what failed, as its button says it.
        player: name of the player that it is about; "" for none.
        operator: name of the operator that failed; "" for none.
        arguments: it was called with.
    """

    topic: str
    room: str
    title: str
    player: str = ""
    operator: str = ""
    arguments: dict = field(default_factory=dict)


_numbers = itertools.count(1)  # never twice in a session, whatever files are opened
REDRAWN_SECONDS = 0.2  # until panels are drawn again with a new notice
UNITS = {0.001: "Millimetres", 0.01: "Centimetres", 0.0254: "Inches", 1.0: "Metres"}


def _name_file(path: str) -> str:
    return bpy.path.basename(path)


def _name_unit(metres: str) -> str:
    return f"Read as {UNITS[float(metres)]}" if float(metres) else "Use the File's Unit"


def _name_operator(name: str) -> str:
    return find_operator(name).get_rna_type().name


BUTTONS = {  # kind of a fix -> what its button says, from the fix's value, and its icon
    "use_nearest": (lambda _: "Use Nearest Labels", "CHECKMARK"),
    "show_clips": (lambda _: "Show Clips", "PRESET"),
    "show_label": (lambda _: "Show the Label", "TIME"),
    "choose_library": (lambda _: "Choose Library", "FILE_FOLDER"),
    "relink_library": (lambda _: "Relink Library", "FILE_FOLDER"),
    "choose_labels": (lambda _: "Choose Labels File", "FILEBROWSER"),
    "use_labels": (lambda path: f"Use {_name_file(path)}", "IMPORT"),
    "add_track": (lambda _: "Add a Track", "IMPORT"),
    "use_all_players": (lambda _: "Use All Players", "CHECKBOX_HLT"),
    "use_unit": (_name_unit, "DRIVER_DISTANCE"),
    "press": (_name_operator, "PLAY"),
}


def post_notice(scene: bpy.types.Scene, subject: Subject, error: BeyondMocapError, is_error: bool = True) -> int:
    """Post a notice; it replaces an older one about the same topic, and one of the same fault, of any player.

    Args:
        scene: that it belongs to.
        subject: what it is about.
        error: what went wrong.
        is_error: whether something failed; otherwise it is an offer.
    Returns:
        Its number.
    """
    clear_notices(scene, subject.topic)
    fault = str(scene.session_uid), error.parts[0]
    _remove_rows(lambda row: (row.scene, row.found) == fault)
    group = bpy.context.window_manager.beyond_mocap_notices
    row = group.rows.add()
    row.number, row.scene, row.name, row.is_error = next(_numbers), str(scene.session_uid), subject.title, is_error
    row.topic, row.room, row.player, row.operator = subject.topic, subject.room, subject.player, subject.operator
    row.arguments = json.dumps(subject.arguments)
    row.found, row.step = error.parts
    for fix in error.fixes:
        _add_fix(row, fix)
    window.redraw_editors("VIEW_3D", "NLA_EDITOR", "DOPESHEET_EDITOR")
    return row.number


def clear_notices(scene: bpy.types.Scene, *topics: str) -> None:
    """Clear the notices of a scene about these topics."""
    _remove_rows(lambda row: row.scene == str(scene.session_uid) and row.topic in topics)


def clear_player_notices(scene: bpy.types.Scene, player: str) -> None:
    """Clear the notices of a scene about a player, who is no longer in its list."""
    _remove_rows(lambda row: row.scene == str(scene.session_uid) and row.player == player)


def dismiss_notice(number: int) -> None:
    """Remove the notice of that number, if it is still there."""
    _remove_rows(lambda row: row.number == number)
    window.redraw_editors("VIEW_3D", "NLA_EDITOR", "DOPESHEET_EDITOR")


def find_notice(scene: bpy.types.Scene, number: int = 0) -> BeyondMocapNotice | None:
    """Find the notice of that number, 0 for the newest one of a scene; None where there is none."""
    found = [row for row in list_notices(scene) if number in (0, row.number)]
    return found[-1] if found else None


def list_notices(scene: bpy.types.Scene) -> Iterator[BeyondMocapNotice]:
    """List the notices of a scene, the oldest first."""
    return (row for row in bpy.context.window_manager.beyond_mocap_notices.rows if row.scene == str(scene.session_uid))


def run_again(scene: bpy.types.Scene, number: int, **other) -> None:
    """Dismiss a notice, and call the operator that failed as its button would: long work runs in the background.

    Args:
        scene: of the notice.
        number: of the notice; nothing happens where it is gone.
        other: arguments to call it with besides or instead of those that it had.
    Raises:
        RuntimeError: if it fails at once, or cannot run at present; in that case the notice stays.
    """
    row = find_notice(scene, number)
    if row is None:
        return
    name, arguments = row.operator, json.loads(row.arguments)
    if name and not find_operator(name).poll():
        raise RuntimeError(f"{row.name} cannot run at present; point at its button to see what it needs")
    dismiss_notice(number)
    if name:
        find_operator(name)("INVOKE_DEFAULT", True, **arguments | other)


def read_failure(error: RuntimeError) -> str:
    """Read the line that an operator has reported as its failure."""
    return str(error).strip().removeprefix("Error: ")


def find_operator(name: str):
    """Find the function that calls an operator, by the operator's name."""
    group, verb = name.split(".")
    return getattr(getattr(bpy.ops, group), verb)


def show_notices(first: int) -> None:
    """Show the notices from a number on in a pop-up at the pointer, unless a panel shows them; nothing without a
    window.
    """
    bpy.context.window_manager.beyond_mocap_notices.shown = first
    call_soon(_open_popup, REDRAWN_SECONDS)


def _open_popup() -> None:
    """Open the pop-up in the window of the scene; its `poll` knows what the panels have drawn since."""
    windows = bpy.context.window_manager.windows
    with bpy.context.temp_override(window=bpy.context.window or windows[0]):
        bpy.ops.wm.call_panel("INVOKE_DEFAULT", name="BEYOND_MOCAP_PT_notices", keep_open=False)


def _remove_rows(is_meant: Callable[[BeyondMocapNotice], bool]) -> None:
    rows = bpy.context.window_manager.beyond_mocap_notices.rows
    for index in reversed(range(len(rows))):
        if is_meant(rows[index]):
            rows.remove(index)


def _add_fix(row: BeyondMocapNotice, fix: Fix) -> None:
    say, icon = BUTTONS[fix.kind]
    added = row.fixes.add()
    added.name, added.icon, added.kind, added.value = say(fix.value), icon, fix.kind, fix.value


def _clear_all() -> None:
    bpy.context.window_manager.beyond_mocap_notices.rows.clear()


WATCHER = Watcher(name="notices", loaded=_clear_all)
