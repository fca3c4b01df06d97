"""kloppy's kinds of events, qualifiers and results in our words."""

from __future__ import annotations

_KINDS = {
    "PASS": "pass", "SHOT": "shot", "TAKE_ON": "take-on", "CARRY": "carry", "CLEARANCE": "clearance",
    "INTERCEPTION": "interception", "RECOVERY": "touch", "MISCONTROL": "miscontrol", "BALL_OUT": "out",
    "FOUL_COMMITTED": "foul", "DUEL": "tackle", "GOALKEEPER": "save",
}  # fmt: skip
_BY_NAME = {  # of events that kloppy leaves generic
    "ball receipt*": "receive", "reception": "receive", "receival": "receive", "touch": "touch", "ball touch": "touch",
    "block": "deflection",
}  # fmt: skip
_BY_KEEPER = {"CLAIM": "catch", "PUNCH": "punch", "PICK_UP": "pick-up", "SMOTHER": "catch"}
_PARTS = {
    "RIGHT_FOOT": ("foot", "right"), "LEFT_FOOT": ("foot", "left"), "HEAD": ("head", ""), "CHEST": ("chest", ""),
    "BOTH_HANDS": ("hand", ""), "LEFT_HAND": ("hand", "left"), "RIGHT_HAND": ("hand", "right"),
    "KEEPER_ARM": ("hand", ""), "DROP_KICK": ("foot", ""),
}  # fmt: skip
_PASSES = {"HEAD_PASS": ("head", ""), "HAND_PASS": ("hand", "")}
_DETAILS = {
    "THROW_IN": "throw-in", "CORNER_KICK": "corner", "FREE_KICK": "free-kick", "GOAL_KICK": "goal-kick",
    "KICK_OFF": "kick-off", "PENALTY": "penalty", "SLIDING_TACKLE": "sliding", "CROSS": "cross",
    "HIGH_PASS": "high", "LONG_BALL": "long", "LAUNCH": "long", "CHIPPED_PASS": "chipped",
}  # fmt: skip
_GOOD = {"COMPLETE", "GOAL", "WON", "SUCCESS"}
_BAD = {"INCOMPLETE", "OUT", "OFFSIDE", "OFF_TARGET", "POST", "BLOCKED", "SAVED", "LOST"}


def kind_of(event, tells_foot: bool) -> tuple[str, str, str, tuple[str, ...], bool | None]:
    """Kind, part, side, details and success of one of kloppy's events. tells_foot: whether its provider tells left
    feet from right ones."""
    names = [_name(one) for one in getattr(event, "qualifiers", None) or ()]
    result = getattr(getattr(event, "result", None), "name", "")
    success = True if result in _GOOD else False if result in _BAD else None
    kind = _KINDS.get(event.event_type.name) or _BY_NAME.get(str(event.event_name).lower(), "other")
    details = [_DETAILS[name] for name in names if name in _DETAILS]
    if "AERIAL" in names and kind == "tackle":
        kind = "aerial"
    if kind in ("aerial", "tackle") and result == "LOST":
        details.append("lost")
    part, side = next((_PARTS[name] for name in names if name in _PARTS), ("", ""))
    if not part and kind == "pass":
        part, side = next((_PASSES[name] for name in names if name in _PASSES), ("", ""))
    if "throw-in" in details:
        part, side = "hand", ""
    if event.event_type.name == "GOALKEEPER":
        kind = next((_BY_KEEPER[name] for name in names if name in _BY_KEEPER), kind)
        part = part or "hand"
    if not tells_foot or part != "foot":
        side = ""
    return kind, part, side, tuple(dict.fromkeys(details)), success


def _name(qualifier) -> str:
    value = getattr(qualifier, "value", None)
    return str(getattr(value, "name", value))
