"""Previews of takes on their players, to apply or revert: the previous state is stored and restored exactly.

Of several takes (variants, named on the player) one is shown. The ball and the stage's camera belong to all players:
they follow the takes that are shown.
"""

from __future__ import annotations

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.base.fixes import Fix
from ..characters.player_character import update_character
from ..core import channels, session
from ..core.measure import build_scene_clock
from ..core.names import find_named
from ..core.saved_state import discard_saved_state, restore_nla, restore_playback, save_playback
from ..core.settings import BeyondMocapPlayer
from ..passes import possession
from ..path_editing import edited_bodies
from ..player import dots
from ..stage import cameras
from ..stage.stage_collection import find_focus
from . import bake, ball_tracks, blocks, key_layers, quality
from . import manual_keys as hand_keys
from .bake import MARK

STEPS = ("recipe", "made_of")
LINES = ("take", "quality", "moments", "warnings")

VARIANT_LINES = ("quality", "moments", "warnings", "recipe")


def check_body(player: BeyondMocapPlayer) -> None:
    """Raise InputError if the player's body cannot be animated here."""
    body = player.body
    if body is None:
        return
    channels.check_local(body)
    override = body.override_library
    if override is not None and override.is_system_override:
        raise InputError(f"body {body.name}", "is an override that cannot be edited", "an editable override",
                         "make it editable: Outliner, Library Override, Make")
    channels.check_editable(body)


def revert_path_edit(player: BeyondMocapPlayer) -> list[str]:
    """Revert the path edit of a player's body before its result changes; returns messages."""
    return edited_bodies.revert_path_edits(player.body)


def show_preview(context: bpy.types.Context, player: BeyondMocapPlayer, take: str,
                 lines: dict[str, str]) -> bpy.types.Object:
    """Preview a take of the session on the player's armature, created if missing; the previous state is stored.

    Args:
        context: for the scene.
        player: the player.
        take: name of the take.
        lines: `quality`, `moments`, `warnings`, `recipe` and `made_of` of the take.
    Returns:
        The armature.
    """
    result_take, result = session.find_take(take), player.result
    check_body(player)
    reverted = revert_path_edit(player)
    key_layers.unstack_layers(player.body, uses_nla=result.state != "PREVIEW")
    if result.state != "NONE" and not is_shown(context.scene, player):
        drop_preview(player)
    recorded_keys, clock = hand_keys.ManualKeys(), ""
    if context.scene.beyond_mocap.keep_hand_keys and player.body is not None and result.state != "NONE":
        recorded_keys, clock = hand_keys.find_in_body(player.body)
    if result.state != "PREVIEW":
        _store_state(context, player, result_take)
    player.take = take
    for name, text in lines.items():
        setattr(result if name in STEPS else player, name, text)
    if reverted:
        player.warnings = "\n".join(filter(None, [player.warnings, *reverted]))
    with _SharedLength(context.scene):
        body = bake.write_take(context, player, result_take)
    action, slot = channels.find_playing_action(body)
    blocks.store_blocks(action, result_take.take, context.scene)
    bake.store_record(action, result_take.take, context.scene)
    hand_keys.store_generated(action, slot, build_scene_clock(context.scene))
    shift = hand_keys.compute_shift(clock, build_scene_clock(context.scene))
    result.hand_keys = hand_keys.write_manual_keys(action, slot, recorded_keys, shift) if shift is not None else 0
    result.state = "PREVIEW"
    key_layers.stack_layers(body)
    quality.update_error_curves(context.scene, player)
    update_shared(context)
    update_character(player, context)
    return body


def apply_preview(context: bpy.types.Context, player: BeyondMocapPlayer, form: str) -> bpy.types.Object:
    """Apply the preview of a player as one action ("ACTION") or as NLA strips ("STRIPS").

    What had been stored for it and belongs to the extension is removed. Returns the armature.
    """
    result, body = player.result, player.body
    revert_path_edit(player)
    key_layers.unstack_layers(body)
    if result.motion.kept and body.animation_data is not None:
        restore_nla(result.motion, body.animation_data)
    if form == "STRIPS":
        blocks.convert_to_strips(body)
    else:
        blocks.convert_to_action(body)
    _clear_state(player)
    result.state = "ACCEPTED"
    _apply_shared(context)
    _rename_datablocks(context, player)
    key_layers.stack_layers(body)
    return body


