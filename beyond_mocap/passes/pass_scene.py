"""The request for a passing scene: who stands where, who passes to whom and how.

docs/reference/scene-json.md describes its form as a file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from types import MappingProxyType
from typing import Any

from ..ball.contact import Tool
from ..base.errors import InputError
from ..base.settings import collect_defaults, find_setting
from .hits import HitMotion

KINDS = ("toss", "pass", "attack")
RECEIVE = "receive"
SIDES = ("", "left", "right")
ERRORS = ("", "missed", "dropped")
GROUND = "ground"
LEAST_DISTANCE = 0.5
"""Least distance in metres between two players' places."""
_DEFAULTS = collect_defaults("passes")
_ROWS = (*(find_setting("passes", name) for name in ("transition", "lead_in", "lead_out", "repeat", "net_height")),
         *(find_setting("passes.pass", name) for name in ("bounces", "seconds")),
         find_setting("passes.player", "height"))
LIMITS = {**{row.name: (row.least, row.most) for row in _ROWS}, "weight": (0.0, 1000.0), "fps": (10.0, 240.0),
          "metres": (-1000.0, 1000.0), "seed": (-(2**63), 2**63 - 1)}
"""Lowest and highest value of a scene's numbers."""
MOST_PASSES, MOST_PLAYERS = 1000, 100
BONES = ("root", "head", "left hand", "right hand", "left foot", "right foot")
"""Bones by which eq. 1 compares poses, and whose weights can be set."""
RESERVED = ("ball", "strikes", "scene")
"""Names that other files of a scene have, so that no player can have them."""
LONGEST_TOOL, THICKEST_TOOL = 2.0, 0.5
"""Greatest length and radius in metres of a tool in the hand."""
LONGEST_PASS = 100.0
"""Greatest distance in metres of a pass."""
Place = tuple[float, ...]


@dataclass(frozen=True)
class Player:
    """A player who takes part.

    Attributes:
        name: unique, also used for files.
        place: (x, y) m, start position, world frame.
        facing: heading before the ball concerns the player, rad from +x; None: toward the middle of the others.
        part: part that strikes.
        side: one of SIDES.
        tool: what is in the hand.
        height: body height in m; 0: as the library's skeleton.
    """

    name: str
    place: Place
    facing: float | None = None
    part: str = "foot"
    side: str = ""
    tool: Tool | None = None
    height: float = 0.0


@dataclass(frozen=True)
class Example:
    """A stretch of a recording that a strike has to resemble (eq. 2).

    Attributes:
        clip: path below the library.
        start: s.
        end: s; None: to the end of the recording.
        hit: the hit motion itself, if it comes from elsewhere, such as a live stream.
    """

    clip: str
    start: float = 0.0
    end: float | None = None
    hit: HitMotion | None = None


@dataclass(frozen=True)
class Pass:
    """One pass.

    Attributes:
        giver: name of the player who passes.
        receiver: name of the player who receives.
        kind: one of KINDS.
        bounces: number of bounces of the ball on its trajectory.
        part: part of the passing player's body that strikes; None: as in Player.
        side: its side; None: as in Player.
        seconds: travel time of the ball; None: from the motion.
        at: (x, y) m where the receiver meets the ball; None: where they stand.
        example: recording to resemble; None: any strike of the kind.
        error: one of ERRORS, what the receiver does wrong.
    """

    giver: str
    receiver: str
    kind: str = "pass"
    bounces: int = 1
    part: str | None = None
    side: str | None = None
    seconds: float | None = None
    at: Place | None = None
    example: Example | None = None
    error: str = ""


@dataclass(frozen=True)
class Net:
    """A net on the ground.

    Attributes:
        start: (x, y) m of one end.
        end: (x, y) m of the other end.
        height: m.
    """

    start: Place
    end: Place
    height: float


@dataclass(frozen=True)
class Weights:
    """Factors on the weights of eq. 2 (similarity to an example) and eq. 1 (transitions).

    Attributes:
        speed: factor in eq. 2.
        vectors: factor in eq. 2.
        times: factor in eq. 2.
        position: factor in eq. 1.
        velocity: factor in eq. 1.
        bones: one of BONES -> factor in eq. 1.
    """

    speed: float = 1.0
    vectors: float = 1.0
    times: float = 1.0
    position: float = 1.0
    velocity: float = 1.0
    bones: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))

    def __post_init__(self):
        object.__setattr__(self, "bones", MappingProxyType(dict(self.bones)))


