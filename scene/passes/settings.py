"""Properties of the panel "Ball & Passes" and its operators. They are saved with the file and covered by undo."""

import json
from collections.abc import Callable

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ...beyond_mocap.base import digest
from ..core import live
from ..core.properties import find_active_row, with_settings
from ..result.result import BeyondMocapBefore

pictures: dict = {}
"""Painted pictures of hit analyses: a preview collection under "graphs" if there are any."""

SAMPLES = (("three", "Three", "Three players, a triangle of passes"), ("six", "Six", "Six players, two teams of three"),
           ("volley_net", "Foot Volleyball", "Four players over a net"),
           ("racquet", "Racquet", "Two players with racquets"),
           ("dropped", "Dropped Ball", "Three players, one of whom drops the ball"))
PLAYED = "live"  # `made_of` of a scene that was played live: edits of the lists do not update it
KEPT = "beyond_mocap_scene_ball"  # custom property of objects and actions created here; no property group has this name


def mark_edited(_settings, _context) -> None:
    """Report a change that the shown scene may have to follow."""
    live.mark_watcher("Passing scene")


rename_calls: list[Callable[[bpy.types.Scene, str, str], None]] = []
"""Called with a scene and the old and the new name of one of its players, by whom else stores players by name."""


def update_name(player, context) -> None:
    """Write a player's new name wherever it is stored; a name that another player has is refused."""
    if player.known and any(
        row != player and row.name == player.name for row in player.id_data.beyond_mocap_passes.players
    ):
        player.name = player.known
        return
    if player.known and player.known != player.name:
        settings = player.id_data.beyond_mocap_passes
        for one in settings.passes:
            one.who = player.name if one.who == player.known else one.who
            one.to = player.name if one.to == player.known else one.to
        settings.serve = player.name if settings.serve == player.known else settings.serve
        for call in rename_calls:
            call(player.id_data, player.known, player.name)
    player.known = player.name
    mark_edited(player, context)


def store_actor_name(one, context) -> None:
    """Store the name of the armature that shows a strike, for when it has been deleted."""
    one.actor_known = one.actor.name if one.actor is not None else ""


@with_settings("passes.player", update=mark_edited)
class BeyondMocapPasser(bpy.types.PropertyGroup):
    """One player of a passing scene."""

    name: StringProperty(name="Name", description="What this player is called", update=update_name)
    known: StringProperty(name="Known As", options={"HIDDEN"}, description="The name that the passes use")
    place: PointerProperty(
        name="Place", type=bpy.types.Object, update=mark_edited,
        description="Object that marks where the player stands and, by its local X, which way they face; move it "
        "with G, rotate it with R",
    )
    body: PointerProperty(name="Body", type=bpy.types.Object, poll=lambda _own, thing: thing.type == "ARMATURE",
                          description="Armature that shows the player's motion; created if empty")
    shirt: FloatVectorProperty(name="Shirt", subtype="COLOR", size=3, min=0.0, max=1.0, default=(0.75, 0.05, 0.06),
                               description="Colour of the player's shirt")
    shown: PointerProperty(name="Shown On", type=bpy.types.Object, options={"HIDDEN"},
                           description="The armature that shows the scene now")
    before: PointerProperty(type=BeyondMocapBefore, description="What the character played before the scene")


@with_settings("passes.pass", update=mark_edited)
class BeyondMocapPass(bpy.types.PropertyGroup):
    """One pass: passer, receiver and settings. Players are stored by name, so that the list can be sorted."""

    who: StringProperty(name="From", description="Player who passes the ball", update=mark_edited)
    to: StringProperty(name="To", description="Player who receives the ball", update=mark_edited)
    at: PointerProperty(name="Meet At", type=bpy.types.Object, update=mark_edited,
                        description="Object to which the receiver goes to meet the ball; leave empty to stay in place")
    actor: PointerProperty(
        name="Like Armature", type=bpy.types.Object, poll=lambda _own, thing: thing.type == "ARMATURE",
        update=store_actor_name,
        description="Armature whose motion shows the strike; the most similar strike of the library is played, "
        "and Like Clip is ignored",
    )
    actor_known: StringProperty(
        name="Missing", update=mark_edited,
        description="The armature that showed the strike no longer exists; clear this field to go on without it",
    )


@with_settings("passes.weights", update=mark_edited)
class BeyondMocapWeights(bpy.types.PropertyGroup):
    """Weights of eq. 1 (two poses) and eq. 2 (two strikes)."""


class BeyondMocapTouch(bpy.types.PropertyGroup):
    """One touch of the ball that was solved from tracking data. Its name is the player's; empty: unknown."""

    player: StringProperty(name="Player", description="Player who touches the ball")
    time: FloatProperty(name="Time", unit="TIME_ABSOLUTE", precision=3, description="Seconds on the track's clock")
    part: StringProperty(name="Part", description="Part of the body that touches the ball")
    kind: StringProperty(name="Kind", description="Kind of touch")
    words: StringProperty(name="Labels", description="Labels of the key moment for this touch")
    confidence: FloatProperty(name="Confidence", min=0.0, max=1.0, description="Confidence of this touch, from 0 to 1")
    use: BoolProperty(name="Use", default=True, description="Make a key moment of this touch with Apply Touches")