def revert_preview(context: bpy.types.Context, player: BeyondMocapPlayer) -> None:
    """Revert the preview of a player: the previous state is restored, bit for bit."""
    result, body = player.result, player.body
    revert_path_edit(player)
    key_layers.unstack_layers(body, uses_nla=False)
    accepted = result.was_accepted
    if body is not None and body == result.body and result.motion.kept:
        _remove_preview_objects(context, player)
        restore_playback(result.motion, body, MARK)
        key_layers.stack_layers(body)
    else:
        _remove_preview_objects(context, player)
        if body is not None:
            quality.remove_error_curves(body)
            _remove_armature(body)
        player.body = result.body
    for name in LINES:
        setattr(player, name, getattr(result, name))
    for name in STEPS:
        setattr(result, name, getattr(result, f"{name}_before"))
    _clear_state(player)
    result.state = "ACCEPTED" if accepted else "NONE"
    quality.update_error_curves(context.scene, player)
    update_shared(context)
    update_character(player, context)


def is_shown(scene: bpy.types.Scene, player: BeyondMocapPlayer) -> bool:
    """Return whether the player's result is on a body in the scene."""
    there = player.body is not None and player.body.name in scene.objects
    return there and player.result.state != "NONE"


def drop_preview(player: BeyondMocapPlayer) -> None:
    """Drop a preview whose body was deleted."""
    _clear_state(player)
    player.result.state = "NONE"


def update_shared(context: bpy.types.Context) -> None:
    """Let ball and camera follow the takes that are shown; after the last preview they return to their previous
    state.
    """
    _with_free_ball(context, _update_shared_objects)
    ball_tracks.post_difference(context.scene)
    players = context.scene.beyond_mocap.players
    dots.update_displays(context.scene, [player for player in players if is_shown(context.scene, player)])


class _SharedLength:
    """Records, for the length of a `with`, by how much a preview extends the scene."""

    def __init__(self, scene: bpy.types.Scene):
        self.scene, self.shared, self.before = scene, scene.beyond_mocap.shared, scene.frame_end

    def __enter__(self):
        return self

    def __exit__(self, *error):
        if self.scene.frame_end == self.before:
            return
        if not self.shared.end_set:
            self.shared.end_before = self.before
        self.shared.end_set = self.scene.frame_end


def store_variants(player: BeyondMocapPlayer, found: list[tuple[str, dict[str, str], dict]]) -> None:
    """Store the takes of (name, lines, report) as variants of the player, if there are several, in place of previous
    ones.
    """
    variants = player.result.variants
    variants.clear()
    if len(found) < 2:
        return
    first = session.find_take(found[0][0]).take
    for name, lines, report in found:
        variant = variants.add()
        variant.name = name
        for line in VARIANT_LINES:
            setattr(variant, line, lines[line])
        variant.summary = _describe_take(report, _compute_difference(first, session.find_take(name).take))


def show_variant(context: bpy.types.Context, player: BeyondMocapPlayer, number: int) -> None:
    """Preview variant `number`, from 0. Raises InputError if the session does not have it."""
    variants = player.result.variants
    if not 0 <= number < len(variants):
        raise InputError("variant", f"number {number + 1}", f"1 to {len(variants)}", "press Variants first",
                         fixes=(Fix("press", "beyond_mocap.variants"),))
    variant = variants[number]
    if session.find_take(variant.name) is None:
        found = "is not in this session: it is from before the file was opened"
        raise InputError("variant", found, "variants of this session", "press Variants again",
                         fixes=(Fix("press", "beyond_mocap.variants"),))
    show_preview(context, player, variant.name, {line: getattr(variant, line) for line in VARIANT_LINES})


