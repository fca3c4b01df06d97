"""The fade of a motion that jumps from the end of a loop to its start: both stretches are blended around the jump.

Rotations, the place beside the path and the height are blended themselves; along the path the speed is blended, not the
place. Where a recording ends within a fade, the difference of both at its end is extrapolated and decays with the
remaining fade. A foot that only one stretch has in contact is not in contact while the fade moves it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..motion import quaternion
from ..synthesis.construct.transitions import blend_rotations, compute_blend_share
from .loops import Loop
from .path_frame import Residuals

_OWN_SHARE = 0.98  # a sole in contact in one stretch alone stays in contact while that one has at least this share
_EXTRAPOLATION_SECONDS = 0.08  # seconds after which an extrapolated difference no longer grows
_SLOPE_SECONDS = 0.03  # over which the slope of an extrapolated difference is measured


def fade_jump(residuals: Residuals, loop: Loop, reach: int) -> dict[str, np.ndarray]:
    """Blend the frames around a jump, from those around the loop's end to those around its start.

    Args:
        residuals: the motion.
        loop: the loop that the jump repeats.
        reach: frames on either side.
    Returns:
        Arrays by field name as in `list_rows`, (2 * reach, ...).
    """
    both = _JumpSides(len(residuals), loop, np.arange(-reach, reach), residuals.fps)
    after, incoming_share = both.around >= 0, both.incoming_share
    rows = list_rows(residuals)
    rows["turn"] = _compute_changes(rows["turn"])
    rotations, standing = rows.pop("rotations"), rows.pop("standing")
    out = {name: _blend_values(*both.sample_values(values), incoming_share) for name, values in rows.items()}
    ending, beginning = both.sample_rotations(rotations)
    own, other = (np.where(after[:, None, None], *pair) for pair in ((beginning, ending), (ending, beginning)))
    out["rotations"] = blend_rotations(own, np.arange(2 * reach), other, both.progress, after)
    out["standing"] = _blend_contacts(*both.sample_contacts(standing), incoming_share)
    out["step"] = fade_steps(residuals, loop, reach)
    return out


def fade_steps(residuals: Residuals, loop: Loop, reach: int) -> np.ndarray:
    """Compute the path length of each frame of a fade.

    The body's speed along the path is the weighted mean of both stretches' speeds, although its place in the moving
    frame is blended from one to the other.

    Args:
        residuals: the motion.
        loop: the loop that the jump repeats.
        reach: frames on either side.
    Returns:
        (2 * reach,) metres since the frame before.
    """
    both = _JumpSides(len(residuals), loop, np.arange(-reach, reach), residuals.fps)
    along = residuals.place[:, 0]
    body = _compute_changes(residuals.step) + _compute_changes(np.diff(along, prepend=along[0]))
    place = _blend_values(*both.sample_values(along), both.incoming_share)
    before = along[max(loop.end - reach - 1, 0)]
    return _blend_values(*both.sample_values(body), both.incoming_share) - np.diff(place, prepend=before)


def list_rows(residuals: Residuals) -> dict[str, np.ndarray]:
    """List every array of a motion that can be blended: all but its frame numbers.

    Args:
        residuals: the motion.
    Returns:
        Arrays by field name, one row a frame.
    """
    return {name: values for name, values in residuals.arrays.items() if name != "frames"}


def jump_window(loop: Loop, reach: int) -> np.ndarray:
    """Compute the unblended frames around a jump.

    Args:
        loop: the loop that the jump repeats.
        reach: frames on either side.
    Returns:
        (2 * reach,) frames: those before the loop's end, then those from its start.
    """
    around = np.arange(-reach, reach)
    return np.where(around < 0, loop.end, loop.start) + around


def _compute_changes(values: np.ndarray) -> np.ndarray:
    """Compute the changes (T,) since the frame before; the first repeats the second."""
    return np.concatenate([values[1:2], values[1:]])


def _compute_rotation_change(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Compute rotation vectors (..., 3) radians from rotations `before` to `after` (..., 4), in the frame of the
    former.
    """
    return quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(before), after))


def _blend_values(a: np.ndarray, b: np.ndarray, share_of_b: np.ndarray) -> np.ndarray:
    return a + share_of_b.reshape(-1, *[1] * (a.ndim - 1)) * (b - a)


def _blend_contacts(a: np.ndarray, b: np.ndarray, incoming_share: np.ndarray) -> np.ndarray:
    """Blend soles in contact (R, 2, 2): those of both stretches, and those of one while it has nearly the whole
    share.
    """
    incoming_share = incoming_share[:, None, None]
    return (a & b) | (a & (incoming_share <= 1.0 - _OWN_SHARE)) | (b & (incoming_share >= _OWN_SHARE))


