"""The meaning of each label, from one table (`vocabulary.csv`): its place in the tree, and what it says of body and
ball.

    find_label("kick").ball             # "sends"
    list_labels(ball="takes")           # ("receive", "catchb", "catch", "trap")

To add a label, add a row. All code that needs a label's meaning asks this module.
"""

from __future__ import annotations

import csv
import re
import string
from collections.abc import Iterable
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

_ALLOWED_VALUES = {
    "kind": KINDS, "group": GROUPS, "part": (*BODY_PARTS, "thigh", "hands", "tool"), "flight": ("yes",),
    "ball": ("sends", "takes", "carries", "avoids", "holds", "never", "held"), "height": ("low", "middle", "high"),
    "action": ACTIONS,
}  # fmt: skip
_COLUMNS = (
    "label", "title", "meaning", "kind", "group", "part", "part_with", "ball", "gait_m_s", "height", "flight", "action",
    "below",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Label:
    """A row of the table; a label without a row says nothing of body and ball.

    Attributes:
        name: as annotations write it.
        title: as interfaces show it.
        meaning: in a short phrase.
        kinds: of `KINDS`, the trees in which it is a root.
        group: of `GROUPS`; a motion has at most one label of a group; or "".
        parts: body parts that may meet the ball, of `BODY_PARTS`, "thigh" or "tool".
        both_hands: whether both hands meet it together.
        part_with: labels of which one must be present for the part to be certain.
        ball: "sends", "takes", "carries", "avoids", "holds", "never" or "".
        from_hands: whether the ball comes out of the hands that have held it.
        gait: m/s from which the gait applies if a library has no own speed for it; None if it is no gait.
        height: of the ball at contact, or "".
        in_flight: whether the body flies to the ball.
        action: the action that networks learn from clips with it, or "".
        below: the tree below it, label -> labels below that.
    """

    name: str
    title: str = ""
    meaning: str = ""
    kinds: tuple[str, ...] = ()
    group: str = ""
    parts: tuple[str, ...] = ()
    both_hands: bool = False
    part_with: tuple[str, ...] = ()
    ball: str = ""
    from_hands: bool = False
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
    labels: dict[str, Label] = {}
    for number, cells in enumerate(csv.DictReader(lines[first:]), first + 2):
        label = _parse_label(cells, f"{TABLE}:{number}")
        if label.name in labels:
            raise InputError(f"{TABLE}:{number}", f"the label {label.name!r} is repeated", "each label once")
        labels[label.name] = label
    return labels


def find_label(name: str) -> Label:
    """Find the label of a name.

    Args:
        name: the label as annotations write it.
    Returns:
        The label; one without any meaning if the table has none.
    """
    return read_labels().get(name) or Label(name=name, title=string.capwords(name.replace("_", " ")))


def avoids_ball(names: Iterable[str]) -> bool:
    """Return whether a label says that the body lets the ball pass untouched.

    Args:
        names: the labels of a motion.
    """
    return any(find_label(name).ball == "avoids" for name in names)


@lru_cache(maxsize=64)
def list_labels(**required: object) -> tuple[str, ...]:
    """List the labels with certain attributes.

    Args:
        required: attribute of `Label` -> required value.
    Returns:
        Their names in the table's order.
    """
    matches = ((label.name, all(getattr(label, key) == value for key, value in required.items()))
               for label in _list_rows())
    return tuple(name for name, is_match in matches if is_match)


def list_gaits() -> tuple[str, ...]:
    """List the names of all gaits, slow to fast."""
    gaits = [label for label in _list_rows() if label.gait is not None]
    return tuple(label.name for label in sorted(gaits, key=lambda label: label.gait))


def _list_rows() -> tuple[Label, ...]:
    return tuple(read_labels().values())


def _parse_label(cells: dict[str, str], place: str) -> Label:
    """Check one row's cells and build its label."""
    if tuple(cells) != _COLUMNS or None in cells.values():
        raise InputError(place, "wrong columns", ",".join(_COLUMNS))
    values = {column: tuple(text.split()) for column, text in cells.items()}
    for column, allowed in _ALLOWED_VALUES.items():
        if not set(allowed).issuperset(values[column]):
            raise InputError(place, f"{column} {cells[column]!r}", f"one of {', '.join(allowed)}, or blank")
    return Label(
        name=cells["label"], title=cells["title"], meaning=cells["meaning"], kinds=values["kind"], group=cells["group"],
        parts=tuple("hand" if part == "hands" else part for part in values["part"]),
        both_hands="hands" in values["part"], part_with=values["part_with"],
        ball=(values["ball"] or ("",))[0], from_hands="held" in values["ball"],
        gait=float(cells["gait_m_s"]) if cells["gait_m_s"] else None, height=cells["height"],
        in_flight=bool(cells["flight"]), action=cells["action"], below=_parse_tree(cells["below"]),
    )  # fmt: skip


def _parse_tree(text: str) -> dict[str, dict]:
    """Parse the nested labels of a text such as "low(inside outside) high"."""
    # Stack of open branches; `last` is the branch of the label read last, which "(" opens.
    branches: list[dict[str, dict]] = [{}]
    last: dict[str, dict] = branches[0]
    for sign in re.findall(r"[^\s()]+|[()]", text):
        if sign == "(":
            branches.append(last)
        elif sign == ")":
            branches.pop()
        else:
            last = branches[-1][sign] = {}
    return branches[0]
