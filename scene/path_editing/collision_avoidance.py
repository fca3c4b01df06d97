"""Collision avoidance of edited bodies: who comes too near each other, or another body, and what they change.

Changes are part of a path edit's settings: seconds added to its delay, and detours of its path. They are computed each
time from the curves as drawn and the delays that the user chose. Edited bodies also avoid bystanders: bodies of the
scene without a path, such as those of applied edits and of players.
"""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import dataclass, replace
from time import perf_counter

import bpy
import numpy as np

from ...beyond_mocap.base.errors import BeyondMocapError, InputError
from ..core import channels
from ..core.measure import frames_per_second, units_per_metre
from ..rigs.bone_curves import is_carried
from . import curve, edited_bodies, rig_parts
from . import rig_sampling as rig_look
from .armature_adapter import MARK, invalidate_sources, read_source
from .rig_source import PlayedAnimation, list_playing_strips
from .rigs import choose_adapter, is_edited_as_rig
from .settings import collect_options, list_edited_bodies

_ROUNDS = 2  # the second with a larger distance, for what the search does not compute exactly

HIPS = 0.9  # metres of hips above the ground, about: only decides whether bodies are on the same floor
_A_SECOND = 5  # samples of a rig in a second
_PATIENCE = 4.0  # seconds for all bystanders


@dataclass(frozen=True, eq=False)
class EditTrial:
    """What is needed to compute a body with another delay and other detours; no Blender data.

    Attributes:
        name: of the body.
        first: scene frame of the first frame.
        source: `PathEditSource` of the core.
        path: the new path.
        settings: `PathEditSettings` of the core.
        ground: the terrain, or None.
    """

    name: str
    first: int
    source: object
    path: object
    settings: object
    ground: object

    def build_follower(self, change, may_change: bool = True):
        """Compute the body with a `PathChange` as a follower of the core; its feet are not planted."""
        from ...beyond_mocap.path_editing.detour import Follower
        from ...beyond_mocap.path_editing.path_edit import edit_path

        settings = replace(self.settings, delay=self.settings.delay + change.delay, detours=change.detours, plant=False)
        edited = edit_path(self.source, self.path, settings, self.ground)
        times = (self.first + np.arange(len(edited.motion))) / edited.motion.fps
        places = np.column_stack([edited.motion.root_positions[:, :2], edited.origin[:, 2]])
        if not may_change:
            return Follower(name=self.name, times=times, places=places)
        return Follower(name=self.name, times=times, places=places, path=self.path, arc=edited.arc,
                        by_arc=self.settings.by_arc_length)


@dataclass(frozen=True)
class AvoidanceResult:
    """The result of collision avoidance.

    Attributes:
        bodies: names of the edited bodies, in the order of changes.
        before: number of initial collisions.
        changes: one `PathChange` a body.
        unresolved: messages about collisions that remain, and about bodies that are left out.
    """

    bodies: tuple[str, ...]
    before: int
    changes: tuple
    unresolved: tuple[str, ...]


def compute_changes(context: bpy.types.Context, bodies: list[bpy.types.Object], limits) -> AvoidanceResult:
    """Compute the changes that keep edited bodies apart; the scene stays as it is.

    All other edited bodies keep their motion, and so do bystanders.

    Args:
        context: for scene and view layer.
        bodies: the edited bodies that can yield.
        limits: `Limits` of the core.
    Returns:
        The changes and messages.
    Raises:
        InputError: if a body cannot follow its path.
    """
    from ...beyond_mocap.path_editing.collision_avoidance import resolve_collisions
    from ...beyond_mocap.path_editing.detour import PathChange

    scene = context.scene
    context.view_layer.update()
    invalidate_sources()
    trials = [_build_trial(scene, body) for body in bodies]
    bystander_followers, unread = compute_bystanders(context)
    fixed = _compute_other_bodies(scene, bodies) + bystander_followers
    bare, changes, found = [trial.build_follower(PathChange()) for trial in trials], (PathChange(),) * len(trials), None
    wider, before = limits, 0
    for attempt in range(_ROUNDS):
        found = resolve_collisions([*bare, *fixed], wider)
        changes = tuple(_round_to_frames(change, trial) for change, trial in zip(found.changes, trials))
        before = len(found.before) if attempt == 0 else before
        remaining = _find_collisions([trial.build_follower(change, False) for trial, change in zip(trials, changes)]
                                     + fixed, limits)
        remaining = [hit for hit in remaining if hit.first < len(trials)]
        unsolved = {(hit.first, hit.second) for hit in found.unresolved}
        short = [limits.distance - hit.gap for hit in remaining if (hit.first, hit.second) not in unsolved]
        if not short:
            break
        wider = replace(wider, distance=wider.distance + max(short) + 0.01)
    names = [follower.name for follower in (*bare, *fixed)]
    lines = tuple(_describe_collision(hit, names, frames_per_second(scene)) for hit in remaining)
    return AvoidanceResult(tuple(body.name for body in bodies), before, changes, (*lines, *unread))


