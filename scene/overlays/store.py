"""The takes that are prepared for drawing: once each, in a thread, and dropped when no player shows them.

`update_store` is cheap and called whenever the file has changed: it compares a few names. Missing takes are prepared in
the background while no other work runs, and the views are redrawn when they are ready.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
from mathutils import Matrix

from ..core import action as actions
from ..core import background, session, window
from ..core.live import Watcher, call_soon
from ..core.measure import frames_per_second, units_per_metre
from ..core.properties import find_active_row

if TYPE_CHECKING:
    from .prepare import PreparedTake

KIND = "view"
WAIT = 0.1  # seconds between two checks of the thread

_prepared: dict[str, "PreparedTake"] = {}
_refused: set[str] = set()
_running: list[tuple[background.Job, str]] = []  # at most one, with the name of its take


def find_prepared(take: str) -> "PreparedTake | None":
    """Find the prepared take of that name; None while it is not ready."""
    return _prepared.get(take)


def list_shown_players(settings) -> list:
    """List the players whose overlays are drawn."""
    if settings.view.players == "TICKED":
        return [player for player in settings.players if player.use and player.take]
    player = find_active_row(settings.players, settings.active_player)
    return [player] if player is not None and player.take else []


def update_store(scene: bpy.types.Scene) -> None:
    """Drop takes that no player shows, and start to prepare missing ones."""
    settings = getattr(scene, "beyond_mocap", None)
    if settings is None:
        return
    needed = {player.take for any_scene in bpy.data.scenes for player in any_scene.beyond_mocap.players}
    for name in [name for name in _prepared if name not in needed]:
        del _prepared[name]
    _refused.intersection_update(needed)
    if _list_missing(scene):
        call_soon(_run_timer, WAIT)


def clear_store() -> None:
    """Drop all takes and stop the thread."""
    background.cancel_jobs(KIND)
    _running.clear()
    _prepared.clear()
    _refused.clear()


def update_reasons(scene: bpy.types.Scene) -> None:
    """Store the text about the piece at the playhead for the panel."""
    manager, settings = bpy.context.window_manager, scene.beyond_mocap
    player = find_active_row(settings.players, settings.active_player)
    found = find_prepared(player.take) if player is not None and player.take else None
    piece = found.find_piece(seconds_at(scene)) if found else None
    text = "\n".join(piece.lines) if piece else ""
    if manager is not None and manager.beyond_mocap_playhead.why != text:
        manager.beyond_mocap_playhead.why = text


def seconds_at(scene: bpy.types.Scene) -> float:
    """Compute the time of the tracking file's clock at the current frame."""
    settings = scene.beyond_mocap
    return settings.start_time + (scene.frame_current_final - settings.start_frame) / frames_per_second(scene)


def take_to_world(scene: bpy.types.Scene, body: bpy.types.Object | None) -> Matrix:
    """Compute the matrix from a take's metres to the scene's units.

    It includes the place of the body when the take was written, and where the user has moved it since.
    """
    scale = Matrix.Scale(units_per_metre(scene), 4)
    written = _read_written_matrix(body) if body is not None else None
    return scale if written is None else body.matrix_world @ written.inverted_safe() @ scale


def _file_changed(*_) -> None:
    if not bpy.app.background and bpy.context.scene is not None and not bpy.app.is_job_running("RENDER"):
        update_store(bpy.context.scene)
        update_reasons(bpy.context.scene)


def _frame_changed(scene) -> None:
    if not bpy.app.is_job_running("RENDER"):
        update_reasons(scene)


def _list_missing(scene: bpy.types.Scene) -> list[tuple]:
    """List (name, plan, take, library) of takes to show that are not prepared."""
    settings = scene.beyond_mocap
    players = [*list_shown_players(settings),
               *filter(None, [find_active_row(settings.players, settings.active_player)])]
    names = dict.fromkeys(player.take for player in players if player.take)
    missing = []
    for name in names:
        session_take = session.find_take(name)
        if name not in _prepared and name not in _refused and session_take is not None:
            library = session.find_library(session_take.plan.library, settings.library_unit
                                           or None) if session_take.plan.library else None
            missing.append((name, session_take.plan, session_take.take, library))
    return missing


def _prepare_takes(missing, _progress, cancelled, _hurry) -> dict[str, "PreparedTake"]:
    from .prepare import prepare_take

    found = {}
    for name, plan, take, library in missing:
        if cancelled():
            break
        found[name] = prepare_take(plan, take, library)
    return found


def _run_timer() -> float | None:
    """Check once: start the thread, wait for it, or store its result."""
    scene = bpy.context.scene
    if not _running:
        missing = _list_missing(scene)[:1]
        if not missing:
            return None
        if bpy.context.window_manager.beyond_mocap_work.kind:  # running work comes first
            return 5 * WAIT
        _running.append((background.Job(KIND, lambda *asking: _prepare_takes(missing, *asking)), missing[0][0]))
        return WAIT
    job, name = _running[0]
    if not job.poll():
        return WAIT
    _running.clear()
    _prepared.update(job.result or {})
    if job.error is not None:
        _refused.add(name)
        print(f"Beyond Mocap: cannot draw the overlays of {name}: {job.error}")
    update_reasons(scene)
    window.redraw_editors()
    return WAIT


def _read_written_matrix(body: bpy.types.Object) -> Matrix | None:
    """Read the armature's matrix when its take was written; None without one."""
    for action in _iter_actions(body):
        if (numbers := action.get(actions.PLACEMENT)) is not None:
            rows = list(numbers)
            return Matrix([rows[i : i + 4] for i in range(0, 16, 4)])
    return None


def _iter_actions(body: bpy.types.Object):
    """Iterate over the actions that an object plays: its own, and those of its strips."""
    data = body.animation_data
    if data is not None:
        yield from filter(None, [data.action])
        yield from (strip.action for track in data.nla_tracks for strip in track.strips if strip.action)


WATCHER = Watcher(name="Overlays", changed=_file_changed, framed=_frame_changed, restored=_file_changed,
                  loaded=_file_changed, ends=clear_store)
