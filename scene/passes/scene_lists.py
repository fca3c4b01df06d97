"""The lists of the panel as a passing scene of the core, and back: the panel shows what a SCENE.json holds.

The strike of a pass can be taken from an armature's action (eq. 2).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...beyond_mocap.ball.contact import Tool
from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.passes.pass_scene import GROUND, LIMITS, BallChoice, Example, Net, Pass, PassScene, Player, Weights
from ..core.measure import frames_per_second, units_per_metre
from ..path_editing.armature_adapter import MARK
from ..path_editing.rigs import choose_adapter
from ..result import bake
from . import characters as shown
from . import hit_analysis as hits_shown
from .settings import KEPT, BeyondMocapPass, BeyondMocapPasser, BeyondMocapPasses

if TYPE_CHECKING:
    from ...beyond_mocap.passes.hits import HitMotion

SIZE = 0.5  # m, of the Empties that mark places
SHIRTS = ((0.75, 0.05, 0.06), (0.04, 0.14, 0.70), (0.80, 0.55, 0.04), (0.04, 0.45, 0.20), (0.45, 0.08, 0.55),
          (0.02, 0.45, 0.60))
NUMBERS = ("radius", "restitution", "linear_drag", "drag", "gravity")
_DIGITS = 6  # decimals of single-precision numbers
_MOST_EXAMPLES = 32
_examples: dict[tuple, "HitMotion"] = {}  # by all that they were read from; a drag asks again and again


def build_scene(scene: bpy.types.Scene) -> PassScene:
    """Build the passing scene that the settings describe.

    Raises:
        InputError: if the settings are invalid.
    """
    settings = scene.beyond_mocap_passes
    return PassScene(
        tuple(_build_player(scene, one) for one in settings.players), tuple(_build_pass(scene, one, number) for number,
                                                                            one in enumerate(settings.passes, start=1)),
        settings.repeat, _find_rate(scene), settings.seed,
        BallChoice(settings.ball, {name: _round_value(getattr(settings, name)) for name in NUMBERS} if settings.own
                   else {}), Net(_round_place(settings.net_from), _round_place(settings.net_to),
                                 _round_value(settings.net_height)) if settings.net else None, _build_serve(settings),
        *(_round_value(getattr(settings, name)) for name in ("missed", "dropped", "transition", "lead_in", "lead_out")),
        8 if settings.turns else 0, settings.watch, _build_weights(settings.weights),
    )  # fmt: skip


def fill_lists(context: bpy.types.Context, passing_scene: PassScene) -> None:
    """Set the settings from a passing scene; places become Empties, and those of the scene before are removed."""
    settings = context.scene.beyond_mocap_passes
    live, settings.live = settings.live, False
    shown.check_characters(*settings.players)
    for row in settings.passes:
        remove_mark(row.at)
    settings.passes.clear()
    _fill_players(context, passing_scene)
    for one in passing_scene.passes:
        _fill_pass(context, settings.passes.add(), one)
    _fill_scene(settings, passing_scene)
    settings.active_player = settings.active_pass = 0
    settings.live = live


def _fill_players(context: bpy.types.Context, passing_scene: PassScene) -> None:
    """Set the rows of the players, in their order; players who are in the list already keep their character."""
    rows, names = context.scene.beyond_mocap_passes.players, {player.name for player in passing_scene.players}
    for number in reversed(range(len(rows))):
        remove_place(rows[number])
        if rows[number].name not in names:
            shown.release_character(rows[number])
            rows.remove(number)
    for number, player in enumerate(passing_scene.players):
        facing, row_index = passing_scene.find_facing(player.name), rows.find(player.name)
        if row_index < 0:
            add_player(context, player.name, player.place, facing)
            row_index = len(rows) - 1
        else:
            rows[row_index].place = _create_empty(context, f"{player.name} place", player.place, facing,
                                                  (*rows[row_index].shirt, 1.0))
        rows.move(row_index, number)
        _fill_player(rows[number], player)


def add_player(
    context: bpy.types.Context, name: str, place: tuple[float, float], facing: float = 0.0
) -> BeyondMocapPasser:
    """Add a player with an Empty.

    Args:
        context: the context.
        name: the player's name.
        place: (x, y) m.
        facing: heading, rad.
    Returns:
        The player's row.
    """
    settings = context.scene.beyond_mocap_passes
    row = settings.players.add()
    row.shirt = SHIRTS[(len(settings.players) - 1) % len(SHIRTS)]
    row.name = name
    row.place = _create_empty(context, f"{name} place", place, facing, (*row.shirt, 1.0))
    settings.active_player = len(settings.players) - 1
    return row


def find_free_name(settings: BeyondMocapPasses) -> str:
    """Find a name that no player of the list has."""
    taken = {row.name for row in settings.players}
    usual = ("Ann", "Ben", "Cho", "Dia", "Eli", "Fay", "Gus", "Hal")
    return next(name for name in (*usual, *(f"Player {n}" for n in range(9, 999))) if name not in taken)


def remove_place(row: BeyondMocapPasser) -> None:
    """Remove a player's Empty from the file, if this extension created it and nothing is parented to it."""
    place, row.place = row.place, None
    remove_mark(place)


