"""Start, update, apply and revert path edits of armatures; the work behind the buttons."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property

import bpy
import numpy as np

from ...beyond_mocap.base.digest import byte_digest
from ...beyond_mocap.base.errors import BeyondMocapError, InputError, format_count
from ...beyond_mocap.motion.motion import Motion, compute_pose, sample_frames
from ..characters.ball_touches import list_touch_times
from ..core import channels, session, take_record
from ..core.measure import build_scene_clock
from ..core.saved_state import discard_saved_state, restore_nla
from . import curve, keys
from .armature_adapter import MARK, clear_source_cache, invalidate_sources, read_source
from .rigs import choose_adapter
from .settings import collect_options, list_edited_bodies, select_object

_SAMPLES = 400
_AT_BALL = 0.05  # metres of a body away from its place up to which it still meets the ball
MOST_FRAMES = 40_000  # of a cycled motion, about: it is computed at every change, and more would take minutes


@dataclass(frozen=True, eq=False)
class ComputedEdit:
    """The computed path edit of an armature: plain values, metres in the scene's world.

    Attributes:
        first: scene frame of the first frame.
        fps: frames per second.
        source: `PathEditSource` of the core.
        path: the new path.
        edited: `EditedMotion` of the core.
        number: a counter, new for each computation.
        messages: lines for the user.
    """

    first: int
    fps: float
    source: object
    path: object
    edited: object
    number: int
    messages: str = ""

    @cached_property
    def source_line(self) -> np.ndarray:
        """(N, 3) metres, the original path."""
        return _sample_line(self.source.path)

    @cached_property
    def line(self) -> np.ndarray:
        """(N, 3) metres, the new path."""
        return _sample_line(self.path)

    def find_frames(self, frame: float) -> tuple[int, int]:
        """Compute the edited frame at a scene frame and the original frame that it displays, both within range."""
        own = int(np.clip(round(frame - self.first), 0, len(self.edited.motion) - 1))
        return own, int(np.clip(round(self.edited.frames[own]), 0, len(self.source.motion) - 1))


_computed: dict[int, tuple[str, ComputedEdit]] = {}  # by session_uid of the armature: digest and result
_counter = 0


def clear_caches() -> None:
    """Clear all caches when another file is opened."""
    _computed.clear()
    clear_source_cache()
    curve.clear_ground_cache()
    keys.clear_cache()


def has_computed_edits() -> bool:
    """Return whether any path edit has been computed; fast, since every redraw calls it."""
    return bool(_computed)


def find_computed_edit(body: bpy.types.Object) -> ComputedEdit | None:
    """Find the last computed path edit of an armature; None if this session has none."""
    digest, known = _computed.get(body.session_uid, ("", None))
    if known is None or not body.beyond_mocap_ride.on:
        return None
    played = channels.find_playing_action(body)[0]
    return known if played is not None and played.get(MARK) == digest else None  # undo may have restored another


def update_motion(scene: bpy.types.Scene, body: bpy.types.Object, force: bool = False) -> bool:
    """Update an armature's motion from its curve and settings.

    Args:
        scene: of the armature.
        body: the edited armature.
        force: check all sources again and write the motion even if it seems unchanged.
    Returns:
        Whether anything was computed.
    Raises:
        InputError: if it cannot be computed at present; the motion stays as it was.
    """
    from ...beyond_mocap.path_editing.path_edit import edit_path
    from ...beyond_mocap.path_editing.path_edit_settings import PathEditSettings

    global _counter
    edit, carrier = body.beyond_mocap_ride, choose_adapter(body)
    carrier.check()
    if force:
        bpy.context.view_layer.update()
        invalidate_sources()
        keys.invalidate_cache()
    settings, drawn = PathEditSettings(**collect_options(edit)), curve.read_curve(scene, edit.curve)
    known = read_source(carrier, scene, settings)
    ground = curve.compute_ground_digest(scene, edit.ground)
    digest = byte_digest(known.digest, drawn.digest, ground, repr(settings)).hex()
    action = carrier.find_edit_action()[0]
    up_to_date, remembered = action[MARK] == digest, _computed.get(body.session_uid, ("", None))[0] == digest
    if up_to_date and remembered and not force:
        lines = _build_messages(scene, edit, digest, _computed[body.session_uid][1])
        store_messages(edit, lines)  # removes messages about problems that are solved
        return False
    path = drawn.to_path()
    _check_length(known.core, path, settings)
    edited = edit_path(known.core, path, settings, curve.load_ground(scene, edit.ground, ground))
    if force or not up_to_date:
        carrier.write_motion(scene, known.read, edited, digest)
        frames = known.read.first + np.arange(len(edited.motion))
        take_record.store_contacts(carrier.find_edit_action()[0], frames, edited.standing.any(axis=2))
    _counter += 1
    first, fps = known.read.first, known.read.motion.fps
    messages = "\n".join((*drawn.notes, *curve.list_ground_messages(edit.ground), *known.read.messages,
                          *edited.warnings, *_report_lost_touches(scene, body, known.core.motion, edited.motion,
                                                                  first=first)))
    now = ComputedEdit(first, fps, known.core, path=path, edited=edited, number=_counter, messages=messages)
    _computed[body.session_uid] = digest, now
    store_messages(edit, _build_messages(scene, edit, digest, now), _summarize_figures(known.core, edited))
    return True


def _build_messages(scene: bpy.types.Scene, edit, digest: str, now: ComputedEdit) -> str:
    """Build the messages of a path edit, also where it ends beyond the scene, or changed since collisions were
    avoided.
    """
    lines, last = [now.messages] if now.messages else [], now.first + len(now.edited.motion) - 1
    if last > max(scene.frame_end, now.first + len(now.source.motion) - 1):
        lines.append(f"the motion ends at frame {last}, after the end of the scene at {scene.frame_end}")
    if edit.agreed not in ("", digest):
        lines.append("changed since Avoid Collisions: press it again")
    return "\n".join(lines)


def _report_lost_touches(scene: bpy.types.Scene, body: bpy.types.Object, original: Motion, edited: Motion,
                         first: int) -> tuple[str, ...]:
    """Report where a body no longer meets its player's ball, which stays in its place.

    Args:
        scene: of the players.
        body: the edited armature.
        original, edited: its motion before and after, both from the scene frame `first` on.
    """
    players = scene.beyond_mocap.players
    player = next((one for one in players if body in (one.body, one.character_body, one.rig)), None)
    stored = session.find_take(player.take) if player is not None else None
    if stored is None or not len(touches := list_touch_times(stored.take)):
        return ()
    frames = build_scene_clock(scene).to_frame(touches) - first
    frames = frames[(frames > -0.5) & (frames < len(original) - 0.5)]  # others were cut off before
    lost = frames[(_measure_offset(original, edited, frames) > _AT_BALL) | (frames > len(edited) - 0.5)]
    if not len(lost):
        return ()
    count = f"{len(lost)} of {format_count(len(frames), 'touch', 'touches')}"
    return (f"the body no longer meets the ball at {count}, first at frame {first + lost[0]:.0f}; the ball stays where "
            "it is: bend the path after the touches, or press Revert and edit the player's track",)


def _measure_offset(original: Motion, edited: Motion, frames: np.ndarray) -> np.ndarray:
    """Measure the mean distance (N,) m of the joints of two motions at fractional frames (N,)."""
    before, after = (compute_pose(motion.skeleton, *sample_frames(motion, frames))[0] for motion in (original, edited))
    return np.linalg.norm(after - before, axis=-1).mean(axis=-1)


def _check_length(known, path, settings) -> None:
    """Raise InputError if a cycled motion would become too long."""
    if not settings.cycle or known.arc.length <= 0.0:
        return
    metres, motion = np.linalg.norm(np.diff(_sample_line(path), axis=0), axis=1).sum(), known.motion
    frames = len(motion) * metres / known.arc.length / settings.speed
    if frames > MOST_FRAMES:
        found = f"the motion takes {frames / motion.fps / 60.0:.0f} minutes on a path of {metres:.0f} m"
        raise InputError("cycle", found, f"{MOST_FRAMES / motion.fps / 60.0:.0f} minutes or less",
                         "shorten the path, or switch Cycle off")


def start_path_edit(
    context: bpy.types.Context, body: bpy.types.Object, drawn: bpy.types.Object | None = None, count: int = 0,
    kind: str = "BEZIER", degree: int = 3, straight: bool = False,
) -> bpy.types.Object:
    """Start a path edit: on a given curve, or on a new one along the armature's own path; its action is stored.

    Args:
        context: for scene and view layer.
        body: the armature.
        drawn: a curve object; None to create one.
        count, kind, degree, straight: of a new curve, see `curve.create_curve`.
    Returns:
        The curve object.
    Raises:
        InputError: if the armature cannot be edited; nothing is changed.
    """
    from ...beyond_mocap.path_editing.path_edit_settings import PathEditSettings

    scene, edit, carrier = context.scene, body.beyond_mocap_ride, choose_adapter(body)
    if edit.on:
        raise InputError(f"armature {body.name}", "already follows a path", "an armature without a path edit",
                         "edit its curve, or press Revert")
    carrier.check()
    context.view_layer.update()
    invalidate_sources()
    known = read_source(carrier, scene, PathEditSettings(**collect_options(edit))).core
    before = edit.curve
    if drawn is None and not (straight or count) and before is not None and before.name in scene.objects:
        drawn = before
    created = None
    if drawn is None:
        created = drawn = curve.create_curve(context, f"{body.name} path", *_choose_own_path(known, straight), count,
                                             kind, degree)
    else:
        curve.read_curve(scene, drawn).to_path()
    carrier.start_edit()
    edit.on, edit.curve = True, drawn
    try:
        update_motion(scene, body)
    except BeyondMocapError:
        undo_start(body, before, created)
        raise
    return drawn


def undo_start(body: bpy.types.Object, before: bpy.types.Object | None, created: bpy.types.Object | None) -> None:
    """Undo `start_path_edit`: restore the previous curve and remove the one created for the edit."""
    revert_path_edit(body)
    body.beyond_mocap_ride.curve = before
    if created is not None:
        bpy.data.curves.remove(created.data)


def change_curve(scene: bpy.types.Scene, body: bpy.types.Object, drawn: bpy.types.Object) -> None:
    """Let an edited armature follow another curve. Raises InputError, and changes nothing, where it cannot."""
    edit = body.beyond_mocap_ride
    before, edit.curve = edit.curve, drawn
    try:
        update_motion(scene, body)
    except BeyondMocapError:
        edit.curve = before
        raise


def create_new_curve(
    context: bpy.types.Context, body: bpy.types.Object, shape: str = "FITTED", count: int = 0, kind: str = "BEZIER",
    degree: int = 3,
) -> bpy.types.Object:
    """Create another curve for an edited armature and let it follow that.

    The previous curve is removed if the extension created it and no other armature follows it.

    Args:
        context: for scene and view layer.
        body: the edited armature.
        shape: one of `settings.SHAPES`.
        count, kind, degree: of the new curve, see `curve.create_curve`.
    Returns:
        The new curve object.
    Raises:
        InputError: if the motion cannot follow it; nothing is changed.
    """
    from ...beyond_mocap.path_editing.path_edit_settings import PathEditSettings

    scene, edit = context.scene, body.beyond_mocap_ride
    before = edit.curve
    if shape == "PRESENT":
        path, straight = curve.read_curve(scene, before).to_path(), False
    else:
        settings = PathEditSettings(**collect_options(edit))
        path, straight = _choose_own_path(read_source(choose_adapter(body), scene, settings).core, shape == "STRAIGHT")
    created = curve.create_curve(context, f"{body.name} path", path, straight=straight, count=count, kind=kind,
                                 degree=degree)
    try:
        change_curve(scene, body, created)
    except BeyondMocapError:
        bpy.data.curves.remove(created.data)
        raise
    is_used = any(other.beyond_mocap_ride.curve == before for other in list_edited_bodies(scene))
    if before is not None and before.get(curve.MARK) and not is_used:
        name = before.name
        curve.remove_curve(before)
        created.name = created.data.name = name
    return created


def apply_path_edit(scene: bpy.types.Scene, body: bpy.types.Object) -> tuple[bpy.types.Action, str]:
    """Apply a path edit: the edited motion becomes an ordinary action; the original action stays in the file.

    If the motion cannot be updated, its last state is applied.

    Returns:
        The action, and why it is not up to date ("" if it is).
    """
    edit, carrier, reason = body.beyond_mocap_ride, choose_adapter(body), ""
    check_can_apply(body)
    try:
        update_motion(scene, body)
    except BeyondMocapError as error:
        reason = str(error)
    action = carrier.find_edit_action()[0]
    original, drawn = edit.before.action, edit.curve
    carrier.detach_action()
    restore_nla(edit.before, body.animation_data)
    discard_saved_state(edit.before, MARK)
    del action[MARK]
    name = original.name if original is not None else body.name
    action.name = f"{name} on {drawn.name}" if drawn is not None else f"{name} path motion"
    _end_edit(edit)
    return action, reason


def check_can_revert(body: bpy.types.Object) -> None:
    """Raise InputError if an armature's original motion cannot be restored here."""
    channels.check_local(body)
    channels.check_editable(body)


