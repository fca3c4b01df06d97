"""What is out of date, said in one place: fingerprints of what a take was made of, against what is asked now.

Nothing is worked out while panels are drawn. With a window, a timer looks at one player at a time when something has
changed (a handler notes that, and whether files have), and writes what it finds beside the file, where undo leaves it
alone; operators and scripts may ask with `renew`.

Live has a player updated whose track, words or choices have been edited, once the user's hand has come to rest. That an
edit matters is found by the same comparison, so that neither the preview itself nor a walk along the timeline starts
anything. First a quick take is made, and when nothing has changed for a while a whole one in its place.
"""

from __future__ import annotations

import hashlib
import json
import os
import threading
import time
from dataclasses import fields, is_dataclass, replace
from typing import Any

import bpy
import numpy as np
from bpy.props import IntProperty, StringProperty

from ...beyond_mocap.annotation import Timeline
from ...beyond_mocap.base.errors import BeyondMocapError
from ...beyond_mocap.synthesis.plan import Plan
from ..core import background, channels, session, window
from ..core.live import Watcher, is_playing
from ..core.settings import BeyondMocapPlayer, absolute
from . import bake, blocks, hand_keys, plans, queue

SECONDS = 1.0  # between two looks
LIBRARY_SECONDS = 10.0  # between two looks at the library's folder
WHOLE = 0.8  # seconds without a change after which a quick take is made as well as it can be
MATTERS = (bpy.types.Object, bpy.types.Curve, bpy.types.Action, bpy.types.Scene)  # to Live
PLAIN = {"STRING", "INT", "FLOAT", "BOOLEAN", "ENUM"}
CHANGED = {  # what is told where a part of `parts` is another
    "words": "its words have changed since",
    "track": "its track has changed since",
    "choices": "choices in step 3 have changed since",
    "library": "the library's files have changed since",
}

_now: dict = {
    "dirty": True, "left": [], "files": {}, "stamps": {}, "looked": 0.0, "thread": None, "seen": [], "hand": {},
}
_edits: dict = {"looked": 0.0, "quick": {}, "begun": {}}


class BeyondMocapStale(bpy.types.PropertyGroup):
    """What is out of date about one player; its name is the player's."""

    scene: IntProperty(description="The scene's session_uid")
    lines: StringProperty(description="What is out of date, a line each")
    notes: StringProperty(description="What else there is to know, a line each")
    mend: StringProperty(description="The operator that mends it; empty where nothing is out of date")


def fingerprint(value: Any) -> str:
    """Of plain values, arrays and dataclasses of them: equal for equal content, in every session."""
    digest = hashlib.blake2b(digest_size=12)
    _feed(digest, value)
    return digest.hexdigest()


def _feed(digest, value: Any) -> None:
    if is_dataclass(value):
        for place in fields(value):
            if place.metadata.get("later") and getattr(value, place.name) == place.default:
                continue  # files made before there was this choice are not out of date for it
            digest.update(place.name.encode())
            _feed(digest, getattr(value, place.name))
    elif isinstance(value, np.ndarray):
        digest.update(f"{value.dtype.str}{value.shape}".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, dict):
        _feed(digest, sorted(value.items()))
    elif isinstance(value, (list, tuple)):
        digest.update(f"({len(value)}".encode())
        for item in value:
            _feed(digest, item)
    elif isinstance(value, (set, frozenset)):
        _feed(digest, sorted(value))
    else:
        digest.update(f"{value!r};".encode())


def parts(plan: Plan, folder: str, library: str = "") -> dict[str, str]:
    """What a take is made of, each by its fingerprint: the track, the words, the other choices, the library on disk
    (`library`, where its stamp is known)."""
    return {**parts_of_plan(plan), "library": library or library_stamp(folder)}


def parts_of_plan(plan: Plan) -> dict[str, str]:
    """The same without the library, which takes a walk over the disk."""
    rest = replace(plan, track=None, timeline=Timeline(), library="")
    return {"track": fingerprint(plan.track), "words": fingerprint(plan.timeline), "choices": fingerprint(rest)}


def library_stamp(folder: str) -> str:
    """Of the clips and words of a folder as they lie on disk: their number, size and time, without reading them."""
    found = []
    for place, folders, names in os.walk(folder, followlinks=True):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(names):
            if name.lower().endswith((".bvh", ".txt", ".csv", ".fbx", ".glb", ".gltf")):
                try:
                    status = os.stat(os.path.join(place, name))
                except OSError:
                    continue
                found.append((name, status.st_size, status.st_mtime_ns))
    return fingerprint(found)


