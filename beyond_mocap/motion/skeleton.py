"""A skeleton: named joints, parents before children, offsets in the rest pose where no joint is rotated."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace

import numpy as np

from ..base.digest import hex_digest
from ..base.errors import InputError


def freeze_array(values, dtype=float) -> np.ndarray:
    """Copy values into a read-only array; one that is read-only and owned by no writable array is returned as it is."""
    if isinstance(values, np.ndarray) and values.dtype == dtype and _is_frozen(values):
        return values
    out = np.array(values, dtype=dtype)
    out.setflags(write=False)
    return out


def _is_frozen(values: np.ndarray) -> bool:
    """Return whether an array and all its owners are read-only, and it keeps no larger one alive as a part of it."""
    owner = values
    while isinstance(owner, np.ndarray) and not owner.flags.writeable:
        if owner.base is None:
            return owner.size == values.size
        owner = owner.base
    return False


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Joints of one body.

    Attributes:
        names: J joint names.
        parents: J indices, -1 for the one root, which is joint 0; parents come before children.
        offsets: (J, 3) metres from the parent's joint to this one while no joint is rotated, Z up; the root's is zero.
        end_parents: E joints that carry a tip (BVH End Site).
        end_offsets: (E, 3) metres from those joints to their tips, which have no rotation of their own.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: np.ndarray
    end_parents: tuple[int, ...] = ()
    end_offsets: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))

    def __post_init__(self):
        object.__setattr__(self, "names", tuple(self.names))
        object.__setattr__(self, "parents", tuple(int(p) for p in self.parents))
        object.__setattr__(self, "end_parents", tuple(int(p) for p in self.end_parents))
        object.__setattr__(self, "offsets", freeze_array(self.offsets).reshape(-1, 3))
        object.__setattr__(self, "end_offsets", freeze_array(self.end_offsets).reshape(-1, 3))
        count = len(self.names)
        if not (count and len(self.parents) == len(self.offsets) == count):
            raise InputError("skeleton", f"{count} names, {len(self.parents)} parents, {len(self.offsets)} offsets",
                             "as many of each as joints, one or more")
        if self.parents[0] != -1 or any(not 0 <= p < i for i, p in enumerate(self.parents) if i):
            raise InputError("skeleton", "joints out of order", "one root first, then parents before children")
        if len(set(self.names)) != count:
            raise InputError("skeleton", "two joints with the same name", "unique joint names")

    def __len__(self) -> int:
        return len(self.names)

    def index(self, name: str) -> int:
        """Return the joint's index.

        Raises:
            InputError: if no joint has that name.
        """
        try:
            return self.names.index(name)
        except ValueError:
            raise InputError("skeleton", f"no joint {name!r}", f"one of {', '.join(self.names)}") from None

    def children(self, joint: int) -> tuple[int, ...]:
        """Return the indices of the joints that hang on `joint`."""
        return tuple(i for i, p in enumerate(self.parents) if p == joint)

    def tip_offset(self, joint: int) -> np.ndarray:
        """Return the vector from a joint to its first end site (3,) m, in the joint's own axes; zero where it has none.
        """
        return next((o for p, o in zip(self.end_parents, self.end_offsets) if p == joint), np.zeros(3))

    def select_joints(self, joints: Collection[int]) -> tuple["Skeleton", list[int]]:
        """Select joints and all above them.

        Args:
            joints: indices in this skeleton.
        Returns:
            A skeleton without tips, and the indices of its joints in this one.
        """
        found: set[int] = set()
        for joint in joints:
            while joint >= 0:
                found.add(joint)
                joint = self.parents[joint]
        selected = sorted(found)
        parents = [-1 if joint == 0 else selected.index(self.parents[joint]) for joint in selected]
        return Skeleton(tuple(self.names[joint] for joint in selected), tuple(parents),
                        self.offsets[selected]), selected

    def scale(self, factor: float) -> "Skeleton":
        """Return the skeleton of a body `factor` times as large."""
        return replace(self, offsets=self.offsets * factor, end_offsets=self.end_offsets * factor)

    def has_same_bones(self, other: "Skeleton", tolerance: float = 1e-3) -> bool:
        """Whether names, parents and offsets agree, offsets within `tolerance` metres."""
        return (
            self.names == other.names
            and self.parents == other.parents
            and bool(np.all(np.abs(self.offsets - other.offsets) <= tolerance))
        )

    @property
    def rest_positions(self) -> np.ndarray:
        """(J, 3) metres from the root, joint positions in the rest pose."""
        places = np.zeros((len(self), 3))
        for joint, parent in enumerate(self.parents):
            if parent >= 0:
                places[joint] = places[parent] + self.offsets[joint]
        return places

    @property
    def fingerprint(self) -> str:
        """A short hash of names, parents and offsets to a tenth of a millimetre."""
        parents, offsets = np.array(self.parents, np.int64), np.round(self.offsets * 1e4).astype(np.int64)
        return hex_digest("\n".join(self.names), parents, offsets)