@dataclass(frozen=True)
class BallChoice:
    """A ball.

    Attributes:
        kind: one of the known kinds.
        changes: values that differ from the kind's, by the field names of `physics.Ball`.
    """

    kind: str = "paper"
    changes: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))

    def __post_init__(self):
        object.__setattr__(self, "changes", MappingProxyType(dict(self.changes)))


@dataclass(frozen=True)
class PassScene:
    """The request for a passing scene. The settings table describes the fields that are not listed here.

    Attributes:
        players: the players.
        passes: passes in their order.
        fps: frames per second of the output.
        serve: where the first ball comes from: a player's name, (x, y, z) m, GROUND, or None: the player who is
            expected to pass to the first one.
        directions: 8: strikes turn in steps of 45 degrees; 0: any heading.
    Raises:
        InputError: for two players at one place or with one name, a pass to oneself or to an unknown player, passes
        that do not start where the one before ended, or numbers outside LIMITS.
    """

    players: tuple[Player, ...]
    passes: tuple[Pass, ...]
    repeat: int = _DEFAULTS["repeat"]
    fps: float = 30.0
    seed: int = _DEFAULTS["seed"]
    ball: BallChoice = BallChoice()
    net: Net | None = None
    serve: str | tuple[float, float, float] | None = None
    missed: float = _DEFAULTS["missed"]
    dropped: float = _DEFAULTS["dropped"]
    transition: float = _DEFAULTS["transition"]
    lead_in: float = _DEFAULTS["lead_in"]
    lead_out: float = _DEFAULTS["lead_out"]
    directions: int = 0
    watch: bool = _DEFAULTS["watch"]
    weights: Weights = Weights()

    def __post_init__(self):
        object.__setattr__(self, "players", tuple(self.players))
        object.__setattr__(self, "passes", tuple(self.passes))
        _check_players(self.players)
        _check_passes(self)
        _check_numbers(self)

    def find_player(self, name: str) -> Player:
        """Find a player by name."""
        return next(one for one in self.players if one.name == name)

    @property
    def order(self) -> tuple[Pass, ...]:
        """All passes in their order, with repeats, up to the first that is meant to go wrong."""
        out = []
        for one in self.passes * self.repeat:
            out.append(one)
            if one.error:
                break
        return tuple(out)

    def find_facing(self, name: str) -> float:
        """Compute the heading in rad of a player before the ball concerns them."""
        player = self.find_player(name)
        if player.facing is not None:
            return player.facing
        others = [other.place for other in self.players if other.name != name]
        x, y = (sum(place[axis] for place in others) / len(others) - player.place[axis] for axis in (0, 1))
        return math.atan2(y, x)


def check_number(value, name: str, where: str, whole: bool = False):
    """Check that a value is a number within LIMITS[name].

    Args:
        value: the value.
        name: key of LIMITS.
        where: place in the scene, for messages.
        whole: whether it has to be a whole number.
    Returns:
        The value as int or float.
    Raises:
        InputError: if it is not.
    """
    low, high = LIMITS[name]
    kind = "a whole number" if whole else "a number"
    is_valid = isinstance(value, (int, float)) and not isinstance(value, bool)
    is_valid = is_valid and low <= value <= high  # false for NaN; works for whole numbers too large for a float
    if not is_valid or (whole and value != int(value)):
        raise InputError(where, _format_value(value), f"{kind} from {low:g} to {high:g}")
    return int(value) if whole else float(value)


def _format_value(value) -> str:
    """Format a value for messages, shortened: a whole number of a file may have hundreds of digits."""
    text = repr(value)
    return text if len(text) <= 40 else text[:37] + "..."