def apply_changes(scene: bpy.types.Scene, bodies: list[bpy.types.Object], changes) -> None:
    """Apply changes to edited bodies and update them. Raises InputError, and restores everything, if one cannot
    follow.
    """
    from ...beyond_mocap.path_editing.detour import PathChange

    edits = [body.beyond_mocap_ride for body in bodies]
    before = [(edit.delay, edit.added, edit.detours, edit.agreed) for edit in edits]
    try:
        for edit, change in zip(edits, changes):
            edit.delay, edit.added, edit.agreed = _own_delay(edit) + change.delay, change.delay, ""
            edit.detours = json.dumps([list(detour) for detour in change.detours])
        for body in bodies:
            edited_bodies.update_motion(scene, body)
    except BeyondMocapError:
        for edit, (delay, added, detours, agreed) in zip(edits, before):
            edit.delay, edit.added, edit.detours, edit.agreed = delay, added, detours, agreed
        raise
    if any(change != PathChange() for change in changes):
        for body, edit in zip(bodies, edits):
            edit.agreed = str(choose_adapter(body).find_edit_action()[0][MARK])


def describe_result(result: AvoidanceResult) -> list[str]:
    """Describe the change of each body, and the remaining collisions."""
    return [line for line in map(_describe_change, result.bodies, result.changes) if line] + list(result.unresolved)


def _build_trial(scene, body) -> EditTrial:
    """Build the trial of a body without its previous changes."""
    from ...beyond_mocap.path_editing.path_edit_settings import PathEditSettings

    edit, carrier = body.beyond_mocap_ride, choose_adapter(body)
    carrier.check()
    settings = PathEditSettings(**{**collect_options(edit), "detours": (), "delay": round(_own_delay(edit), 6)})
    known = read_source(carrier, scene, settings)
    ground = curve.load_ground(scene, edit.ground, curve.compute_ground_digest(scene, edit.ground))
    return EditTrial(body.name, known.read.first, known.core, path=curve.read_curve(scene, edit.curve).to_path(),
                     settings=settings, ground=ground)


def _own_delay(edit) -> float:
    """Compute the delay that the user chose."""
    return max(edit.delay - edit.added, 0.0)


def _compute_other_bodies(scene, bodies) -> list:
    """Compute the other edited bodies as they are; those that cannot follow their path now are ignored."""
    from ...beyond_mocap.path_editing.detour import PathChange

    found = []
    for body in list_edited_bodies(scene):
        if body not in bodies:
            try:
                trial = _build_trial(scene, body)
            except BeyondMocapError:
                continue
            change = PathChange(body.beyond_mocap_ride.added, collect_options(body.beyond_mocap_ride)["detours"])
            found.append(trial.build_follower(change, False))
    return found


def _find_collisions(followers, limits) -> list:
    """Find the collisions of bodies as they are."""
    from ...beyond_mocap.path_editing.collisions import find_collisions

    times = np.unique(np.concatenate([follower.times for follower in followers]))
    places = np.stack([follower.at(times) for follower in followers])
    return find_collisions(times, places, limits.distance, limits.height)


def _round_to_frames(change, trial):
    """Round the wait of a change up to whole frames, as edited bodies wait."""
    fps = trial.source.motion.fps
    return replace(change, delay=float(np.ceil(round(change.delay * fps, 3)) / fps))


def _describe_change(name, change) -> str:
    parts = change.describe()
    return f"{name} {', '.join(parts)}" if parts else ""


def _describe_collision(hit, names, fps) -> str:
    frames = f"frames {round(hit.start * fps)} to {round(hit.end * fps)}"
    both = f"{names[hit.first]} and {names[hit.second]}"
    return f"{both} still come within {hit.gap:.2f} m at {hit.time:.2f} s ({frames})"