def _apply_shared(context: bpy.types.Context) -> None:
    _with_free_ball(context, _apply_shared_objects)


def _with_free_ball(context: bpy.types.Context, change) -> None:
    """Call `change(context)` while no player holds the ball; possession is restored afterwards."""
    room = find_named(context.scene.collection.children, bake.COLLECTION)
    ball = find_named(room.objects, bake.BALL) if room is not None else None
    if ball is None or not len(ball.beyond_mocap_ball.holds):
        return change(context)
    possession.replace_own_action(context.scene, ball, lambda: change(context))


def _apply_shared_objects(context: bpy.types.Context) -> None:
    """Let ball and camera stay with applied results: that is the state to which other previews revert."""
    shared, players = context.scene.beyond_mocap.shared, context.scene.beyond_mocap.players
    has_other_previews, takes = any(player.result.state == "PREVIEW" for player in players), _list_takes(players,
            "ACCEPTED")
    if not has_other_previews or bake.find_ball(takes, context.scene.beyond_mocap) is not None:
        discard_saved_state(shared.ball, MARK)
    discard_saved_state(shared.camera, cameras.MARK)
    shared.end_set = 0
    if has_other_previews:
        _update_followers(context, takes)
        update_shared(context)


def _rename_datablocks(context: bpy.types.Context, player: BeyondMocapPlayer) -> None:
    """Give applied datablocks their plain names, now that their previous owners are gone."""
    playing = channels.find_playing_action(player.body)[0]
    if playing is not None and playing.get(MARK) and playing.library is None:
        playing.name = f"{player.name} take"
    room = bake.find_or_create_collection(context.scene)
    ribbon, ball = find_named(room.objects, bake.build_track_name(player)), find_named(room.objects, bake.BALL)
    if ribbon is not None:
        ribbon.data.name = bake.build_track_name(player)
    path = channels.find_playing_action(ball)[0] if ball is not None else None
    if path is not None and path.get(MARK):
        path.name = f"{bake.BALL} path"


def _update_shared_objects(context: bpy.types.Context) -> None:
    """Let ball and camera follow the previews, and store their previous state; without previews restore it."""
    scene, settings = context.scene, context.scene.beyond_mocap
    shared = settings.shared
    takes = _list_takes(settings.players, "ACCEPTED", "PREVIEW")
    previews = any(player.result.state == "PREVIEW" for player in settings.players)
    room = find_named(scene.collection.children, bake.COLLECTION)
    ball = find_named(room.objects, bake.BALL) if room is not None else None
    if not previews:
        _restore_shared(scene, shared, ball)
        return
    is_new, wanted = ball is None, bake.find_ball(takes, settings) is not None
    if wanted and not is_new and not shared.ball.kept:
        save_playback(shared.ball, ball)
    _update_followers(context, takes)
    if wanted and is_new:
        shared.ball.kept = shared.ball.made = True


def _list_takes(players, *states: str) -> list:
    """List the takes of players whose result is in one of these states, as far as the session has them."""
    found = [session.find_take(player.take) for player in players if player.result.state in states]
    return [session_take.take for session_take in found if session_take is not None]


def _update_followers(context: bpy.types.Context, takes: list) -> None:
    """Let ball and camera follow these takes."""
    path = bake.find_ball(takes, context.scene.beyond_mocap)
    if path is not None:
        bake.write_ball(context, path)
    cameras.update_cameras(context.scene)


def _restore_shared(scene: bpy.types.Scene, shared, ball) -> None:
    """Restore ball and scene length to their state before any preview; the cameras follow the bodies that are left."""
    if shared.ball.kept and ball is not None:
        if shared.ball.made:
            _remove_object(ball)
        else:
            restore_playback(shared.ball, ball, MARK)
    focus = find_focus(scene)
    if shared.camera.kept and focus is not None:  # by version 0.1
        restore_playback(shared.camera, focus, cameras.MARK)
    discard_saved_state(shared.ball, MARK)
    discard_saved_state(shared.camera, cameras.MARK)
    if shared.end_set and scene.frame_end == shared.end_set:
        scene.frame_end = shared.end_before
    shared.end_set = 0
    cameras.update_cameras(scene)