def remove_mark(thing: bpy.types.Object | None) -> None:
    """Remove an Empty that this extension created from the file, unless something is parented to it."""
    if thing is not None and thing.get(KEPT) and thing.type == "EMPTY" and not thing.children and thing.library is None:
        bpy.data.objects.remove(thing)


def measure_place(scene: bpy.types.Scene, thing: bpy.types.Object) -> tuple[tuple[float, float], float]:
    """Measure where an object is on the ground, (2,) m, and the direction of its X axis, rad."""
    matrix = np.array(thing.matrix_world, float)
    place = matrix[:2, 3] / units_per_metre(scene)
    facing = math.atan2(matrix[1, 0], matrix[0, 0])
    return tuple(round(float(value), _DIGITS) for value in place), round(facing, _DIGITS)


def _build_player(scene, row: BeyondMocapPasser) -> Player:
    """Build a player from a row."""
    if row.place is None or row.place.name not in scene.objects:
        raise InputError(f"player {row.name}", "no place", "an object that marks where the player stands",
                         "choose one as Place")
    place, facing = measure_place(scene, row.place)
    tool = _build_tool(row) if row.part == "tool" else None
    side = "" if row.side == "either" else row.side
    return Player(row.name, place, facing, part=row.bone or row.part, side=side, tool=tool,
                  height=_round_value(row.height))


def _build_tool(row: BeyondMocapPasser) -> Tool:
    return Tool("tool", *(_round_value(getattr(row, f"tool_{name}")) for name in ("length", "radius", "reach")))


def _build_example(scene, row: BeyondMocapPass, number: int) -> Example | None:
    """Build the example of a strike: an armature's motion, or a recording of the library."""
    giver = next((one for one in scene.beyond_mocap_passes.players if one.name == row.who), None)
    if has_armature_example(row) and giver is not None:
        player_part = (giver.bone or giver.part, giver.side)
        part, side = (mine if mine != "own" else usual for mine, usual in zip((row.part, row.side), player_part))
        tool = _build_tool(giver) if part == "tool" else None
        return Example("", hit=find_example_hit(scene, row, number, part=part, side="" if side == "either" else side,
                                                tool=tool))
    return Example(row.clip.replace("\\", "/"), _round_value(row.first), _round_value(row.last)
                   or None) if row.clip else None


def _build_pass(scene, row: BeyondMocapPass, number: int) -> Pass:
    """Build a pass from a row."""
    at = measure_place(scene, row.at)[0] if row.at is not None and row.at.name in scene.objects else None
    side = {"own": None, "either": ""}.get(row.side, row.side)
    return Pass(row.who, row.to, row.kind, bounces=row.bounces, part=None if row.part == "own" else row.part, side=side,
                seconds=_round_value(row.seconds) or None, at=at, example=_build_example(scene, row, number),
                error="" if row.error == "none" else row.error)


def _find_rate(scene) -> float:
    """Compute the frame rate: as set, or the scene's own, so that strikes fall on its frames."""
    low, high = LIMITS["fps"]
    return _round_value(scene.beyond_mocap_passes.rate) or min(max(frames_per_second(scene), low), high)


