"""What the panel "Ball & Passes" shows and its operators read. Saved with the file, and known to undo."""

from __future__ import annotations

import json

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

from ...beyond_mocap.base.digest import byte_digest
from ..core import live
from ..core.properties import active_row, with_settings
from ..result.result import BeyondMocapBefore

pictures: dict = {}
"""The painted pictures of hit analyses: a preview collection under "graphs", while there are any."""

SAMPLES = (("three", "Three", "Three players, a triangle of passes"), ("six", "Six", "Six players, two teams of three"),
           ("volley_net", "Foot Volleyball", "Four players over a net"),
           ("racquet", "Racquet", "Two players, tools in their hands"),
           ("dropped", "Dropped Ball", "Three players; one of them errs"))
PLAYED = "live"  # `made_of` of a scene that was played live: no edit of the lists makes it anew
KEPT = "beyond_mocap_scene_ball"  # custom property of balls and actions made here; no group has its name


def touch_live(_settings, _context) -> None:
    """A change that a solved scene may have to follow."""
    live.mark("Passing scene")


def renamed(player, context) -> None:
    """A player's new name is his in all passes; one that another has is not taken, or their passes would be one's."""
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
    player.known = player.name
    touch_live(player, context)


def chosen(one, context) -> None:
    """Which armature shows a strike is known by name also when it has been deleted."""
    one.actor_known = one.actor.name if one.actor is not None else ""


@with_settings("passes.player", update=touch_live)
class BeyondMocapPasser(bpy.types.PropertyGroup):
    """One player of a passing scene."""

    name: StringProperty(name="Name", description="What this player is called", update=renamed)
    known: StringProperty(name="Known As", options={"HIDDEN"}, description="The name by which the passes know him")
    place: PointerProperty(
        name="Place", type=bpy.types.Object, update=touch_live,
        description="The object that says where the player stands, and by its local X which way he looks; drag it "
        "with G, turn it with R",
    )
    body: PointerProperty(name="Body", type=bpy.types.Object, poll=lambda _own, thing: thing.type == "ARMATURE",
                          description="The armature that the player's motion is shown on; made where it is missing")
    shirt: FloatVectorProperty(name="Shirt", subtype="COLOR", size=3, min=0.0, max=1.0, default=(0.75, 0.05, 0.06),
                               description="Colour of the shirt")
    shown: PointerProperty(name="Shown On", type=bpy.types.Object, options={"HIDDEN"},
                           description="The armature that shows the scene now; before: what it played")
    before: PointerProperty(type=BeyondMocapBefore, description="What the body played before the scene was made")


@with_settings("passes.pass", update=touch_live)
class BeyondMocapPass(bpy.types.PropertyGroup):
    """One pass: who sends the ball, to whom and how. Players are named, so that the list may be sorted."""

    who: StringProperty(name="From", description="Who sends the ball", update=touch_live)
    to: StringProperty(name="To", description="Who gets it", update=touch_live)
    at: PointerProperty(name="Meet At", type=bpy.types.Object, update=touch_live,
                        description="An object to which the receiver goes to meet the ball; none: where he stands")
    actor: PointerProperty(
        name="Like Armature", type=bpy.types.Object, poll=lambda _own, thing: thing.type == "ARMATURE", update=chosen,
        description="An armature whose own motion shows the strike: the one most like it is played, in place "
        "of Like Clip's",
    )
    actor_known: StringProperty(
        name="Missing", update=touch_live,
        description="The armature that showed the strike, which is not there any more; empty it to do without",
    )


@with_settings("passes.weights", update=touch_live)
class BeyondMocapWeights(bpy.types.PropertyGroup):
    """Weights of eq. 1 (two poses) and eq. 2 (two strikes)."""


class BeyondMocapTouch(bpy.types.PropertyGroup):
    """One touch of the ball, as it was solved from tracking. Its name is the player's; empty: nobody known."""

    player: StringProperty(name="Player", description="Who touches the ball")
    time: FloatProperty(name="Time", unit="TIME_ABSOLUTE", precision=3, description="Second on the track's clock")
    part: StringProperty(name="Part", description="With what")
    kind: StringProperty(name="Kind", description="What kind of touch it is")
    words: StringProperty(name="Words", description="The words that a key moment for it gets")
    confidence: FloatProperty(name="Confidence", min=0.0, max=1.0, description="How sure it is")
    use: BoolProperty(name="Use", default=True, description="Whether Accept Touches makes a key moment of it")


@with_settings("ball.held")
class BeyondMocapHold(bpy.types.PropertyGroup):
    """A stretch in which a bone carries the ball. Its name is that of the ball's constraint."""

    body: PointerProperty(name="Body", type=bpy.types.Object, description="The armature that carries the ball")
    bone: StringProperty(name="Bone", description="The bone that carries it")
    first: IntProperty(name="First Frame", description="From this frame on")
    last: IntProperty(name="Last Frame", description="The frame on which the ball is let go")


