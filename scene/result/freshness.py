"""What is out of date: fingerprints of a take's inputs against the present ones, in one place.

Nothing is computed while panels are drawn. With a window, a timer checks one player at a time when something has
changed (a handler notes that, and changed files), and writes the result beside the file, where undo ignores it;
operators and scripts call `update_entry`.

Live updates a player whose track, labels or choices have been edited, once the user's pointer is at rest. The same
comparison decides whether an edit matters, so that neither the preview itself nor playback starts anything. First comes
a quick take, and when nothing has changed for a while a full one in its place.
"""

import hashlib
import json
import os
import threading
import time
from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
from bpy.props import IntProperty, StringProperty

from ...beyond_mocap import annotation
from ...beyond_mocap.base.errors import BeyondMocapError, format_count
from ..core import background, channels, session, window
from ..core.live import Watcher, is_playing
from ..core.settings import BeyondMocapPlayer, to_absolute_path
from . import bake, blocks, plans, queue
from . import manual_keys as hand_keys

if TYPE_CHECKING:
    from ...beyond_mocap.synthesis.plan import Plan

SECONDS = 1.0  # between two checks
LIBRARY_SECONDS = 10.0  # between two checks of the library's folder
FULL_SECONDS = 0.8  # seconds without a change after which a full take replaces a quick one
LIVE_TYPES = (bpy.types.Object, bpy.types.Curve, bpy.types.Action, bpy.types.Scene)  # types that trigger Live
PLAIN = {"STRING", "INT", "FLOAT", "BOOLEAN", "ENUM"}
CHANGED = {  # messages about changed inputs
    "words": "the labels have changed",
    "track": "the track has changed",
    "choices": "settings of step 3 have changed",
    "library": "the library's files have changed",
}

_now: dict = {
    "dirty": True, "left": [], "files": {}, "stamps": {}, "looked": 0.0, "thread": None, "seen": [], "hand": {},
}
_edits: dict = {"looked": 0.0, "quick": {}, "begun": {}}


class BeyondMocapStale(bpy.types.PropertyGroup):
    """What is out of date for one player; its name is the player's."""

    scene: IntProperty(description="The scene's session_uid")
    lines: StringProperty(description="What is out of date, one line each")
    notes: StringProperty(description="Further notes, one line each")
    mend: StringProperty(description="The operator that updates it; empty if nothing is out of date")


def compute_fingerprint(value: Any) -> str:
    """Compute a fingerprint of plain values, arrays and dataclasses: equal for equal content, in every session."""
    digest = hashlib.blake2b(digest_size=12)
    _feed_digest(digest, value)
    return digest.hexdigest()


def _feed_digest(digest, value: Any) -> None:
    """Feed a value and its structure to a digest."""
    if is_dataclass(value):
        for place in fields(value):
            before = place.metadata.get("was", place.default)
            if place.metadata.get("later") and getattr(value, place.name) == before:
                continue  # files saved before this setting existed are not out of date because of it
            digest.update(place.name.encode())
            _feed_digest(digest, getattr(value, place.name))
    elif isinstance(value, np.ndarray):
        digest.update(f"{value.dtype.str}{value.shape}".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, dict):
        _feed_digest(digest, sorted(value.items()))
    elif isinstance(value, (list, tuple)):
        digest.update(f"({len(value)}".encode())
        for item in value:
            _feed_digest(digest, item)
    elif isinstance(value, (set, frozenset)):
        _feed_digest(digest, sorted(value))
    else:
        digest.update(f"{value!r};".encode())


def compute_parts(plan: "Plan", folder: str, library: str = "") -> dict[str, str]:
    """Compute the fingerprints of a take's inputs: track, labels, other settings, and the library on disk.

    Args:
        plan: of the take.
        folder: of the library.
        library: stamp of the library, if it is known.
    Returns:
        Fingerprints by name.
    """
    return {**compute_plan_parts(plan), "library": library or compute_library_stamp(folder)}


def compute_plan_parts(plan: "Plan") -> dict[str, str]:
    """Compute the same without the library, which needs a walk over the disk."""
    rest = replace(plan, track=None, timeline=annotation.Timeline(), library="")
    return {"track": compute_fingerprint(plan.track), "words": compute_fingerprint(plan.timeline),
            "choices": compute_fingerprint(rest)}


def compute_library_stamp(folder: str) -> str:
    """Compute a fingerprint of the clips and labels of a folder: number, size and time of the files, without reading
    them.
    """
    from ...beyond_mocap.files.clip_file import CLIP_ENDINGS, FOREIGN

    found, watched = [], (*CLIP_ENDINGS, *FOREIGN, ".txt", ".csv")
    for place, folders, names in os.walk(folder, followlinks=True):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(names):
            if name.lower().endswith(watched):
                try:
                    status = os.stat(os.path.join(place, name))
                except OSError:
                    continue
                found.append((name, status.st_size, status.st_mtime_ns))
    return compute_fingerprint(found)