def _build_serve(settings):
    """Build the serve from the settings."""
    place = tuple(_round_value(value) for value in settings.serve_at)
    return {"USUAL": None, "GROUND": GROUND, "PLAYER": settings.serve, "PLACE": place}[settings.serve_from]


def _build_weights(row) -> Weights:
    """Parse the weights of the panel, with those of single bones.

    Raises:
        InputError: if the bone weights cannot be read.
    """
    bones = {}
    for item in filter(str.strip, row.bones.replace("=", " ").split(",")):
        name, _, number = item.strip().rpartition(" ")
        try:
            bones[name.strip()] = float(number)
        except ValueError:
            raise InputError("bone weights", item.strip(),
                             "bones with one number each, such as left foot 2, head 0.5") from None
    return Weights(*(_round_value(getattr(row, name)) for name in ("speed", "vectors", "times", "position",
                                                                   "velocity")), bones)


def _fill_player(row: BeyondMocapPasser, player: Player) -> None:
    """Set a row from a player; a part that is no known one is a joint's name."""
    known = {"foot", "head", "chest", "hand", "tool"}
    row.part, row.bone = (player.part, "") if player.part in known else ("foot", player.part)
    row.side, row.height = player.side or "either", player.height
    if player.tool is not None:
        row.tool_length, row.tool_radius, row.tool_reach = player.tool.length, player.tool.radius, player.tool.reach


def _fill_pass(context, row, one: Pass) -> None:
    """Set a row from a pass."""
    row.who, row.to, row.kind = one.giver, one.receiver, one.kind
    row.bounces, row.error = one.bounces, one.error or "none"
    row.part, row.seconds = one.part or "own", one.seconds or 0.0
    row.side = "own" if one.side is None else one.side or "either"
    if one.example is not None and one.example.hit is None:
        row.clip, row.first, row.last = one.example.clip, one.example.start, one.example.end or 0.0
    if one.at is not None:
        row.at = _create_empty(context, f"{one.receiver} meets", one.at, 0.0, (1.0, 1.0, 1.0, 1.0))


def _fill_scene(settings: BeyondMocapPasses, passing_scene: PassScene) -> None:
    """Set ball, net, serve and numbers of the settings from a passing scene."""
    settings.ball, settings.own = passing_scene.ball.kind, bool(passing_scene.ball.changes)
    for name, value in passing_scene.ball.changes.items():
        if name in NUMBERS:
            setattr(settings, name, value)
    settings.net = passing_scene.net is not None
    if passing_scene.net is not None:
        net = passing_scene.net
        settings.net_from, settings.net_to, settings.net_height = net.start, net.end, net.height
    settings.repeat, settings.turns = passing_scene.repeat, passing_scene.directions == 8
    settings.rate = 0.0 if passing_scene.fps == PassScene.fps else passing_scene.fps
    settings.seed, settings.watch = max(0, passing_scene.seed), passing_scene.watch
    for name in ("missed", "dropped", "transition", "lead_in", "lead_out"):
        setattr(settings, name, getattr(passing_scene, name))
    for name in ("speed", "vectors", "times", "position", "velocity"):
        setattr(settings.weights, name, getattr(passing_scene.weights, name))
    settings.weights.bones = ", ".join(f"{name} {value:g}" for name, value in passing_scene.weights.bones.items())
    settings.serve, settings.serve_from = "", "USUAL"
    if passing_scene.serve == GROUND:
        settings.serve_from = "GROUND"
    elif isinstance(passing_scene.serve, str):
        settings.serve, settings.serve_from = passing_scene.serve, "PLAYER"
    elif passing_scene.serve is not None:
        settings.serve_at, settings.serve_from = passing_scene.serve, "PLACE"


def _create_empty(context, name: str, place, facing: float, colour) -> bpy.types.Object:
    """Create an Empty that marks a place (m) and heading (rad)."""
    units = units_per_metre(context.scene)
    thing = bpy.data.objects.new(name, None)
    thing.empty_display_type, thing.empty_display_size, thing.show_name = "ARROWS", SIZE * units, True
    thing.location, thing.color = (place[0] * units, place[1] * units, 0.0), colour
    thing.rotation_euler.z = facing
    thing[KEPT] = True
    bake.find_or_create_collection(context.scene).objects.link(thing)
    context.view_layer.update()
    return thing


