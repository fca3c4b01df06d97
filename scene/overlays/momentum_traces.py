"""Which armatures show their momentum, and the trace of each: computed once for each change of its motion.

The trace is that of the visible motion, on any humanoid armature. It is computed by the operator, and again when the
user is idle after a change; why it cannot be is stored with the armature for the panel.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import bpy

from ...beyond_mocap.base.errors import InputError
from ..core import window
from ..core.live import Watcher, call_or_describe
from ..path_editing import armature_adapter, edited_bodies, rig_source, rigs

if TYPE_CHECKING:
    from ...beyond_mocap.motion.momentum_trace import MomentumTrace
    from ...beyond_mocap.motion.motion import Motion

_WATCHED = (bpy.types.Object, bpy.types.Armature, bpy.types.Action, bpy.types.Scene)


class ShownMomentum(NamedTuple):
    """The trace of an armature's motion.

    Attributes:
        trace: metres, world.
        first: scene frame of its first frame.
        digest: of all that it was computed from.
    """

    trace: "MomentumTrace"
    first: int
    digest: tuple


_shown: dict[int, ShownMomentum] = {}  # by session_uid of the armature
_refused: dict[int, tuple] = {}  # likewise: digest of a motion that cannot be traced
_keys: dict[int, bytes] = {}  # likewise: digest of its keys, until these may have changed


def has_traces() -> bool:
    """Return whether any trace has been computed; fast, since every redraw calls it."""
    return bool(_shown)


def find_momentum(body: bpy.types.Object) -> ShownMomentum | None:
    """Find the trace of an armature that shows its momentum; None while there is none."""
    return _shown.get(body.session_uid) if body.beyond_mocap_momentum.show else None


def list_showing_armatures(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """List the armatures of a scene that show their momentum."""
    if not bpy.data.armatures:
        return []
    return [body for body in scene.objects if body.type == "ARMATURE" and body.beyond_mocap_momentum.show]


def show_momentum(scene: bpy.types.Scene, bodies: Sequence[bpy.types.Object]) -> None:
    """Show the momentum of armatures. Raises InputError, and changes nothing, if one of them cannot be traced."""
    _keys.clear()
    traced = [(body, _compute_momentum(scene, body, _compute_digest(scene, body))) for body in bodies]
    for body, shown in traced:
        body.beyond_mocap_momentum.show, body.beyond_mocap_momentum.message = True, ""
        _shown[body.session_uid] = shown
    window.redraw_editors()


def hide_momentum(bodies: Sequence[bpy.types.Object]) -> None:
    """Hide the momentum of armatures."""
    for body in bodies:
        body.beyond_mocap_momentum.show, body.beyond_mocap_momentum.message = False, ""
        _shown.pop(body.session_uid, None)
    window.redraw_editors()


def update_traces(scene: bpy.types.Scene) -> None:
    """Update the traces of motions that have changed, and drop those of armatures that are gone."""
    there = {body.session_uid for body in bpy.data.objects}
    for table in (_shown, _refused, _keys):
        for uid in table.keys() - there:
            del table[uid]
    for body in list_showing_armatures(scene):
        if body.mode != "EDIT":
            call_or_describe(lambda: _update_trace(scene, body), partial(_refuse, scene, body),
                             f"{body.name}: the momentum cannot be computed")
    window.redraw_editors()


def clear_traces() -> None:
    """Drop all traces."""
    for table in (_shown, _refused, _keys):
        table.clear()


def _update_trace(scene: bpy.types.Scene, body: bpy.types.Object) -> None:
    uid, digest = body.session_uid, _compute_digest(scene, body)
    if digest == _refused.get(uid) or uid in _shown and _shown[uid].digest == digest:
        return
    _shown[uid] = _compute_momentum(scene, body, digest)
    _refused.pop(uid, None)
    _store_message(body, "")


def _refuse(scene: bpy.types.Scene, body: bpy.types.Object, reason: str) -> None:
    """Store why the momentum of an armature cannot be computed."""
    _shown.pop(body.session_uid, None)
    _refused[body.session_uid] = _compute_digest(scene, body)
    _store_message(body, reason)


def _store_message(body: bpy.types.Object, message: str) -> None:
    """Store a message if it is another one: each write is a change that is checked again."""
    if body.beyond_mocap_momentum.message != message:
        body.beyond_mocap_momentum.message = message


def _compute_momentum(scene: bpy.types.Scene, body: bpy.types.Object, digest: tuple) -> ShownMomentum:
    """Compute the trace of an armature's visible motion. Raises InputError if it has none, or no hips or legs."""
    from ...beyond_mocap.motion.momentum_trace import trace_momentum

    motion, first = _read_visible_motion(scene, body)
    armature_adapter.check_finite(body, motion)
    if len(motion) < 2:
        raise InputError(f"armature {body.name}", "a single pose", "a motion", "import one, or choose an action")
    try:
        return ShownMomentum(trace_momentum(motion), first, digest)
    except InputError as error:  # it has no legs
        raise InputError(f"armature {body.name}", "has no legs that can be found", "a humanoid",
                         "select another armature, or name its bones as common rigs do") from error


def _read_visible_motion(scene: bpy.types.Scene, body: bpy.types.Object) -> tuple["Motion", int]:
    """Read the motion that an armature shows, also on its new path, and the scene frame of its first pose."""
    edit = edited_bodies.find_computed_edit(body)
    if edit is not None:
        return edit.edited.motion, edit.first
    if body.beyond_mocap_ride.on or not rigs.is_keyed_on_bones(body):
        return rig_source.sample_visible_motion(body, scene)
    read = armature_adapter.PlainAdapter(body).read_motion(scene)
    return read.motion, read.first


def _compute_digest(scene: bpy.types.Scene, body: bpy.types.Object) -> tuple:
    """Compute a digest of what the visible motion is read from; keys are read only where they may have changed."""
    edit, adapter, uid = edited_bodies.find_computed_edit(body), rigs.choose_adapter(body), body.session_uid
    if edit is not None:
        return (edit.number,)
    if uid not in _keys:
        _keys[uid] = adapter.compute_keys_digest()
    action = adapter.find_source()[0]
    return action and action.session_uid, _keys[uid], adapter.compute_input_digest(scene)


def _note_changes(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    changed = [update.id for update in depsgraph.updates if isinstance(update.id, _WATCHED)]
    if any(isinstance(one, bpy.types.Action) for one in changed):
        _keys.clear()
    if changed:
        WATCHER.mark_dirty()


WATCHER = Watcher(name="Momentum", changed=_note_changes, settle=update_traces, restored=_keys.clear,
                  loaded=clear_traces, ends=clear_traces)