def check_can_apply(body: bpy.types.Object) -> None:
    """Raise InputError if an armature's edited motion cannot be applied here."""
    check_can_revert(body)
    choose_adapter(body).find_edit_action()


def revert_path_edit(body: bpy.types.Object) -> None:
    """Revert a path edit: the armature plays its original motion again, bit for bit."""
    choose_adapter(body).revert_edit()
    _end_edit(body.beyond_mocap_ride)


def revert_path_edits(*bodies: bpy.types.Object | None) -> list[str]:
    """Revert the path edits among these armatures before another edit of them; returns a message for each."""
    edited = [body for body in bodies if body is not None and body.beyond_mocap_ride.on]
    for body in edited:
        check_can_revert(body)
    for body in edited:
        revert_path_edit(body)
    return [f"{body.name}: path edit reverted; its curve stays, press Edit Path to use it again" for body in edited]


def select_again(context: bpy.types.Context, bodies: list[bpy.types.Object]) -> None:
    """Select the armatures again if an active curve is no longer the path of any armature."""
    active = context.view_layer.objects.active
    if context.mode != "OBJECT" or active is None or active.type != "CURVE":
        return
    if any(body.beyond_mocap_ride.curve == active for body in list_edited_bodies(context.scene)):
        return
    select_object(context, bodies[0])
    for body in bodies:
        if body.name in context.view_layer.objects:
            body.select_set(True)