class BeyondMocapBall(bpy.types.PropertyGroup):
    """What a ball keeps: who carries it when, and what it played before."""

    attached_to = ("Object.beyond_mocap_ball",)

    holds: CollectionProperty(type=BeyondMocapHold, description="Who carries the ball, and when")
    before: PointerProperty(type=BeyondMocapBefore, description="What the ball played before somebody carried it")


@with_settings("hits")
class BeyondMocapHits(bpy.types.PropertyGroup):
    """What an armature keeps of its hit analysis."""

    attached_to = ("Object.beyond_mocap_hits",)

    found: StringProperty(name="Found", options={"HIDDEN"}, description="What was found, as JSON")
    lines: StringProperty(name="Lines", options={"HIDDEN"}, description="A line for each hit motion: frame, text")


@with_settings("passes", update=touch_live)
@with_settings("ball.hold")
class BeyondMocapPasses(bpy.types.PropertyGroup):
    """A passing scene and its ball."""

    attached_to = ("Scene.beyond_mocap_passes",)

    players: CollectionProperty(type=BeyondMocapPasser, description="Who keeps the ball going")
    active_player: IntProperty(name="Player", min=0, description="The player that is shown below the list")
    passes: CollectionProperty(type=BeyondMocapPass, description="The passes, one after the other")
    active_pass: IntProperty(name="Pass", min=0, description="The pass that is shown below the list")
    weights: PointerProperty(type=BeyondMocapWeights, description="What counts how much where motions are compared")
    library_folder: StringProperty(
        name="Library", subtype="DIR_PATH", options={"PATH_SUPPORTS_BLEND_RELATIVE"}, update=touch_live,
        description="Folder of clips with strikes from a stand; empty: the library of step 1",
    )
    rally: PointerProperty(name="Ball Object", type=bpy.types.Object,
                           description="The ball of the scene; made where it is missing")
    ball_before: PointerProperty(type=BeyondMocapBefore, description="What the ball played before the scene was made")
    made_of: StringProperty(name="Made Of", options={"HIDDEN"},
                            description="Digest of what the scene shown was made of")
    told: StringProperty(name="Told", options={"HIDDEN"}, description="Lines about what to look at")
    figures: StringProperty(name="Figures", options={"HIDDEN"}, description="Lines about the scene that is shown")
    strikes: StringProperty(name="Strikes", options={"HIDDEN"}, description="A line for each strike: frame, text")
    touches: CollectionProperty(type=BeyondMocapTouch, description="Touches that were solved from tracking")
    active_touch: IntProperty(name="Touch", min=0, description="The touch that is picked in the list")
    solved: StringProperty(name="Solved", options={"HIDDEN"}, description="Lines about the ball that was solved")


def subject(context: bpy.types.Context) -> bpy.types.Object | None:
    """The armature that is meant: the active object, or else the body of the picked player."""
    active = context.view_layer.objects.active
    if active is not None and active.type == "ARMATURE":
        return active
    settings = context.scene.beyond_mocap_passes
    player = active_row(settings.players, settings.active_player)
    return player.body if player is not None else None


def ball_of(context: bpy.types.Context) -> bpy.types.Object | None:
    """The ball that is meant: one that is selected, else that of the passing scene, else one called Ball."""
    chosen = [thing for thing in context.selected_objects if thing.type in {"MESH", "EMPTY"}]
    marked = [thing for thing in chosen if thing.get(KEPT) or "ball" in thing.name.lower()] or chosen[:1]
    if marked:
        return marked[0]
    own = context.scene.beyond_mocap_passes.rally
    if own is not None and own.name in context.scene.objects:
        return own
    return context.scene.objects.get("Ball")


def told_lines(text: str) -> list[tuple[int, str]]:
    """Frame and text of lines as they are kept in `lines` and `strikes`."""
    rows = (line.partition("\t") for line in text.splitlines())
    return [(int(frame), said) for frame, _, said in rows]


def found_of(hits: BeyondMocapHits) -> dict:
    """What a hit analysis found; empty where there was none."""
    return json.loads(hits.found or "{}")


def picture_name(hits: BeyondMocapHits) -> str:
    """The name of the picture of an analysis: another one for other curves."""
    return byte_digest(hits.found, size=8).hex()


def picture_icon(hits: BeyondMocapHits) -> int:
    """The picture's number for a layout; 0 while it is not painted (`hits_shown.paint`)."""
    kept, name = pictures.get("graphs"), picture_name(hits)
    return kept[name].icon_id if kept is not None and name in kept else 0
