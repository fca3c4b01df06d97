"""The meaning of each label, from one table (`vocabulary.csv`): its place in the tree, and what it says of body and
ball.

    find_label("kick").ball             # "sends"
    list_labels(ball="takes")           # ("receive", "catchb", "catch", "trap")

To add a label, add a row. All code that needs a label's meaning asks this module.
"""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from ..base.errors import InputError
from .striking import BODY_PARTS

TABLE = Path(__file__).with_name("vocabulary.csv")

# The values that the table's columns allow; the table's head explains each.
KINDS = ("continuous", "discrete", "modifier")
GROUPS = ("side", "height", "surface", "pace", "way")
ACTIONS = ("throw", "kick")

_CLOSED = {
    "kind": KINDS, "group": GROUPS, "part": (*BODY_PARTS, "hands", "tool"), "flight": ("yes",),
    "ball": ("sends", "takes", "carries", "never"), "height": ("low", "middle", "high"), "action": ACTIONS,
}  # fmt: skip
_COLUMNS = (
    "label", "title", "kind", "group", "part", "part_with", "ball", "gait_m_s", "height", "flight", "action", "below",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Label:
    """A row of the table; a label without a row says nothing of body and ball.

    Attributes:
        name: as annotations write it.
        title: as interfaces show it.
        kinds: of `KINDS`, the trees in which it is a root.
        group: of `GROUPS`; a motion has at most one label of a group; or "".
        parts: body parts that may meet the ball, of `BODY_PARTS` or "tool".
        both_hands: whether both hands meet it together.
        part_with: labels of which one must be present for the part to be certain.
        ball: "sends", "takes", "carries", "never" or "".
        gait: m/s from which the gait applies if a library has no own speed for it; None if it is no gait.
        height: of the ball at contact, or "".
        in_flight: whether the body flies to the ball.
        action: the action that networks learn from clips with it, or "".
        below: the tree below it, label -> labels below that.
    """

    name: str
    title: str = ""
    kinds: tuple[str, ...] = ()
    group: str = ""
    parts: tuple[str, ...] = ()
    both_hands: bool = False
    part_with: tuple[str, ...] = ()
    ball: str = ""
    gait: float | None = None
    height: str = ""
    in_flight: bool = False
    action: str = ""
    below: dict[str, dict] | None = None

    @property
    def part(self) -> str:
        """The part that meets the ball; "" if there is none or several are possible."""
        return self.parts[0] if len(self.parts) == 1 else ""

    @property
    def is_root(self) -> bool:
        """Whether it names an action: a root of the continuous or the discrete tree."""
        return bool({"continuous", "discrete"} & set(self.kinds))


@lru_cache(maxsize=1)
def read_labels() -> dict[str, Label]:
    """Read all rows of the table.

    Returns:
        Name -> label, in the table's order.
    Raises:
        InputError: with the line, for an invalid row.
    """
    lines = TABLE.read_text(encoding="utf-8").splitlines()
    first = next(number for number, line in enumerate(lines) if not line.startswith("#"))
    found: dict[str, Label] = {}
    for number, cells in enumerate(csv.DictReader(lines[first:]), first + 2):
        label = _read_label(cells, f"{TABLE}:{number}")
        if label.name in found:
            raise InputError(f"{TABLE}:{number}", f"the label {label.name!r} is repeated", "each label once")
        found[label.name] = label
    return found


def find_label(name: str) -> Label:
    """Find the label of a name.

    Args:
        name: the label as annotations write it.
    Returns:
        The label; one without any meaning if the table has none.
    """
    return read_labels().get(name) or Label(name=name, title=name.replace("_", " "))


@lru_cache(maxsize=64)
def list_labels(**wanted: object) -> tuple[str, ...]:
    """List the labels with certain attributes.

    Args:
        required: attribute of `Label` -> required value.
    Returns:
        Their names in the table's order.
    """
    same = ((label.name, all(getattr(label, key) == value for key, value in wanted.items())) for label in _rows())
    return tuple(name for name, fits in same if fits)


def list_gaits() -> tuple[str, ...]:
    """List the names of all gaits, slow to fast."""
    gaits = [label for label in _rows() if label.gait is not None]
    return tuple(label.name for label in sorted(gaits, key=lambda label: label.gait))


def _rows() -> tuple[Label, ...]:
    return tuple(read_labels().values())


def _read_label(cells: dict[str, str], place: str) -> Label:
    """Check one row's cells and build its label."""
    if tuple(cells) != _COLUMNS or None in cells.values():
        raise InputError(place, "wrong columns", ",".join(_COLUMNS))
    said = {column: tuple(text.split()) for column, text in cells.items()}
    for column, known in _CLOSED.items():
        if not set(known).issuperset(said[column]):
            raise InputError(place, f"{column} {cells[column]!r}", f"one of {', '.join(known)}, or blank")
    return Label(
        name=cells["label"], title=cells["title"], kinds=said["kind"], group=cells["group"],
        parts=tuple("hand" if part == "hands" else part for part in said["part"]), both_hands="hands" in said["part"],
        part_with=said["part_with"], ball=cells["ball"], gait=float(cells["gait_m_s"]) if cells["gait_m_s"] else None,
        height=cells["height"], in_flight=bool(cells["flight"]), action=cells["action"], below=_tree_of(cells["below"]),
    )  # fmt: skip


def _tree_of(text: str) -> dict[str, dict]:
    """Parse the nested labels of a text such as "low(inside outside) high"."""
    # Stack of open branches; `last` is the branch of the label read last, which "(" opens.
    places: list[dict[str, dict]] = [{}]
    last: dict[str, dict] = places[0]
    for sign in re.findall(r"[^\s()]+|[()]", text):
        if sign == "(":
            places.append(last)
        elif sign == ")":
            places.pop()
        else:
            last = places[-1][sign] = {}
    return places[0]