def compute_bystanders(context: bpy.types.Context, patience: float = _PATIENCE) -> tuple[list, list[str]]:
    """Compute followers of the core that cannot yield: players' bodies and other visible animated armatures.

    Args:
        context: for scene and view layer.
        patience: seconds after which bodies are left out.
    Returns:
        The followers, and a message for each body that is left out: for lack of time, or because it cannot be read.
    """
    start, found, left_out = perf_counter(), [], []
    for body in sorted(_list_bystanders(context), key=is_edited_as_rig):  # the quick ones first
        try:
            found.append(_build_follower(context.scene, body, start + patience))
        except BeyondMocapError as error:
            left_out.append(f"{body.name} is left out: {error}")
    return found, left_out


def _list_bystanders(context) -> list[bpy.types.Object]:
    scene, layer = context.scene, context.view_layer
    players = {player.body.name for player in scene.beyond_mocap.players if player.body is not None}
    found = [body for body in scene.objects if body.type == "ARMATURE" and not body.beyond_mocap_ride.on]
    return [body for body in found if (channels.find_playing_action(body)[0] is not None or list_playing_strips(body))
            and (body.name in players or body.visible_get(view_layer=layer) and not _copies_edited_body(body))]


def _copies_edited_body(body) -> bool:
    """Return whether an armature copies an edited body, as a character retargeted from it does."""
    constraints = [one for thing in (body, *body.pose.bones) for one in thing.constraints if not one.mute]
    holders = [getattr(one, "target", None) for one in constraints]
    while body.parent is not None:
        body = body.parent
        holders.append(body)
    return any(one is not None and one.type == "ARMATURE" and one.beyond_mocap_ride.on for one in holders)


def _build_follower(scene, body, until: float):
    """Compute the place of a body's hips over the ground. Raises InputError after the time `until`."""
    from ...beyond_mocap.path_editing.detour import Follower

    if perf_counter() > until:
        raise _build_timeout_error()
    frames = hips = None
    if not is_edited_as_rig(body):
        with suppress(BeyondMocapError):
            read = choose_adapter(body).read_motion(scene)
            frames, hips = read.first + np.arange(len(read.motion)), read.motion.root_positions
    if frames is None:
        frames, hips = _sample_hips(scene, body, until)
    if not np.isfinite(hips).all():
        raise InputError("its pose", "a place with NaN or infinite values", "finite values", "check its keys")
    return Follower(name=body.name, times=frames / frames_per_second(scene), places=hips - (0.0, 0.0, HIPS))


def _sample_hips(scene, body, until: float) -> tuple[np.ndarray, np.ndarray]:
    """Sample some frames (F,) and the hips on them (F, 3), metres; the middle of all bones without hips."""
    frames = _choose_frames(scene, body)
    parts = rig_parts.identify_parts(body)
    names = [parts.visible_bones["hips"]] if parts else [bone.name for bone in body.data.bones]
    rows = []
    with rig_look.create_private_scene(body, scene) as side:
        for frame in frames:
            if perf_counter() > until:
                raise _build_timeout_error()
            side.frame_set(int(frame))
            evaluated = body.evaluated_get(side.view_layers[0].depsgraph)
            middle = np.mean([evaluated.pose.bones[name].head[:] for name in names], axis=0)
            rows.append(np.array(evaluated.matrix_world) @ [*middle, 1.0])
    return frames, np.array(rows)[:, :3] / units_per_metre(scene)


def _choose_frames(scene, body) -> np.ndarray:
    """Choose whole frames from the first to the last of a motion, about `_A_SECOND` in a second."""
    try:
        played = PlayedAnimation(body, scene).frames
        first, last = int(played[0]), int(played[-1])
    except BeyondMocapError:  # a pose alone
        first = last = scene.frame_start
    if is_carried(body):
        first, last = min(first, scene.frame_start), max(last, scene.frame_end)
    step = max(int(frames_per_second(scene) / _A_SECOND), 1)
    return np.unique([*range(first, last, step), last, last + (first == last)])


def _build_timeout_error() -> InputError:
    found, expected = "takes too long to sample", "a faster rig"
    return InputError("its rig", found, expected, "hide bodies that are not needed, or bake its motion")