def _check_players(players: tuple[Player, ...]) -> None:
    """Check number, names, places, parts, tools and heights of the players."""
    if not 2 <= len(players) <= MOST_PLAYERS:
        raise InputError("players", f"{len(players)} players", f"2 to {MOST_PLAYERS}")
    for number, one in enumerate(players):
        where = f"player {one.name!r}"
        _check_name(one.name, where)
        _check_place(one.place, where)
        _check_part(one.part, one.side, where)
        if one.facing is not None and not math.isfinite(one.facing):
            raise InputError(where, f"facing {one.facing}", "an angle")
        if one.tool is not None and (one.tool.length > LONGEST_TOOL or one.tool.radius > THICKEST_TOOL):
            most = f"a length up to {LONGEST_TOOL:g} m, a radius up to {THICKEST_TOOL:g} m"
            raise InputError(f"{where}: tool", str(one.tool), most)
        if one.height:
            check_number(one.height, "height", f"{where}: height")
        for other in players[:number]:
            _check_pair(one, other)


def _check_name(name: str, where: str) -> None:
    """Check a player's name, which is also used for files."""
    is_invalid = not name.isprintable() or name != name.strip() or name.startswith(".") or set(name) & set('/\\:*?"<>|')
    if not name or is_invalid or len(name) > 60 or name.casefold() in RESERVED:
        expected = "up to 60 letters, digits and spaces between them"
        raise InputError(where, "a name that a file cannot have", expected, "rename the player")


def _check_pair(one: Player, other: Player) -> None:
    if one.name.casefold() == other.name.casefold():
        raise InputError("players", f"two with the name {one.name!r}", "a different name for each")
    if math.dist(one.place, other.place) < LEAST_DISTANCE:
        found = f"{other.name} and {one.name} are {math.dist(one.place, other.place):.2f} m apart"
        raise InputError("players", found, f"{LEAST_DISTANCE} m or more", "move one of them")


def _check_place(place: Place, where: str) -> None:
    if len(place) != 2 or not all(math.isfinite(value) and abs(value) <= LIMITS["metres"][1] for value in place):
        raise InputError(where, f"the place {place}", f"[x, y] in metres, each up to {LIMITS['metres'][1]:g}")


def _check_part(part: str, side: str, where: str) -> None:
    if not part:
        raise InputError(where, "no part", "foot, head, chest, hand, tool or a joint's name")
    if side not in SIDES:
        raise InputError(where, f"the side {side!r}", "left, right, or nothing for either")


def _check_passes(scene: PassScene) -> None:
    """Check the passes, and that each starts where the one before ended."""
    if not scene.passes:
        raise InputError("passes", "none", "at least one")
    check_number(scene.repeat, "repeat", "repeat", whole=True)
    if len(scene.passes) * scene.repeat > MOST_PASSES:
        count = len(scene.passes) * scene.repeat
        raise InputError("passes", f"{count} in total", f"{MOST_PASSES} at most", "use fewer repeats")
    names = [one.name for one in scene.players]
    for number, one in enumerate(scene.passes, start=1):
        _check_pass(one, f"pass {number}", names, scene)
    _check_meetings(scene)
    ends = [*scene.passes, *(scene.passes[:1] if scene.repeat > 1 else ())]
    for number, (before, after) in enumerate(zip(ends, ends[1:]), start=1):
        if after.giver != before.receiver:
            found = f"{after.giver} does not have the ball"
            again = number == len(scene.passes)
            where = "pass 1 when repeated" if again else f"pass {number + 1}"
            raise InputError(where, found, f"a pass from {before.receiver}, who gets pass {number}", "change either")


def _check_pass(one: Pass, where: str, names: list[str], scene: PassScene) -> None:
    """Check one pass: players, kind, error, numbers, example and distance."""
    for direction, name in (("from", one.giver), ("to", one.receiver)):
        if name not in names:
            raise InputError(where, f"{direction} {name!r}", f"one of {', '.join(names)}")
    if one.giver == one.receiver:
        raise InputError(where, f"{one.giver} is both passer and receiver", "two players", "choose another receiver")
    if one.kind not in KINDS:
        raise InputError(where, f"the kind {one.kind!r}", f"one of {', '.join(KINDS)}")
    if one.error not in ERRORS:
        raise InputError(where, f"the error {one.error!r}", "missed or dropped")
    _check_part("foot" if one.part is None else one.part, one.side or "", where)
    check_number(one.bounces, "bounces", f"{where}: bounces", whole=True)
    if one.seconds is not None:
        check_number(one.seconds, "seconds", f"{where}: seconds")
    if one.at is not None:
        _check_place(one.at, where)
    if one.example is not None:
        start, end = one.example.start, math.inf if one.example.end is None else one.example.end
        if not (math.isfinite(start) and 0.0 <= start < end):
            raise InputError(where, f"an example from {start:g} to {end:g} s", "a start from 0 s and a later end")
    goal = one.at or scene.find_player(one.receiver).place
    distance = math.dist(scene.find_player(one.giver).place, goal)
    if distance > LONGEST_PASS:
        found = f"{one.receiver} is {distance:.0f} m away"
        raise InputError(where, found, f"{LONGEST_PASS:.0f} m at most", "move one of them nearer")


