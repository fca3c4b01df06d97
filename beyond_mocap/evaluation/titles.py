"""How pages show figures: name, unit and digits."""

from __future__ import annotations

from dataclasses import dataclass

from ..synthesis.quality.targets import Target


@dataclass(frozen=True)
class Title:
    """How pages show a figure.

    Attributes:
        text: name.
        unit: shown unit.
        scale: factor to it.
        digits: after the decimal point.
    """

    text: str
    unit: str = "/min"
    scale: float = 1.0
    digits: int = 1

    @property
    def name(self) -> str:
        """The text with its unit."""
        return f"{self.text}, {self.unit}" if self.unit else self.text

    def describe_target(self, target: Target | None) -> str:
        """Describe a target in the shown unit, such as "≤ 5.0"; "" without one."""
        limits = () if target is None else (("≥", target.least), ("≤", target.most))
        return " ".join(f"{sign} {self.scale * limit:.{self.digits}f}" for sign, limit in limits if limit is not None)