def _round_place(values) -> tuple[float, float]:
    return tuple(_round_value(value) for value in values)


def _round_value(value: float) -> float:
    """Round a single-precision number to the value that was typed."""
    return round(float(value), _DIGITS)


def has_armature_example(row: BeyondMocapPass) -> bool:
    """Whether an armature shows how the pass is struck, also if that armature no longer exists."""
    return row.actor is not None or bool(row.actor_known)


def find_example_hit(
    scene: bpy.types.Scene, row: BeyondMocapPass, number: int, part: str, side: str, tool: Tool | None
) -> "HitMotion":
    """Find the strongest strike by `part` in the stretch of an armature's motion that a pass names.

    Args:
        scene: the scene.
        row: the pass.
        number: number of the pass, from 1, for errors.
        part: the part of the player who strikes.
        side: its side; "": the faster one.
        tool: the tool of the player who strikes.
    Raises:
        InputError: if the armature no longer exists, is one of the scene's own characters, does not move, or does not
        strike there.
    """
    body, where = row.actor, f"pass {number}: Like Armature"
    if body is None or body.name not in scene.objects:
        raise InputError(where, f"{row.actor_known or body.name} is no longer in the scene",
                         "an armature that strikes", "choose another one, or clear the field")
    if any(body in (player.body, player.shown) for player in scene.beyond_mocap_passes.players):
        raise InputError(where, f"{body.name}, which plays this scene itself", "another armature",
                         "duplicate it first")
    if row.actor_cut and row.actor_last <= row.actor_first:
        raise InputError(where, f"frames {row.actor_first} to {row.actor_last}", "a later frame as To Frame")
    carrier, action = choose_adapter(body), body.animation_data and body.animation_data.action
    key = (body.session_uid, carrier.compute_input_digest(scene), carrier.compute_keys_digest(),
           action and str(action.get(MARK)), row.actor_cut and (row.actor_first, row.actor_last), part, side, tool)
    if key not in _examples:
        try:
            found = _find_strike(scene, row, part, side, tool)
        except InputError as error:
            raise InputError(where, str(error)) from None
        if len(_examples) >= _MOST_EXAMPLES:
            _examples.pop(next(iter(_examples)))
        _examples[key] = found
    return _examples[key]


def list_lost_examples(settings: BeyondMocapPasses) -> str:
    """Describe the examples that a SCENE.json cannot hold, because it names recordings of a library only; "" if there
    are none.
    """
    numbers = [str(number) for number, row in enumerate(settings.passes, start=1) if has_armature_example(row)]
    if not numbers:
        return ""
    passes = f"{'passes' if len(numbers) > 1 else 'pass'} {', '.join(numbers)}"
    return f"without the armature of {passes}: a file can name recordings of the library only"


def clear_examples() -> None:
    """Clear the examples, so that armatures are read again: what constraints follow may have changed unnoticed."""
    _examples.clear()


def _find_strike(scene, row: BeyondMocapPass, part: str, side: str, tool: Tool | None) -> "HitMotion":
    """Find the strongest strike that an armature shows in the stretch of a pass."""
    from ...beyond_mocap.passes.hits import find_strongest_hit

    body = row.actor
    motion, start = hits_shown.read_motion(scene, body)
    first, last = (row.actor_first, row.actor_last) if row.actor_cut else (start, start + len(motion) - 1)
    stretch = motion.frames(max(0, first - start), max(0, last - start + 1))
    span = f"frames {first} to {last}"
    if len(stretch) < 3:
        end = start + len(motion) - 1
        raise InputError(f"armature {body.name}", f"no motion on {span}", f"a stretch of its frames {start} to {end}")
    hit = find_strongest_hit(stretch, part, side, tool)
    if hit is None:
        raise InputError(f"armature {body.name}", f"no strike by {' '.join(filter(None, (side, part)))} on {span}",
                         "a stretch with a whole strike", "open Hit Analysis to see its strikes")
    return hit