@dataclass(frozen=True, eq=False)
class _JumpSides:
    """The two stretches around a jump, each extrapolated beyond the recording.

    Attributes:
        count: frames of the motion.
        loop: the loop that the jump repeats.
        around: (R,) frames relative to the jump.
        fps: frames per second.
    """

    count: int
    loop: Loop
    around: np.ndarray
    fps: float

    @property
    def progress(self) -> np.ndarray:
        """(R,) progress of the fade, from 0 to 1."""
        return (self.around - self.around[0]) / len(self.around)

    @property
    def incoming_share(self) -> np.ndarray:
        """(R,) share of the incoming stretch, which starts the loop."""
        after = self.around >= 0
        outgoing = compute_blend_share(self.progress, after)
        return np.where(after, 1.0 - outgoing, outgoing)

    @property
    def _recorded_range(self) -> tuple[int, int]:
        """First and last frame, relative to the jump, for which both stretches are recorded."""
        return -min(self.loop.start, -int(self.around[0])), min(self.count - 1 - self.loop.end, int(self.around[-1]))

    def _list_frames(self) -> tuple[np.ndarray, ...]:
        """Compute the frames (R,) of the outgoing and of the incoming stretch, limited to the motion."""
        return tuple(np.clip(at + self.around, 0, self.count - 1) for at in (self.loop.end, self.loop.start))

    def _extrapolate_differences(self, apart: np.ndarray, ending: np.ndarray, beginning: np.ndarray) -> np.ndarray:
        """Extrapolate the differences (R, ...) of both stretches beyond the recording.

        ending, beginning (S, ...): by how much they change in each of the S frames before and after the jump.
        """
        first, last = (edge - int(self.around[0]) for edge in self._recorded_range)
        over = max(int(round(_SLOPE_SECONDS * self.fps)), 1)
        whole, slope = last - first >= over, ending.mean(axis=0) - beginning.mean(axis=0)
        out, longest = apart.copy(), _EXTRAPOLATION_SECONDS * self.fps
        # Both sides: `edge` is the last recorded row, `inner` the one for the slope, `beyond` the rows to fill.
        for edge, inner, beyond in ((first, min(first + over, last), np.arange(first)),
                                    (last, max(last - over, first), np.arange(last + 1, len(apart)))):
            near = (apart[edge] - apart[inner]) / (edge - inner) if whole else slope
            far = np.sign(beyond - edge) * longest * (1.0 - np.exp(-np.abs(beyond - edge) / longest))
            out[beyond] = apart[edge] + far.reshape(-1, *[1] * (apart.ndim - 1)) * near
        return out

    @property
    def _edge_frames(self) -> tuple[np.ndarray, np.ndarray]:
        """The last frames (S,) before the jump and the first after it, whose changes are known without the other
        stretch.
        """
        over = max(int(round(_SLOPE_SECONDS * self.fps)), 1)
        return self.loop.end - np.arange(over), self.loop.start + 1 + np.arange(over)

    def sample_values(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sample values (R, ...) of the outgoing and of the incoming stretch."""
        ending, beginning = (np.asarray(values[at], dtype=float) for at in self._list_frames())
        if self._recorded_range == (self.around[0], self.around[-1]):
            return ending, beginning
        apart = self._extrapolate_differences(ending - beginning,
                                              *(values[at] - values[at - 1] for at in self._edge_frames))
        first, last = (edge - int(self.around[0]) for edge in self._recorded_range)
        ending[last + 1 :] = beginning[last + 1 :] + apart[last + 1 :]
        beginning[:first] = ending[:first] - apart[:first]
        return ending, beginning

    def sample_rotations(self, rotations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sample rotations (R, J, 4) of the outgoing and of the incoming stretch."""
        ending, beginning = (rotations[at].copy() for at in self._list_frames())
        if self._recorded_range == (self.around[0], self.around[-1]):
            return ending, beginning
        changes = (_compute_rotation_change(rotations[at - 1], rotations[at]) for at in self._edge_frames)
        turn = quaternion.from_rotation_vector(self._extrapolate_differences(_compute_rotation_change(beginning,
                ending), *changes))
        first, last = (edge - int(self.around[0]) for edge in self._recorded_range)
        ending[last + 1 :] = quaternion.multiply(beginning[last + 1 :], turn[last + 1 :])
        beginning[:first] = quaternion.multiply(ending[:first], quaternion.inverse(turn[:first]))
        return ending, beginning

    def sample_contacts(self, standing: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sample contacts (R, 2, 2) of both stretches; where one has no recording, those of the other."""
        ending, beginning = (standing[at].copy() for at in self._list_frames())
        first, last = (edge - int(self.around[0]) for edge in self._recorded_range)
        ending[last + 1 :], beginning[:first] = beginning[last + 1 :], ending[:first]
        return ending, beginning