def _store_state(context: bpy.types.Context, player: BeyondMocapPlayer, new_take: session.StoredTake) -> None:
    """Store what a preview replaces, and the body's motion."""
    result, body, room = player.result, player.body, bake.find_or_create_collection(context.scene)
    result.was_accepted = result.state == "ACCEPTED"
    result.body = body
    for name in LINES:
        setattr(result, name, getattr(player, name))
    for name in STEPS:
        setattr(result, f"{name}_before", getattr(result, name))
    fits = body is not None and bake.is_matching(body, new_take.take, context.scene)
    result.mesh_made = not fits or not any(child.type == "MESH" for child in body.children)
    ribbon = find_named(room.objects, bake.build_track_name(player))
    result.track_made = ribbon is None
    result.track = ribbon.data if ribbon is not None and ribbon.type == "CURVE" else None
    if fits:
        save_playback(result.motion, body)


def _clear_state(player: BeyondMocapPlayer) -> None:
    """Clear the stored previous state; datablocks of the extension that nothing else uses are removed."""
    result = player.result
    discard_saved_state(result.motion, MARK)
    track, result.track = result.track, None
    if track is not None and not track.users:
        bpy.data.curves.remove(track)
    result.variants.clear()
    for name in ("body", "mesh_made", "track_made", "was_accepted", *LINES, *(f"{name}_before" for name in STEPS)):
        result.property_unset(name)


def _remove_preview_objects(context: bpy.types.Context, player: BeyondMocapPlayer) -> None:
    """Remove the mesh and the track that a preview created, or restore the previous track."""
    result, body = player.result, player.body
    room = bake.find_or_create_collection(context.scene)
    if result.mesh_made and body is not None:
        for child in [child for child in body.children if child.get(MARK)]:
            _remove_object(child)
    ribbon = find_named(room.objects, bake.build_track_name(player))
    if ribbon is None:
        return
    if result.track_made:
        _remove_object(ribbon)
    elif result.track is not None and ribbon.data != result.track:
        made, ribbon.data = ribbon.data, result.track
        _remove_data(made)


def _remove_armature(body: bpy.types.Object) -> None:
    """Remove an armature that a preview created, with its action, unless it has children or belongs to another file."""
    if body.library is not None:
        return
    channels.remove_marked_action(body, MARK)
    if not body.children and body.get(MARK):
        _remove_object(body)


def _remove_object(thing: bpy.types.Object) -> None:
    """Remove an object of the extension, with its data and materials if nothing else uses them."""
    data = thing.data
    channels.remove_marked_action(thing, MARK)
    bpy.data.objects.remove(thing)
    _remove_data(data)


def _remove_data(data) -> None:
    if data.users:
        return
    materials = {material for material in getattr(data, "materials", ()) if material is not None}
    bpy.data.batch_remove([data])
    unworn = [material for material in materials if not material.users and material.get(MARK)]
    if unworn:
        bpy.data.batch_remove(unworn)


def _describe_take(report: dict, difference: float) -> str:
    """Describe a take's main figures."""
    root, slide = report["root_error_m"]["mean"], report["skate"]["contact_cm_s"]
    text = f"slide {slide:.1f} cm/s" if slide is not None else f"track {100 * root:.1f} cm"
    jerk = report.get("seam_jerk_ratio", {}).get("median")
    text += f", cuts {jerk:.2f}" if jerk is not None else ""
    return f"{text}, {difference:.0%} different" if difference else text


def _compute_difference(first, other) -> float:
    """Compute the share of frames in which two takes of one plan show different source frames."""
    same_clip = np.array(first.clips)[first.clip] == np.array(other.clips)[other.clip]
    same = same_clip & (first.mirrored == other.mirrored) & (np.abs(first.clip_frame - other.clip_frame) < 3.0)
    return float(1.0 - same.mean())
