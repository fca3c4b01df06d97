"""A character as the body of one player: a copy of it plays what the player's own armature plays, whose mesh is hidden
meanwhile.
"""

from __future__ import annotations

import bpy
import numpy as np

from ...beyond_mocap.base.errors import BeyondMocapError, format_some
from ..core import channels, session
from ..core.measure import frames_per_second
from ..core.properties import find_active_row
from ..rigs.fit import SourceMotion, read_source
from . import copies
from .ball_touches import BallTouch, list_ball_touches
from .character_rig import CharacterRig
from .kit_materials import dress

MARK = "beyond_mocap_character_keys"
"""Custom property of the action of a character's copy."""


def update_character(player, context: bpy.types.Context) -> None:
    """Let the chosen character play the player's motion, or the built-in body where none is chosen.

    What is wrong with a character is noted on the player (`character_note`), who then has the built-in body.

    Args:
        player: the player's settings.
        context: of Blender.
    """
    player.character_note = ""
    if player.character_body is not None and copies.find_original(player.character_body) != player.character:
        remove_character(player)
    if player.character is None or player.body is None or context.scene.objects.get(player.body.name) is None:
        remove_character(player)
        return
    try:
        player.character_note = "\n".join(show_character(context, player))
    except BeyondMocapError as error:
        remove_character(player)
        player.character_note = str(error)


def show_character(context: bpy.types.Context, player) -> list[str]:
    """Show a player's character with the motion of their armature.

    Args:
        context: of Blender.
        player: the player's settings, with a character and a body.
    Returns:
        Messages for the user.
    Raises:
        InputError: if the character cannot be a body.
    """
    copies.check_character(player.character)
    source, touches = read_player_motion(context.scene, player)
    if player.character_body is not None and context.scene.objects.get(player.character_body.name) is None:
        remove_character(player)  # the user has deleted its copy in a view
    body, is_new = player.character_body, player.character_body is None
    if is_new:
        home = player.body.users_collection[0]
        body = copies.create_copy(player.character, f"{player.name} {player.character.name}", home)[0]
    played = channels.find_playing_action(body)
    try:
        copies.reset_pose(body)
        context.view_layer.update()
        rig = CharacterRig(body, copies.list_meshes(body), context.scene)
        frames, curves, _ = rig.build_keys(source, touches)
    except BeyondMocapError:
        if is_new:
            copies.remove_copy(body)
        elif played[0] is not None:
            channels.assign_action(body, *played)
        raise
    player.character_body = body
    channels.create_action(body, f"{player.name} character", frames, curves)[MARK] = True
    if played[0] is not None and played[0].get(MARK) and not played[0].users:
        bpy.data.actions.remove(played[0])
    dress(body, player.name, {"shirt": tuple(player.shirt)})
    _show_builtin(player, False)
    copies.update_original(player.character)
    return copies.describe_differences(player.character)


def remove_character(player) -> None:
    """Remove the copy that a player's character plays on, and show the built-in body again."""
    if player.character_body is not None:
        body, player.character_body = player.character_body, None
        copies.remove_copy(body)
    _show_builtin(player, True)


def find_shown_body(player) -> bpy.types.Object | None:
    """Find the armature that shows a player's motion: their rig, their character, or the built-in body."""
    return player.rig or player.character_body or player.body


def describe_left_out(settings, exported: list[bpy.types.Object]) -> str:
    """Describe which selected players an export of others leaves out, to be put behind its message; "" for none.

    Args:
        settings: of the scene.
        exported: the armatures that are exported.
    """
    found = {*exported}
    if settings.rig.target in found:
        active = find_active_row(settings.players, settings.active_player)
        found.add(settings.rig.source or (active.body if active is not None else None))
    bodies = {player.name: {player.rig, player.character_body, player.body} - {None}
              for player in settings.players if player.use and player.body is not None}
    names = [name for name, theirs in bodies.items() if theirs.isdisjoint(found)]
    return f"; without {format_some(names)}" if 0 < len(names) < len(bodies) else ""


def update_kit(player) -> None:
    """Give the shirt of a player's character the player's colour."""
    if player.character_body is not None:
        dress(player.character_body, player.name, {"shirt": tuple(player.shirt)})


def read_player_motion(scene: bpy.types.Scene, player) -> tuple[SourceMotion, tuple[BallTouch, ...]]:
    """Read what a player's armature plays, with foot contacts and touches of the ball as the take has them.

    Raises:
        InputError: if it plays nothing.
    """
    source = read_source(player.body, scene)
    stored = session.find_take(player.take) if player.take else None
    if stored is None or player.body.beyond_mocap_ride.on:
        return source, ()
    settings, frames = scene.beyond_mocap, source.start + np.arange(len(source.motion))
    seconds = settings.start_time + (frames - settings.start_frame) / frames_per_second(scene)
    return source, list_ball_touches(stored.take, source.motion, seconds)


def _show_builtin(player, is_shown: bool) -> None:
    """Show or hide the meshes of the built-in body."""
    for mesh in [one for one in player.body.children if one.type == "MESH"] if player.body is not None else ():
        mesh.hide_viewport = mesh.hide_render = not is_shown
