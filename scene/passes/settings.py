"""What the panel "Ball & Passes" shows and its operators read. Saved with the file, and known to undo."""

from __future__ import annotations

import json

import bpy
from bpy.props import (
    BoolProperty, CollectionProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, PointerProperty,
    StringProperty,
)

from ..result import BeyondMocapBefore

PARTS = (
    ("foot", "Foot", "From ankle to toe", "MOD_DYNAMICPAINT", 0),
    ("head", "Head", "The middle of the head", "USER", 1),
    ("chest", "Chest", "The uppermost joint of the spine", "OUTLINER_OB_ARMATURE", 2),
    ("hand", "Hand", "The palm", "VIEW_PAN", 3),
    ("tool", "Tool", "What the hand holds, such as a racquet", "MOD_BEVEL", 4),
)
SIDES = (
    ("right", "Right", "The right one"),
    ("left", "Left", "The left one"),
)
EITHER = (("either", "Either", "Whichever suits"), *SIDES)
KINDS = (
    ("toss", "Toss", "Slow, to somebody near"),
    ("pass", "Pass", "At a medium speed"),
    ("attack", "Attack", "Hard and fast"),
)
ERRORS = (
    ("none", "Arrives", "The receiver meets the ball"),
    ("missed", "Missed", "The receiver strikes and misses the ball; the rally ends"),
    ("dropped", "Dropped", "The receiver touches the ball, and it falls; the rally ends"),
)
BALLS = (
    ("football", "Football", "Size 5: measured drag, lift and bounce"),
    ("volleyball", "Volleyball", "Lighter, and slower in the air"),
    ("tennis", "Tennis Ball", "Small and fast"),
    ("paper", "As in the Paper", "Air takes 0.2 of the speed in a second, the bounce leaves 0.7, no spin"),
)
SAMPLES = (
    ("three", "Three", "Three players, a triangle of passes"),
    ("six", "Six", "Six players, two teams of three"),
    ("volley_net", "Foot Volleyball", "Four players over a net"),
    ("racquet", "Racquet", "Two players, tools in their hands"),
    ("dropped", "Dropped Ball", "Three players; one of them errs"),
)
SERVES = (
    ("USUAL", "By Who Would Pass", "The player who would pass to the first one"),
    ("PLAYER", "By a Player", "A player by name"),
    ("GROUND", "From the Ground", "The ball lies at the first foot"),
    ("PLACE", "From a Place", "The ball comes flying from a place"),
)
HOLDS = (
    ("KEEP", "As It Is", "The ball stays where it is beside the bone as it is taken"),
    ("TOUCH", "Touching", "The ball comes to touch the part: the palm, the foot, the brow"),
)
PLAYED = "live"  # `made_of` of a scene that was played live: no edit of the lists makes it anew
KEPT = "beyond_mocap_scene_ball"  # custom property of balls and actions made here; no group has its name


def touch_live(_settings, _context) -> None:
    """A change that a solved scene may have to follow."""
    from . import live

    live.mark()


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


class BeyondMocapPasser(bpy.types.PropertyGroup):
    """One player of a passing scene."""

    name: StringProperty(name="Name", description="What this player is called", update=renamed)
    known: StringProperty(name="Known As", options={"HIDDEN"}, description="The name by which the passes know him")
    place: PointerProperty(
        name="Place", type=bpy.types.Object, update=touch_live,
        description="The object that says where the player stands, and by its local X which way he looks; drag it "
        "with G, turn it with R",
    )
    body: PointerProperty(
        name="Body", type=bpy.types.Object, poll=lambda _own, thing: thing.type == "ARMATURE",
        description="The armature that the player's motion is shown on; made where it is missing",
    )
    part: EnumProperty(
        name="Part", items=PARTS, default="foot", description="What the player meets the ball with", update=touch_live
    )
    side: EnumProperty(
        name="Side", items=EITHER, default="either", description="Of what there are two", update=touch_live
    )
    bone: StringProperty(
        name="Joint", description="A joint of the library's skeleton by name, in place of the part", update=touch_live
    )
    tool_length: FloatProperty(
        name="Tool Length", default=0.66, min=0.05, max=2.0, precision=2, update=touch_live,
        description="Metres that the tool goes on beyond the wrist, along the forearm",
    )
    tool_radius: FloatProperty(
        name="Tool Radius", default=0.015, min=0.001, max=0.5, precision=3,
        description="Half as thick as it is, metres", update=touch_live,
    )
    tool_reach: FloatProperty(
        name="Tool Reach", default=0.26, min=0.0, max=2.0, precision=2, update=touch_live,
        description="Metres of its far end that strike the ball",
    )
    height: FloatProperty(
        name="Height", default=0.0, min=0.0, max=3.0, precision=2, update=touch_live,
        description="Metres that the player is tall; 0: as tall as the library's skeleton",
    )
    shirt: FloatVectorProperty(
        name="Shirt", subtype="COLOR", size=3, min=0.0, max=1.0, default=(0.75, 0.05, 0.06),
        description="Colour of the shirt",
    )
    shown: PointerProperty(
        name="Shown On", type=bpy.types.Object, options={"HIDDEN"},
        description="The armature that shows the scene now; before: what it played",
    )
    before: PointerProperty(type=BeyondMocapBefore, description="What the body played before the scene was made")


