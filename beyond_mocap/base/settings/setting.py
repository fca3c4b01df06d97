"""One setting: its name, type, unit, default, limits and texts, shared by code, command line and panels."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from ..errors import InputError

BETWEEN = "between {least} and {most}"
WHOLE = "a whole number from {least} to {most}"
LATER = {"later": True}
"""Metadata of fields that were added after files had stored fingerprints of the other fields; with "was" where their
default has changed since: the value that files without them have."""
LATER_PART = {**LATER, "is_part": True}
"""Metadata of `LATER` fields that are left out of digests where they are empty: what lacks them keeps its digest."""
POSITIVE: dict[str, Any] = {"least": 1e-9, "most": 1e6, "unit": "metres", "expected": "a number from {least} to {most}"}

# Choices shared by settings of several features: identifier, title, tooltip[, icon, number].
PARTS = (
    ("foot", "Foot", "From ankle to toe", "MOD_DYNAMICPAINT", 0), ("head", "Head", "The middle of the head", "USER", 1),
    ("chest", "Chest", "The uppermost spine joint", "OUTLINER_OB_ARMATURE", 2),
    ("hand", "Hand", "The palm", "VIEW_PAN", 3),
    ("tool", "Tool", "An object in the hand, such as a racquet", "MOD_BEVEL", 4),
)
SIDES = (("right", "Right", "The right side"), ("left", "Left", "The left side"))
EITHER = (("either", "Either", "The side that fits better"), *SIDES)
BALLS = (
    ("football", "Football", "Size 5: measured drag, lift and bounce"),
    ("volleyball", "Volleyball", "Lighter, with more drag in the air"), ("tennis", "Tennis Ball", "Small and fast"),
    ("paper", "As in the Paper", "Drag takes 0.2 of the speed per second, a bounce keeps 0.7, without spin"),
)
HOLDS = (
    ("KEEP", "Keep Offset", "The ball keeps its current offset from the bone"),
    ("TOUCH", "Touching", "The ball moves into contact with the body part: palm, foot or forehead"),
)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Setting:
    """One row of the settings table.

    Attributes:
        name: name of the field that code reads, unique in its group.
        default: default in code and, unless `option_more` or `panel_more` has another, for users; None: not set.
        kind: type of the value; None: that of the default; tuple: several texts.
        least, most: limits, both included; a default outside them stands for "not set".
        unit: the unit as a word.
        expected: the text of errors for what a number should be, with {least}, {most} and {unit}.
        choices: identifiers, or (identifier, title, tooltip[, icon, number]) where panels list them.
        option: flags on the command line separated by blanks; "" for none.
        help: help text of the option.
        metavar: placeholder of the option's value; None: the unit if that is one word.
        option_more: further arguments of `add_argument`, and `default`, `least`, `most` where they differ there.
        title: label of the property; None for the name.
        tooltip: tooltip of the property in Blender; "" for none.
        identifier: identifier of the property; "" for the name.
        precision: decimals in a panel.
        panel_more: further arguments of the bpy property, and `default`, `min`, `max` where they differ there.
        in_preset: whether presets store it.
        methods: the methods of synthesis that use it, with blanks; "" for all.
        tuning: whether the panel lists it under Fine Tuning, for these methods.
        blank: the choice that is "" in code.
        convert: converts the user's value to the value that code reads.
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
    methods: str = ""
    tuning: bool = False
    blank: str | None = None
    convert: Callable | None = None

    def __post_init__(self):
        object.__setattr__(self, "kind", self.kind or type(self.default))
        object.__setattr__(self, "identifier", self.identifier or self.name)
        object.__setattr__(self, "title", self.title or self.name.replace("_", " ").title())

    @property
    def choice_names(self) -> tuple[str, ...]:
        """The identifiers of the choices."""
        return tuple(choice if isinstance(choice, str) else choice[0] for choice in self.choices)

    def is_used_by(self, method: str) -> bool:
        """Return whether a method of synthesis uses it."""
        return not self.methods or method in self.methods.split()

    def describe_limits(self, least: float, most: float) -> str:
        """Describe the expected range of a number.

        Args:
            least, most: the limits, both included.
        Returns:
            Text such as "0 to 2 metres".
        """
        least, most = (str(limit) if isinstance(limit, int) else f"{limit:g}" for limit in (least, most))
        return self.expected.format(least=least, most=most, unit=self.unit).strip()

    def convert_value(self, user_value):
        """Convert a user's value to the value that code reads.

        Args:
            user_value: the value of the option or property.
        Returns:
            The value; None where the user's value stands for "not set".
        """
        if self.kind is tuple and isinstance(user_value, str):
            user_value = [text.strip() for text in user_value.split(";") if text.strip()]
        if self.default is None and user_value == self.panel_more.get("default"):
            return None
        if self.blank is not None and user_value == self.blank:
            return ""
        value = tuple(user_value) if self.kind is tuple else user_value
        return self.convert(value) if self.convert else value


def add_fields(rows: Iterable[Setting]) -> Callable[[type], type]:
    """Build a class decorator, applied before `dataclass`, that adds a field for each setting.

    Fields that the class spells out stay as they are. The added ones are marked `LATER`: files that were saved before
    the setting existed stay up to date.

    Args:
        rows: the settings.
    Returns:
        The decorator.
    """

    def add(cls: type) -> type:
        for row in rows:
            if row.name not in cls.__annotations__:
                cls.__annotations__[row.name] = row.kind.__name__ if row.kind else "Any"
                setattr(cls, row.name, field(default=row.default, metadata=LATER))
        return cls

    return add


def check_limits(record: Any, rows: Iterable[Setting]) -> None:
    """Check the numbers of a dataclass against the limits of its settings.

    Where the default is outside the limits too, the dataclass has to check for itself.

    Args:
        record: the dataclass object.
        rows: the settings.
    Raises:
        InputError: if a number is outside its limits.
    """
    names = {one.name for one in fields(record)}
    for row in rows:
        if row.name in names and row.least is not None and row.least <= row.default:
            value = getattr(record, row.name)
            if not row.least <= value <= row.most:
                raise InputError(row.name, f"{value:g}", f"{row.least:g} to {row.most:g}")


def collect_values(record: type, rows: Iterable[Setting], read_value: Callable[[Setting], object]) -> dict[str, Any]:
    """Collect the values of the settings that are fields of a dataclass.

    Args:
        record: the dataclass.
        rows: the settings.
        read_value: returns the user's value of a setting.
    Returns:
        Field name -> value; settings that are not set are left out.
    """
    names = {one.name for one in fields(record)}
    values = {row.name: row.convert_value(read_value(row)) for row in rows if row.name in names}
    return {name: value for name, value in values.items() if value is not None}