@with_settings("ball.held")
class BeyondMocapHold(bpy.types.PropertyGroup):
    """A stretch in which a bone carries the ball. Its name is that of the ball's constraint."""

    body: PointerProperty(name="Body", type=bpy.types.Object, description="Armature that carries the ball")
    bone: StringProperty(name="Bone", description="Bone that carries the ball")
    first: IntProperty(name="First Frame", description="First frame on which the ball is carried")
    last: IntProperty(name="Last Frame", description="Frame on which the ball is released")


class BeyondMocapBall(bpy.types.PropertyGroup):
    """Stretches in which a ball is carried, and what it played before."""

    attached_to = ("Object.beyond_mocap_ball",)

    holds: CollectionProperty(type=BeyondMocapHold, description="Stretches in which an armature carries the ball")
    before: PointerProperty(type=BeyondMocapBefore, description="What the ball played before it was carried")


@with_settings("hits")
class BeyondMocapHits(bpy.types.PropertyGroup):
    """Stored hit analysis of an armature."""

    attached_to = ("Object.beyond_mocap_hits",)

    found: StringProperty(name="Found", options={"HIDDEN"}, description="Result of the hit analysis as JSON")
    lines: StringProperty(name="Lines", options={"HIDDEN"}, description="One line for each hit motion: frame and text")


@with_settings("passes", update=mark_edited)
@with_settings("ball.hold")
class BeyondMocapPasses(bpy.types.PropertyGroup):
    """A passing scene and its ball."""

    attached_to = ("Scene.beyond_mocap_passes",)

    players: CollectionProperty(type=BeyondMocapPasser, description="Players of the passing scene")
    active_player: IntProperty(name="Player", min=0, description="Player whose settings are shown below the list")
    passes: CollectionProperty(type=BeyondMocapPass, description="Passes in their order")
    active_pass: IntProperty(name="Pass", min=0, description="Pass whose settings are shown below the list")
    weights: PointerProperty(type=BeyondMocapWeights, description="Weights for comparing motions")
    library_folder: StringProperty(
        name="Library", subtype="DIR_PATH", options={"PATH_SUPPORTS_BLEND_RELATIVE"}, update=mark_edited,
        description="Folder of clips with standing strikes; leave empty for the library of step 1",
    )
    rally: PointerProperty(name="Ball Object", type=bpy.types.Object,
                           description="Ball of the scene; created if empty")
    ball_before: PointerProperty(type=BeyondMocapBefore, description="What the ball played before the scene was made")
    made_of: StringProperty(name="Made Of", options={"HIDDEN"},
                            description="Digest of the settings of the shown scene")
    messages: StringProperty(name="Messages", options={"HIDDEN"}, description="Warnings and messages about the scene")
    figures: StringProperty(name="Figures", options={"HIDDEN"}, description="Figures of the shown scene")
    strikes: StringProperty(name="Strikes", options={"HIDDEN"}, description="One line for each strike: frame and text")
    touches: CollectionProperty(type=BeyondMocapTouch, description="Touches that were solved from tracking data")
    active_touch: IntProperty(name="Touch", min=0, description="Touch selected in the list")
    solved: StringProperty(name="Solved", options={"HIDDEN"}, description="Figures of the solved ball")


def find_armature(context: bpy.types.Context) -> bpy.types.Object | None:
    """Find the armature to work on: the active object, otherwise the character of the active player."""
    active = context.view_layer.objects.active
    if active is not None and active.type == "ARMATURE":
        return active
    settings = context.scene.beyond_mocap_passes
    player = find_active_row(settings.players, settings.active_player)
    return player.body if player is not None else None


def find_ball(context: bpy.types.Context) -> bpy.types.Object | None:
    """Find the ball to work on: a selected one, otherwise that of the passing scene, otherwise one named Ball."""
    chosen = [thing for thing in context.selected_objects if thing.type in {"MESH", "EMPTY"}]
    marked = [thing for thing in chosen if thing.get(KEPT) or "ball" in thing.name.lower()] or chosen[:1]
    if marked:
        return marked[0]
    own = context.scene.beyond_mocap_passes.rally
    if own is not None and own.name in context.scene.objects:
        return own
    return context.scene.objects.get("Ball")


def parse_lines(text: str) -> list[tuple[int, str]]:
    """Parse frame and text of the lines stored in `lines` and `strikes`."""
    rows = (line.partition("\t") for line in text.splitlines())
    return [(int(frame), text_of_line) for frame, _, text_of_line in rows]


def parse_hits(hits: BeyondMocapHits) -> dict:
    """Parse the stored hit analysis; empty if there is none."""
    return json.loads(hits.found or "{}")


def name_picture(hits: BeyondMocapHits) -> str:
    """Compute the name of an analysis' picture; other curves give another name."""
    return digest.byte_digest(hits.found, size=8).hex()


def needs_side(settings) -> bool:
    """Return whether a strike by the part of these settings has a side to choose: no joint is named instead."""
    from ...beyond_mocap.annotation.striking import SIDED_PARTS

    return settings.part in SIDED_PARTS and not settings.bone


def show_label(name: str) -> str:
    """Return a label's title, such as "Receive"."""
    from ...beyond_mocap.annotation.labels import find_label

    return find_label(name).title


def find_picture_icon(hits: BeyondMocapHits) -> int:
    """Find the picture's icon number for a layout; 0 until it is painted."""
    previews, name = pictures.get("graphs"), name_picture(hits)
    return previews[name].icon_id if previews is not None and name in previews else 0