def _choose_own_path(known, straight: bool):
    """Choose the path of a new curve, and whether it is straight: two metres straight ahead for a motion in place."""
    from ...beyond_mocap.motion.path.path import SplinePath
    from ...beyond_mocap.path_editing.path_line import SHORTEST

    if known.arc.length >= 2.0 * SHORTEST:
        return known.path, straight
    start, yaw = known.moving.origin[0], known.moving.heading[0]
    ends = np.array([start, start + 2.0 * np.array([np.cos(yaw), np.sin(yaw), 0.0])])
    return SplinePath(np.array([0.0, 0.0, 1.0, 1.0]), ends, 1), True


def _summarize_figures(known, edited) -> dict:
    """Summarize a result for the panel, in metres and seconds."""
    motion = edited.motion
    return {"seconds": round(motion.duration, 3), "source_seconds": round(known.motion.duration, 3),
            "metres": round(float(edited.arc[-1] - edited.arc[0]), 3),
            "source_metres": round(float(known.arc.length), 3), "seams": len(edited.transitions),
            "correction": round(float(np.percentile(edited.correction, 95)), 4),
            "miss": round(float(edited.miss.max(initial=0.0)), 4)}


def store_messages(edit, lines: str, figures: dict | None = None) -> None:
    """Store messages, such as why a motion cannot follow its path, and figures for the panel.

    Only changes are written, since each write changes the object and triggers another check.
    """
    if edit.messages != lines:
        edit.messages = lines
    text = json.dumps(figures) if figures is not None else edit.figures
    if edit.figures != text:
        edit.figures = text


def _end_edit(edit) -> None:
    """End a path edit; a curve or ground that was deleted is not kept in the file."""
    edit.on = False
    edit.messages = edit.figures = ""
    for name in ("curve", "ground"):
        thing = getattr(edit, name)
        if thing is not None and not thing.users_scene:
            setattr(edit, name, None)


def _sample_line(path) -> np.ndarray:
    return path.at(np.linspace(*path.domain, _SAMPLES))