class BeyondMocapPass(bpy.types.PropertyGroup):
    """One pass: who sends the ball, to whom and how. Players are named, so that the list may be sorted."""

    who: StringProperty(name="From", description="Who sends the ball", update=touch_live)
    to: StringProperty(name="To", description="Who gets it", update=touch_live)
    kind: EnumProperty(name="Kind", items=KINDS, default="pass", description="How hard it is sent", update=touch_live)
    bounces: IntProperty(
        name="Bounces", default=1, min=0, max=5, description="How often the ball touches the ground on its way",
        update=touch_live,
    )
    part: EnumProperty(
        name="Part", items=(("own", "Own", "The part that the player is set to", "BLANK1", 9), *PARTS), default="own",
        update=touch_live,
        description="What the sender meets the ball with",
    )
    side: EnumProperty(
        name="Side", items=(("own", "Own", "As the player is set"), *EITHER), default="own", update=touch_live,
        description="Of what the sender has two",
    )
    at: PointerProperty(
        name="Meet At", type=bpy.types.Object, update=touch_live,
        description="An object to which the receiver goes to meet the ball; none: where he stands",
    )
    seconds: FloatProperty(
        name="Flight", default=0.0, min=0.0, max=20.0, precision=2, unit="TIME_ABSOLUTE", update=touch_live,
        description="Seconds that the ball is under way; 0: as the strike gives it",
    )
    clip: StringProperty(
        name="Like Clip", update=touch_live,
        description="Path below the library of a recording; the strike most like its own is played. Empty: by kind",
    )
    first: FloatProperty(
        name="From Second", min=0.0, precision=2, unit="TIME_ABSOLUTE", description="Of the stretch of that recording",
        update=touch_live,
    )
    last: FloatProperty(
        name="To Second", min=0.0, precision=2, unit="TIME_ABSOLUTE", update=touch_live,
        description="Of the stretch of that recording; 0: to its end",
    )
    actor: PointerProperty(
        name="Like Armature", type=bpy.types.Object, poll=lambda _own, thing: thing.type == "ARMATURE", update=chosen,
        description="An armature whose own motion shows the strike: the one most like it is played, in place "
        "of Like Clip's",
    )
    actor_known: StringProperty(
        name="Missing", update=touch_live,
        description="The armature that showed the strike, which is not there any more; empty it to do without",
    )
    actor_cut: BoolProperty(
        name="Stretch", update=touch_live, description="Look at some frames of its motion only, not at all of it"
    )
    actor_first: IntProperty(name="From Frame", default=1, description="Scene frame", update=touch_live)
    actor_last: IntProperty(name="To Frame", default=60, description="Scene frame, the last one", update=touch_live)
    error: EnumProperty(name="Then", items=ERRORS, default="none", description="How it ends", update=touch_live)


class BeyondMocapWeights(bpy.types.PropertyGroup):
    """Weights of eq. 1 (two poses) and eq. 2 (two strikes)."""

    position: FloatProperty(
        name="Places", default=1.0, min=0.0, max=100.0, precision=2, update=touch_live,
        description="Of where bones are, where two poses are compared",
    )
    velocity: FloatProperty(
        name="Velocities", default=1.0, min=0.0, max=100.0, precision=2, update=touch_live,
        description="Of how bones move, where two poses are compared",
    )
    speed: FloatProperty(
        name="Top Speed", default=1.0, min=0.0, max=100.0, precision=2, update=touch_live,
        description="Of the part's highest speed, where two strikes are compared",
    )
    vectors: FloatProperty(
        name="Movement", default=1.0, min=0.0, max=100.0, precision=2, update=touch_live,
        description="Of the part's way, where two strikes are compared",
    )
    times: FloatProperty(
        name="Times", default=1.0, min=0.0, max=100.0, precision=2, update=touch_live,
        description="Of how long each piece of that way takes, where two strikes are compared",
    )
    bones: StringProperty(
        name="Bones", update=touch_live,
        description="Weights of single bones where two poses are compared, such as: left foot 2, head 0.5; all others "
        "count 1",
    )