def stale(made_of: str, now: dict[str, str]) -> list[str]:
    """What has changed since: names of `parts` whose fingerprint is another. made_of: JSON as kept on a player."""
    before = json.loads(made_of or "{}")
    return [name for name in now if before and before.get(name) != now[name]]


def renew(scene: bpy.types.Scene, player: BeyondMocapPlayer) -> BeyondMocapStale:
    """Look at one player, and write what is out of date where the panel finds it."""
    lines, notes, mend = look(scene, player)
    told = bpy.context.window_manager.beyond_mocap_stale
    entry = next((entry for entry in told if (entry.scene, entry.name) == (scene.session_uid, player.name)), None)
    if entry is None:
        entry = told.add()
        entry.name, entry.scene = player.name, scene.session_uid
    new = ("\n".join(lines), "\n".join(notes), mend)
    if (entry.lines, entry.notes, entry.mend) != new:
        entry.lines, entry.notes, entry.mend = new
        window.redraw()
    return entry


def look(scene: bpy.types.Scene, player: BeyondMocapPlayer) -> tuple[list[str], list[str], str]:
    """What is out of date, what else there is to know, and the operator that mends it."""
    if not player.take:
        return [], [], ""
    lines, settings, mend = [], scene.beyond_mocap, "update"
    if session.made(player.take) is None:
        lines.append("its take is not in this session: Update makes it again, hand-made keys are kept")
    try:
        plan, _ = plans.plan_of(settings, player, still=True)
        folder = absolute(settings.library_folder)
        now = parts(plan, folder, _now["stamps"].get(folder) or library_stamp(folder))
        changed = stale(player.result.made_of, now)
        lines += [CHANGED[name] for name in changed]
        if "library" in changed and session.library(folder, settings.library_unit or None) is not None:
            mend = "build_library"
    except (BeyondMocapError, OSError) as error:
        lines.append(str(error))
    if player.result.state != "NONE":
        trouble = _body(scene, player)
        lines += [trouble] if trouble else []
    return lines, _notes(player), mend if lines else ""


def _body(scene: bpy.types.Scene, player: BeyondMocapPlayer) -> str:
    """What is wrong with the body that shows a result."""
    body, made = player.body, session.made(player.take)
    if body is None or body.name not in scene.objects:
        return "its body has been deleted: Update makes another"
    if made is not None and not bake.fits(body, made.take, scene):
        return "its body's bones have been edited: Update makes another body"
    if channels.playing(body)[0] is None and blocks.track_of(body) is None:
        return "its body does not play the result any more: Update shows it again"
    return ""


def _notes(player: BeyondMocapPlayer) -> list[str]:
    """How many hand-made keys the result carries."""
    body = player.body
    if body is None or player.result.state == "NONE":
        return []
    key = (body.session_uid, player.take, player.result.state)
    if bpy.app.background or key not in _now["hand"]:  # without a window no handler tells of changes
        _now["hand"][key] = len(hand_keys.of_body(body)[0])
    count = _now["hand"][key]
    keys = "hand-made key" if count == 1 else "hand-made keys"
    return [f"{count} {keys}: kept by Update"] if count else []


def dirty(*_) -> None:
    """Something has changed: look again when there is time."""
    _now["dirty"] = True


def _tick() -> float:
    """Look at one player, if something has changed and nobody is busy."""
    scene = bpy.context.scene
    if scene is None or is_playing():
        return SECONDS
    players = scene.beyond_mocap.players
    _look_at_files(scene)
    if (seen := _seen(scene)) != _now["seen"]:  # settings that a script changes tell no handler
        _now["seen"] = seen
        dirty()
    if _now["dirty"]:
        _now["dirty"] = False
        active = scene.beyond_mocap.active_player
        _now["left"] = sorted(range(len(players)), key=lambda number: number != active)
    while _now["left"]:
        number = _now["left"].pop(0)
        if number < len(players) and (players[number].take or _told(scene, players[number])):
            renew(scene, players[number])
            break
    return SECONDS


def _seen(scene: bpy.types.Scene) -> list:
    """The settings of a scene and its players, as far as they are plain values, and the words that are texts."""
    found = []
    for group in (scene.beyond_mocap, *scene.beyond_mocap.players):
        plain = [place for place in group.bl_rna.properties if place.type in PLAIN]
        found += [getattr(group, place.identifier) for place in plain if not getattr(place, "is_array", False)]
    for player in scene.beyond_mocap.players:
        text, body = player.annotation_text, player.body
        found += [text.as_string() if text is not None else None, body is not None and body.name in scene.objects]
    return found


def _told(scene: bpy.types.Scene, player: BeyondMocapPlayer) -> bool:
    told = bpy.context.window_manager.beyond_mocap_stale
    return any(entry.lines and (entry.scene, entry.name) == (scene.session_uid, player.name) for entry in told)