def list_changed_parts(made_of: str, now: dict[str, str]) -> list[str]:
    """List the names of inputs with another fingerprint; made_of: JSON as stored with a player."""
    before = json.loads(made_of or "{}")
    return [name for name in now if before and before.get(name) != now[name]]


def update_entry(scene: bpy.types.Scene, player: BeyondMocapPlayer) -> BeyondMocapStale:
    """Check one player, and store what is out of date for the panel."""
    lines, notes, operator = check_player(scene, player)
    entries = bpy.context.window_manager.beyond_mocap_stale
    entry = next((entry for entry in entries if (entry.scene, entry.name) == (scene.session_uid, player.name)), None)
    if entry is None:
        entry = entries.add()
        entry.name, entry.scene = player.name, scene.session_uid
    new = ("\n".join(lines), "\n".join(notes), operator)
    if (entry.lines, entry.notes, entry.mend) != new:
        entry.lines, entry.notes, entry.mend = new
        window.redraw_editors()
    return entry


def check_player(scene: bpy.types.Scene, player: BeyondMocapPlayer) -> tuple[list[str], list[str], str]:
    """Check what is out of date.

    Args:
        scene: for the settings.
        player: the player.
    Returns:
        Lines about what is out of date, further notes, and the operator that updates it.
    """
    if not player.take:
        return [], [], ""
    lines, settings, operator = [], scene.beyond_mocap, "update"
    try:
        plan, _ = plans.build_plan(settings, player, still=True)
        folder = to_absolute_path(settings.library_folder)
        now = compute_parts(plan, folder, _now["stamps"].get(folder) or compute_library_stamp(folder))
        changed = list_changed_parts(player.result.made_of, now)
        lines += [CHANGED[name] for name in changed]
        if "library" in changed and session.find_library(folder, settings.library_unit or None) is not None:
            operator = "build_library"
    except (BeyondMocapError, OSError) as error:
        lines.append(str(error))
    if player.result.state != "NONE":
        problem = describe_body_problem(scene, player)
        lines += [problem] if problem else []
    return lines, _describe_notes(player), operator if lines else ""


def describe_body_problem(scene: bpy.types.Scene, player: BeyondMocapPlayer) -> str:
    """Describe what is wrong with the body that shows a result."""
    body, result = player.body, session.find_take(player.take)
    if body is None or body.name not in scene.objects:
        return "the body has been deleted: Update creates another"
    if result is not None and not bake.is_matching(body, result.take, scene):
        return "the body's bones have been edited: Update creates another body"
    if channels.find_playing_action(body)[0] is None and blocks.find_track(body) is None:
        return "the body no longer plays the result: Update shows it again"
    return ""


def _describe_notes(player: BeyondMocapPlayer) -> list[str]:
    """Describe whether the take is in this session, and how many manual keys the result has."""
    body, notes = player.body, []
    if session.find_take(player.take) is None:
        notes.append("the file was opened again: Update computes the take once more, for overlays, contacts and "
                     "Resynthesize Stretch")
    if body is None or player.result.state == "NONE":
        return notes
    key = (body.session_uid, player.take, player.result.state)
    if bpy.app.background or key not in _now["hand"]:  # without a window no handler reports changes
        _now["hand"][key] = len(hand_keys.find_in_body(body)[0])
    count = _now["hand"][key]
    return [*notes, f"{format_count(count, 'manual key')}: kept by Update"] if count else notes


def mark_dirty(*_) -> None:
    """Mark that something has changed, for the next check."""
    _now["dirty"] = True


def _run_timer() -> float:
    """Check one player, if something has changed and no animation plays."""
    scene = bpy.context.scene
    if scene is None or is_playing():
        return SECONDS
    players = scene.beyond_mocap.players
    _check_files(scene)
    if (seen := _collect_settings(scene)) != _now["seen"]:  # no handler reports settings that a script changes
        _now["seen"] = seen
        mark_dirty()
    if _now["dirty"]:
        _now["dirty"] = False
        active = scene.beyond_mocap.active_player
        _now["left"] = sorted(range(len(players)), key=lambda number: number != active)
    while _now["left"]:
        number = _now["left"].pop(0)
        if number < len(players) and (players[number].take or _has_entry(scene, players[number])):
            update_entry(scene, players[number])
            break
    return SECONDS


def _collect_settings(scene: bpy.types.Scene) -> list:
    """Collect the plain settings of a scene and its players, and the labels in texts."""
    found = []
    for group in (scene.beyond_mocap, *scene.beyond_mocap.players):
        plain = [place for place in group.bl_rna.properties if place.type in PLAIN]
        found += [getattr(group, place.identifier) for place in plain if not getattr(place, "is_array", False)]
    for player in scene.beyond_mocap.players:
        text, body = player.annotation_text, player.body
        found += [text.as_string() if text is not None else None, body is not None and body.name in scene.objects]
    return found


def _has_entry(scene: bpy.types.Scene, player: BeyondMocapPlayer) -> bool:
    entries = bpy.context.window_manager.beyond_mocap_stale
    return any(entry.lines and (entry.scene, entry.name) == (scene.session_uid, player.name) for entry in entries)