class BeyondMocapTouch(bpy.types.PropertyGroup):
    """One touch of the ball, as it was solved from tracking. Its name is the player's; empty: nobody known."""

    player: StringProperty(name="Player", description="Who touches the ball")
    time: FloatProperty(name="Time", unit="TIME_ABSOLUTE", precision=3, description="Second on the track's clock")
    part: StringProperty(name="Part", description="With what")
    kind: StringProperty(name="Kind", description="What kind of touch it is")
    words: StringProperty(name="Words", description="The words that a key moment for it gets")
    confidence: FloatProperty(name="Confidence", min=0.0, max=1.0, description="How sure it is")
    use: BoolProperty(name="Use", default=True, description="Whether Accept Touches makes a key moment of it")


class BeyondMocapHold(bpy.types.PropertyGroup):
    """A stretch in which a bone carries the ball. Its name is that of the ball's constraint."""

    body: PointerProperty(name="Body", type=bpy.types.Object, description="The armature that carries the ball")
    bone: StringProperty(name="Bone", description="The bone that carries it")
    first: IntProperty(name="First Frame", description="From this frame on")
    last: IntProperty(name="Last Frame", description="The frame on which the ball is let go")
    how: EnumProperty(name="Hold", items=HOLDS, default="KEEP", description="Where the ball is while it is carried")
    settle: IntProperty(
        name="Settle", default=4, min=0, description="Frames within which the ball comes to where it is carried"
    )
    skin: FloatProperty(name="Skin", default=0.03, min=0.0, description="Metres from the bone to what touches the ball")


class BeyondMocapBall(bpy.types.PropertyGroup):
    """What a ball keeps: who carries it when, and what it played before."""

    attached_to = ("Object.beyond_mocap_ball",)

    holds: CollectionProperty(type=BeyondMocapHold, description="Who carries the ball, and when")
    before: PointerProperty(type=BeyondMocapBefore, description="What the ball played before somebody carried it")


class BeyondMocapHits(bpy.types.PropertyGroup):
    """What an armature keeps of its hit analysis."""

    attached_to = ("Object.beyond_mocap_hits",)

    part: EnumProperty(name="Part", items=PARTS, default="foot", description="The part whose strikes are looked for")
    side: EnumProperty(name="Side", items=SIDES, default="right", description="Left or right, of what there are two")
    bone: StringProperty(name="Bone", description="A bone by name, in place of the part")
    threshold: FloatProperty(
        name="Threshold", default=0.0, min=0.0, max=5.0, precision=2,
        description="Metres of height above which a strike may be; 0: found by itself",
    )
    found: StringProperty(name="Found", options={"HIDDEN"}, description="What was found, as JSON")
    lines: StringProperty(name="Lines", options={"HIDDEN"}, description="A line for each hit motion: frame, text")