def _look_at_files(scene: bpy.types.Scene) -> None:
    """Note where tracking, words or library have changed on disk."""
    settings = scene.beyond_mocap
    paths = {absolute(path) for player in settings.players for path in (player.tracking_file, player.annotation_file)}
    found = {path: _changed_at(path) for path in paths if path}
    if found != _now["files"]:
        _now["files"] = found
        dirty()
    folder, thread = absolute(settings.library_folder), _now["thread"]
    if folder and (thread is None or not thread.is_alive()) and time.monotonic() > _now["looked"] + LIBRARY_SECONDS:
        _now["looked"] = time.monotonic()
        _now["thread"] = threading.Thread(target=_stamp, args=(folder,), name="beyond-mocap library", daemon=True)
        _now["thread"].start()


def _stamp(folder: str) -> None:
    stamp = library_stamp(folder)
    if _now["stamps"].get(folder) != stamp:
        _now["stamps"][folder] = stamp
        dirty()


def _changed_at(path: str) -> int:
    try:
        return os.stat(path).st_mtime_ns
    except OSError:
        return 0


def _nothing_runs() -> None:
    """Whatever was saved with a file that has just been opened; and when the extension is switched off."""
    manager = bpy.context.window_manager
    work = manager.beyond_mocap_work
    work.kind = work.waiting = work.trouble = ""
    manager.beyond_mocap_stale.clear()
    queue.clear()
    _now["hand"].clear()
    dirty()


def _end() -> None:
    background.stop()
    _nothing_runs()
    queue.work(False)


def _after_change(_scene, graph) -> None:
    """Objects, actions, texts or settings have changed."""
    if any(isinstance(update.id, (bpy.types.Action, bpy.types.Object)) for update in graph.updates):
        _now["hand"].clear()
    if len(graph.updates):
        dirty()


def _after_undo() -> None:
    _now["hand"].clear()
    dirty()


def edited_parts(scene: bpy.types.Scene, player) -> dict[str, str]:
    """What the player asks for, where that is another track, other words or other choices than his newest take was made
    of; empty where it is not, where he has none, or where what he asks for makes no sense just now."""
    made_of = json.loads(player.result.made_of or "{}")
    if not player.take or not made_of:
        return {}
    try:
        asked = parts_of_plan(plans.plan_of(scene.beyond_mocap, player, still=True)[0])
    except (BeyondMocapError, OSError):
        return {}
    return asked if any(made_of.get(name) != value for name, value in asked.items()) else {}


def due_update(scene: bpy.types.Scene, now: float) -> tuple[str, str] | None:
    """(player's name, "quick" or "whole") of whoever is to be updated at second `now`; None where nobody is. The same
    wish is begun once: what was cancelled, undone or cannot be made waits for the next edit."""
    players = {player.name: player for player in scene.beyond_mocap.players if player.use}
    if _edits["looked"] != LIVE.since:
        for name, player in players.items():
            asked = edited_parts(scene, player)
            if asked and _edits["begun"].get(name) != asked:
                _edits["quick"][name], _edits["begun"][name] = now, asked
                return name, "quick"
        _edits["looked"] = LIVE.since
    for name, since in list(_edits["quick"].items()):
        if now - max(since, LIVE.since) > WHOLE:
            del _edits["quick"][name]
            if name in players and not edited_parts(scene, players[name]):
                return name, "whole"
    return None


def update_due(scene: bpy.types.Scene) -> bool:
    """Have a player updated who is to be, where Live is on; whether one may have to be in a while."""
    if not scene.beyond_mocap.live:
        _edits["quick"].clear()
        return False
    if bpy.context.window_manager.beyond_mocap_work.kind or queue.names() or is_playing():
        return True
    found = due_update(scene, time.perf_counter())
    if found is not None and bpy.ops.beyond_mocap.update_live.poll():
        bpy.ops.beyond_mocap.update_live("INVOKE_DEFAULT", player=found[0], kind=found[1])
    return found is not None or bool(_edits["quick"])


def forget_edits() -> None:
    """No wish is known any more."""
    _edits.update(looked=0.0, quick={}, begun={})


WATCHER = Watcher(name="What is out of date", changed=_after_change, restored=_after_undo, loaded=_nothing_runs,
                  look=_tick, ends=_end)
LIVE = Watcher(name="Live", matters=MATTERS, settle=update_due, ends=forget_edits)


def register():
    """What is found is kept beside the file."""
    bpy.types.WindowManager.beyond_mocap_stale = bpy.props.CollectionProperty(type=BeyondMocapStale)


def unregister():
    """It is not kept any more."""
    del bpy.types.WindowManager.beyond_mocap_stale