def _check_files(scene: bpy.types.Scene) -> None:
    """Detect changes of tracking files, label files and the library on disk."""
    settings = scene.beyond_mocap
    paths = {to_absolute_path(path) for player in settings.players
             for path in (player.tracking_file, player.annotation_file)}
    found = {path: _read_change_time(path) for path in paths if path}
    if found != _now["files"]:
        _now["files"] = found
        mark_dirty()
    folder, thread = to_absolute_path(settings.library_folder), _now["thread"]
    if folder and (thread is None or not thread.is_alive()) and time.monotonic() > _now["looked"] + LIBRARY_SECONDS:
        _now["looked"] = time.monotonic()
        _now["thread"] = threading.Thread(target=_update_stamp, args=(folder,), name="beyond-mocap library",
                                          daemon=True)
        _now["thread"].start()


def _update_stamp(folder: str) -> None:
    stamp = compute_library_stamp(folder)
    if _now["stamps"].get(folder) != stamp:
        _now["stamps"][folder] = stamp
        mark_dirty()


def _read_change_time(path: str) -> int:
    try:
        return os.stat(path).st_mtime_ns
    except OSError:
        return 0


def _reset_states() -> None:
    """Reset all saved work states after loading a file, and when the extension is disabled."""
    manager = bpy.context.window_manager
    work = manager.beyond_mocap_work
    work.kind = work.waiting = work.trouble = ""
    manager.beyond_mocap_stale.clear()
    queue.clear_queue()
    _now["hand"].clear()
    mark_dirty()


def _stop_work() -> None:
    background.cancel_jobs()
    _reset_states()
    queue.set_busy(False)


def _handle_change(_scene, graph) -> None:
    """Handle a change of objects, actions, texts or settings."""
    if any(isinstance(update.id, (bpy.types.Action, bpy.types.Object)) for update in graph.updates):
        _now["hand"].clear()
    if len(graph.updates):
        mark_dirty()


def _handle_undo() -> None:
    _now["hand"].clear()
    mark_dirty()


def compute_edited_parts(scene: bpy.types.Scene, player) -> dict[str, str]:
    """Compute the fingerprints of a player's present inputs if they differ from those of the newest take.

    Empty if they are equal, if there is no take, or if the present inputs are invalid.
    """
    made_of = json.loads(player.result.made_of or "{}")
    if not player.take or not made_of:
        return {}
    try:
        present = compute_plan_parts(plans.build_plan(scene.beyond_mocap, player, still=True)[0])
    except (BeyondMocapError, OSError):
        return {}
    return present if any(made_of.get(name) != value for name, value in present.items()) else {}


def find_due_update(scene: bpy.types.Scene, now: float) -> tuple[str, str] | None:
    """Find the player to update, and how.

    Each set of inputs starts one update: after a cancellation, an undo or an error, the next edit starts another.

    Args:
        scene: with the players.
        now: seconds.
    Returns:
        (player's name, "quick" or "whole"); None if no update is due.
    """
    players = {player.name: player for player in scene.beyond_mocap.players if player.use}
    if _edits["looked"] != LIVE.changed_at:
        for name, player in players.items():
            present = compute_edited_parts(scene, player)
            if present and _edits["begun"].get(name) != present:
                _edits["quick"][name], _edits["begun"][name] = now, present
                return name, "quick"
        _edits["looked"] = LIVE.changed_at
    for name, since in list(_edits["quick"].items()):
        if now - max(since, LIVE.changed_at) > FULL_SECONDS:
            del _edits["quick"][name]
            if name in players and not compute_edited_parts(scene, players[name]):
                return name, "whole"
    return None


def start_due_update(scene: bpy.types.Scene) -> bool:
    """Start the update that is due if Live is on; returns whether another may become due."""
    if not scene.beyond_mocap.live:
        _edits["quick"].clear()
        return False
    if bpy.context.window_manager.beyond_mocap_work.kind or queue.list_players() or is_playing():
        return True
    found = find_due_update(scene, time.perf_counter())
    if found is not None and bpy.ops.beyond_mocap.update_live.poll():
        bpy.ops.beyond_mocap.update_live("INVOKE_DEFAULT", player=found[0], kind=found[1])
    return found is not None or bool(_edits["quick"])


def clear_edits() -> None:
    """Clear all known inputs."""
    _edits.update(looked=0.0, quick={}, begun={})


WATCHER = Watcher(name="What is out of date", changed=_handle_change, restored=_handle_undo, loaded=_reset_states,
                  look=_run_timer, ends=_stop_work)
LIVE = Watcher(name="Live", watched_types=LIVE_TYPES, settle=start_due_update, ends=clear_edits)


def register():
    """Register the stored results, which are not part of the file."""
    bpy.types.WindowManager.beyond_mocap_stale = bpy.props.CollectionProperty(type=BeyondMocapStale)


def unregister():
    """Unregister the stored results."""
    del bpy.types.WindowManager.beyond_mocap_stale