def _check_meetings(scene: PassScene) -> None:
    """Check that no player meets a ball where another player stands at that time."""
    places = {one.name: one.place for one in scene.players}
    for number, one in enumerate(scene.passes, start=1):
        places[one.receiver] = one.at or places[one.receiver]
        for other, place in places.items():
            if other != one.receiver and math.dist(place, places[one.receiver]) < LEAST_DISTANCE:
                raise InputError(f"pass {number}: at", f"{other} stands there",
                                 f"{LEAST_DISTANCE} m or more between them")


def _check_numbers(scene: PassScene) -> None:
    """Check the numbers, weights, net and serve of a scene."""
    for name in ("fps", "transition", "lead_in", "lead_out"):
        check_number(getattr(scene, name), name, name)
    check_number(scene.seed, "seed", "seed", whole=True)
    for name in ("missed", "dropped"):
        value = getattr(scene, name)
        if not (isinstance(value, (int, float)) and 0.0 <= value <= 1.0):
            raise InputError(f"errors: {name}", f"{value!r}", "a number from 0 to 1")
    if scene.missed + scene.dropped > 1.0:
        raise InputError("errors", f"{scene.missed:g} missed and {scene.dropped:g} dropped", "a sum of 1 at most")
    if scene.directions not in (0, 8):
        raise InputError("directions", f"{scene.directions!r}", "8, or 0 for any")
    for bone in scene.weights.bones:
        if bone not in BONES:
            raise InputError("weights: bones", f"{bone!r}", f"one of {', '.join(BONES)}", "check the spelling")
    for entry in fields(Weights):
        values = [getattr(scene.weights, entry.name)] if entry.name != "bones" else list(scene.weights.bones.values())
        for value in values:
            check_number(value, "weight", f"weights: {entry.name}")
    if scene.net is not None:
        _check_net(scene.net)
    _check_serve(scene)


def _check_net(net: Net) -> None:
    for place in (net.start, net.end):
        _check_place(place, "net")
    check_number(net.height, "net_height", "net: height")
    if math.dist(net.start, net.end) < 0.1:
        raise InputError("net", f"{math.dist(net.start, net.end):.2f} m wide", "0.1 m or more")


def _check_serve(scene: PassScene) -> None:
    """Check the serve: a known other player, or a place away from the first player."""
    serve = scene.serve
    if serve is None or serve == GROUND:
        return
    first = scene.passes[0].giver
    if isinstance(serve, str):
        names = [one.name for one in scene.players if one.name != first]
        if serve not in names:
            raise InputError("serve", f"{serve!r}", f"ground, [x, y, z], or one of {', '.join(names)}")
        return
    if len(serve) != 3 or not all(math.isfinite(v) and abs(v) <= LIMITS["metres"][1] for v in serve) or serve[2] < 0.0:
        raise InputError("serve", f"{serve}", "[x, y, z] in metres, not below the ground")
    if math.dist(serve[:2], scene.find_player(first).place) < LEAST_DISTANCE:
        raise InputError("serve", f"{serve}, where {first} stands", f"a place {LEAST_DISTANCE} m away or more")


def find_server(scene: PassScene) -> str:
    """Find the player who is expected to serve to the first player.

    The passer of the last pass that goes to them, otherwise the last receiver, otherwise the first of the other
    players.
    """
    first = scene.passes[0].giver
    passers = [one.giver for one in scene.passes if one.receiver == first]
    other_receivers = [one.receiver for one in scene.passes if one.receiver != first]
    return passers[-1] if passers else other_receivers[-1]

