"""Arms of a library's recordings, kept out of the trunk of the body that is shown (`appearance.arm_clearance`).

Recordings on the library's own skeleton hardly need it: 0.02 % of their frames have an arm inside. Recordings of other
performers do once they are on this skeleton: their trunk was slimmer or their upper arms were shorter. A clip that is
corrected here, once, is corrected wherever it is played.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..appearance.arm_clearance import clear_arms, measure_arm_depth
from ..appearance.trunk import build_trunk
from ..base.errors import format_count
from ..motion.motion import Motion, forward_kinematics
from ..motion.retargeting.neutral import build_neutral_stance
from .synthetic_clips import sample_each_second


class ArmRepair:
    """Clears the arms of clips, and remembers how deep they were.

    Attributes:
        depths: m, of each clip with an arm inside: how deep.
    """

    def __init__(self, motions: Iterable[Motion]):
        """Build the body of the library.

        Args:
            motions: all its recordings, on its skeleton.
        """
        example = sample_each_second(motions)
        self._trunk = build_trunk(build_neutral_stance(example.skeleton, example))
        self.depths: list[float] = []

    def clear(self, motion: Motion) -> Motion:
        """Return the motion with its arms outside the trunk."""
        cleared = clear_arms(motion, self._trunk)
        if cleared is not motion:
            depth = measure_arm_depth(motion.skeleton, *forward_kinematics(motion), self._trunk).max()
            self.depths += [float(depth)] if depth > 0.0 else []
        return cleared

    def describe(self) -> list[str]:
        """Describe what was changed: one line, or none."""
        if not self.depths:
            return []
        return [f"arms moved out of the trunk in {format_count(len(self.depths), 'clip')}, where they were up to "
                f"{100 * np.max(self.depths):.0f} cm inside"]