class BeyondMocapPasses(bpy.types.PropertyGroup):
    """A passing scene and its ball."""

    attached_to = ("Scene.beyond_mocap_passes",)

    players: CollectionProperty(type=BeyondMocapPasser, description="Who keeps the ball going")
    active_player: IntProperty(name="Player", min=0, description="The player that is shown below the list")
    passes: CollectionProperty(type=BeyondMocapPass, description="The passes, one after the other")
    active_pass: IntProperty(name="Pass", min=0, description="The pass that is shown below the list")
    ball: EnumProperty(
        name="Ball", items=BALLS, default="paper", description="What kind of ball it is", update=touch_live
    )
    own: BoolProperty(
        name="Own Numbers", description="Use the numbers below in place of the chosen ball's", update=touch_live
    )
    radius: FloatProperty(
        name="Radius", default=0.11, min=0.01, max=0.5, precision=3, description="Metres", update=touch_live
    )
    restitution: FloatProperty(
        name="Elasticity", default=0.7, min=0.0, max=0.98, precision=2, update=touch_live,
        description="Share of its downward speed with which a bounce sends it up",
    )
    linear_drag: FloatProperty(
        name="Air, Linear", default=0.2, min=0.0, max=5.0, precision=3, update=touch_live,
        description="Share of its speed that the air takes in a second, as in the paper",
    )
    drag: FloatProperty(
        name="Air, Square", default=0.0, min=0.0, max=1.0, precision=4, update=touch_live,
        description="Deceleration over the square of the speed, per metre, as air really does",
    )
    gravity: FloatProperty(
        name="Gravity", default=9.8, min=0.1, max=30.0, precision=2, description="Metres per second squared",
        update=touch_live,
    )
    net: BoolProperty(name="Net", description="Every pass across the net goes over it", update=touch_live)
    net_from: FloatVectorProperty(
        name="Net From", size=2, default=(0.0, -5.0), description="One end, metres", update=touch_live
    )
    net_to: FloatVectorProperty(
        name="Net To", size=2, default=(0.0, 5.0), description="The other end, metres", update=touch_live
    )
    net_height: FloatProperty(
        name="Net Height", default=1.5, min=0.1, max=5.0, precision=2, description="Metres", update=touch_live
    )
    repeat: IntProperty(
        name="Rounds", default=1, min=1, max=100, description="How many times the passes are played in a row",
        update=touch_live,
    )
    serve_from: EnumProperty(
        name="Serve", items=SERVES, default="USUAL", update=touch_live, description="Where the ball comes from first"
    )
    serve: StringProperty(name="Serve By", description="Who serves", update=touch_live)
    serve_at: FloatVectorProperty(
        name="Serve At", size=3, default=(5.0, 0.0, 1.0), description="Where the ball comes from, metres",
        update=touch_live,
    )
    missed: FloatProperty(
        name="Missed", default=0.0, min=0.0, max=1.0, precision=2, description="How likely each ball is missed",
        update=touch_live,
    )
    dropped: FloatProperty(
        name="Dropped", default=0.0, min=0.0, max=1.0, precision=2, description="How likely each ball is dropped",
        update=touch_live,
    )
    lead_in: FloatProperty(
        name="Lead In", default=1.0, min=0.0, max=60.0, precision=2, unit="TIME_ABSOLUTE", update=touch_live,
        description="Seconds before the first strike, at least",
    )
    lead_out: FloatProperty(
        name="Lead Out", default=1.5, min=0.0, max=60.0, precision=2, unit="TIME_ABSOLUTE", update=touch_live,
        description="Seconds after the last strike",
    )
    rate: FloatProperty(
        name="Frame Rate", default=0.0, min=0.0, max=240.0, update=touch_live,
        description="Frames per second that are worked out, on which strikes fall; 0: the scene's own",
    )
    transition: FloatProperty(
        name="Transition", default=0.4, min=0.1, max=2.0, precision=2, unit="TIME_ABSOLUTE", update=touch_live,
        description="Seconds over which one motion goes over into the next",
    )
    turns: BoolProperty(
        name="Eight Directions",
        description="Strikes are turned in steps of 45 degrees, as in the paper; off: as the pass needs",
        update=touch_live,
    )
    watch: BoolProperty(name="Watch the Ball", default=True, description="Heads follow the ball", update=touch_live)
    weights: PointerProperty(type=BeyondMocapWeights, description="What counts how much where motions are compared")
    library_folder: StringProperty(
        name="Library", subtype="DIR_PATH", options={"PATH_SUPPORTS_BLEND_RELATIVE"}, update=touch_live,
        description="Folder of clips with strikes from a stand; empty: the library of step 1",
    )
    seed: IntProperty(name="Seed", default=0, min=0, description="Another one is another solution", update=touch_live)
    start_frame: IntProperty(
        name="Start Frame", default=1, description="Scene frame on which the scene begins", update=touch_live
    )
    live: BoolProperty(
        name="Live", default=True, description="Solve again when a player's place or a pass has been edited",
        update=touch_live,
    )
    rally: PointerProperty(
        name="Ball Object", type=bpy.types.Object, description="The ball of the scene; made where it is missing"
    )
    ball_before: PointerProperty(type=BeyondMocapBefore, description="What the ball played before the scene was made")
    made_of: StringProperty(
        name="Made Of", options={"HIDDEN"}, description="Digest of what the scene shown was made of"
    )
    told: StringProperty(name="Told", options={"HIDDEN"}, description="Lines about what to look at")
    figures: StringProperty(name="Figures", options={"HIDDEN"}, description="Lines about the scene that is shown")
    strikes: StringProperty(name="Strikes", options={"HIDDEN"}, description="A line for each strike: frame, text")
    touches: CollectionProperty(type=BeyondMocapTouch, description="Touches that were solved from tracking")
    active_touch: IntProperty(name="Touch", min=0, description="The touch that is picked in the list")
    solved: StringProperty(name="Solved", options={"HIDDEN"}, description="Lines about the ball that was solved")
    hold_part: EnumProperty(name="Part", items=PARTS, default="hand", description="What carries the ball")
    hold_side: EnumProperty(
        name="Side", items=SIDES, default="right", description="Left or right, of what there are two"
    )
    hold_how: EnumProperty(
        name="Hold", items=HOLDS, default="TOUCH", description="Where the ball is while it is carried"
    )
    hold_first: IntProperty(name="From", default=1, description="Frame from which on the ball is carried")
    hold_last: IntProperty(name="To", default=30, description="Frame on which the ball is let go")


def active_row(rows, number: int):
    """The row of a list that is picked; None while the list is empty."""
    return rows[number] if 0 <= number < len(rows) else None


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
