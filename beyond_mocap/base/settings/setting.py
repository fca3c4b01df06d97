"""One setting: its name, kind, unit, default, limits and sentences, for code, command line and panels alike."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from ..errors import InputError

BETWEEN = "between {least} and {most}"
WHOLE = "a whole number from {least} to {most}"
LATER = {"later": True}
"""Marks fields that came after files were saved with fingerprints of the others."""
POSITIVE: dict[str, Any] = {"least": 1e-9, "most": 1e6, "unit": "metres", "expected": "a positive number"}

# Choices that settings of several features share: identifier, title, sentence[, icon, number].
PARTS = (
    ("foot", "Foot", "From ankle to toe", "MOD_DYNAMICPAINT", 0), ("head", "Head", "The middle of the head", "USER", 1),
    ("chest", "Chest", "The uppermost joint of the spine", "OUTLINER_OB_ARMATURE", 2),
    ("hand", "Hand", "The palm", "VIEW_PAN", 3),
    ("tool", "Tool", "What the hand holds, such as a racquet", "MOD_BEVEL", 4),
)
SIDES = (("right", "Right", "The right one"), ("left", "Left", "The left one"))
EITHER = (("either", "Either", "Whichever suits"), *SIDES)
BALLS = (
    ("football", "Football", "Size 5: measured drag, lift and bounce"),
    ("volleyball", "Volleyball", "Lighter, and slower in the air"), ("tennis", "Tennis Ball", "Small and fast"),
    ("paper", "As in the Paper", "Air takes 0.2 of the speed in a second, the bounce leaves 0.7, no spin"),
)
HOLDS = (
    ("KEEP", "As It Is", "The ball stays where it is beside the bone as it is taken"),
    ("TOUCH", "Touching", "The ball comes to touch the part: the palm, the foot, the brow"),
)


@dataclass(frozen=True, kw_only=True)
class Setting:
    """One row of the table.

    Args:
        name: of the field that code reads, unique in its group; kind: type of its value, None: that of the default;
            tuple: several texts.
        default: in code and, where option_more and panel_more have none, for users; None: not set.
        least, most: limits; where the default is outside, it stands for "not set". unit: as a word. expected: what an
            error says a number should be.
        choices: identifiers, or (identifier, title, sentence[, icon, number]) where panels list them.
        option: flags on the command line with blanks between, "" for none; help: its sentence; metavar: what stands for
            its value there, None: the unit where that is one word; option_more: further arguments of `add_argument`;
            `default`, `least`, `most` where they differ there.
        tooltip: of the property in Blender, "" for none; title: None for the name; identifier: "" for the name;
            precision: decimals; panel_more: further arguments of bpy's; `default`, `min`, `max` where they differ.
        in_preset: whether presets store it. tuning: the method under whose Fine Tuning the panel lists it, "any": under
            every one's; "" for none.
        blank: the choice that is "" in code; convert: from what a user said to the value that code reads.
        feature: set by the table.
    """

    name: str
    default: Any = None
    kind: type | None = None
    least: float | None = None
    most: float | None = None
    unit: str = ""
    expected: str = "{least} to {most} {unit}"
    choices: tuple = ()
    option: str = ""
    help: str | None = None
    metavar: str | None = None
    option_more: Mapping = field(default_factory=dict)
    title: str | None = None
    tooltip: str = ""
    identifier: str = ""
    precision: int | None = None
    panel_more: Mapping = field(default_factory=dict)
    in_preset: bool = False
    tuning: str = ""
    blank: str | None = None
    convert: Callable | None = None
    feature: str = ""

    def __post_init__(self):
        object.__setattr__(self, "kind", self.kind or type(self.default))
        object.__setattr__(self, "identifier", self.identifier or self.name)
        object.__setattr__(self, "title", self.title or self.name.replace("_", " ").title())

    @property
    def choice_names(self) -> tuple[str, ...]:
        """The identifiers of the choices."""
        return tuple(choice if isinstance(choice, str) else choice[0] for choice in self.choices)

    def limits_text(self, least: float, most: float) -> str:
        """What is expected of a number from least to most."""
        least, most = (str(limit) if isinstance(limit, int) else f"{limit:g}" for limit in (least, most))
        return self.expected.format(least=least, most=most, unit=self.unit).strip()

    def value(self, said):
        """What code reads where a user has said `said`; None where that stands for "not set"."""
        if self.kind is tuple and isinstance(said, str):
            said = [text.strip() for text in said.split(";") if text.strip()]
        if self.default is None and said == self.panel_more.get("default"):
            return None
        if self.blank is not None and said == self.blank:
            return ""
        found = tuple(said) if self.kind is tuple else said
        return self.convert(found) if self.convert else found


def add_fields(rows: Iterable[Setting]) -> Callable[[type], type]:
    """Make a class decorator, to stand under `dataclass`: a field for each of `rows` that the class does not spell out.

    The fields are marked as later ones: what was saved before there was the setting stays up to date."""

    def add(cls: type) -> type:
        for row in rows:
            if row.name not in cls.__annotations__:
                cls.__annotations__[row.name] = row.kind.__name__ if row.kind else "Any"
                setattr(cls, row.name, field(default=row.default, metadata=LATER))
        return cls

    return add


def check_limits(record: Any, rows: Iterable[Setting]) -> None:
    """Raises InputError where a number of the dataclass `record` is outside the limits that `rows` have for it; where
    the default is outside them too, the record checks for itself."""
    names = {one.name for one in fields(record)}
    for row in rows:
        if row.name in names and row.least is not None and row.least <= row.default:
            value = getattr(record, row.name)
            if not row.least <= value <= row.most:
                raise InputError(row.name, f"{value:g}", f"{row.least:g} to {row.most:g}")


def collect(record: type, rows: Iterable[Setting], said: Callable[[Setting], object]) -> dict[str, Any]:
    """The values of those fields of the dataclass `record` that `rows` have; `said` finds what the user said.
    What is not set is left out."""
    names = {one.name for one in fields(record)}
    found = {row.name: row.value(said(row)) for row in rows if row.name in names}
    return {name: value for name, value in found.items() if value is not None}
