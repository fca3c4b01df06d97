"""One jump of a loop faded over: both stretches of the motion go on, and one gives way to the other by a quintic.

Rotations, the place beside the path and the height go over from the one's to the other's; of the way along the path the
speed is mixed, not the place. Where a recording ends within a fade, the difference of both at its end is carried on and
dies away with what is left of it. A sole that only one stretch sets down does not stand while the fade moves it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..motion import quaternion
from ..synthesis.construct.transitions import fade_share, faded_rotations
from .loops import Loop
from .path_frame import Residuals

_OWN_SHARE = 0.98  # a sole that stands in one stretch alone stands while that one has at least this share
_FURTHER = 0.08  # seconds after which a difference that is carried on no longer grows
_SLOPE_SECONDS = 0.03


def rows(residuals: Residuals) -> dict[str, np.ndarray]:
    """Every array of a motion that can be mixed: all but the numbers of its frames."""
    return {name: values for name, values in residuals.arrays.items() if name != "frames"}


def window(loop: Loop, reach: int) -> np.ndarray:
    """The frames (2 * reach,) that are shown around a jump where nothing is faded."""
    around = np.arange(-reach, reach)
    return np.where(around < 0, loop.end, loop.start) + around


def faded(residuals: Residuals, loop: Loop, reach: int) -> dict[str, np.ndarray]:
    """All `rows` of the 2 * reach frames around a jump, faded from the frames around the loop's end to those around its
    start."""
    both = _Stretches(len(residuals), loop, np.arange(-reach, reach), residuals.fps)
    after, come = both.around >= 0, both.come
    shown = rows(residuals)
    shown["turn"] = _since_before(shown["turn"])
    rotations, standing = shown.pop("rotations"), shown.pop("standing")
    out = {name: _mixed(*both.values(values), come) for name, values in shown.items()}
    ending, beginning = both.rotations(rotations)
    own, other = (np.where(after[:, None, None], *pair) for pair in ((beginning, ending), (ending, beginning)))
    out["rotations"] = faded_rotations(own, np.arange(2 * reach), other, both.through, after)
    out["standing"] = _standing(*both.labels(standing), come)
    out["step"] = faded_steps(residuals, loop, reach)
    return out


def faded_steps(residuals: Residuals, loop: Loop, reach: int) -> np.ndarray:
    """(2 * reach,) metres since the frame before, such that the body's speed along the path is the mean of both
    stretches' speeds although its place in the frame goes over from the one's to the other's."""
    both = _Stretches(len(residuals), loop, np.arange(-reach, reach), residuals.fps)
    along = residuals.place[:, 0]
    body = _since_before(residuals.step) + _since_before(np.diff(along, prepend=along[0]))
    place = _mixed(*both.values(along), both.come)
    before = along[max(loop.end - reach - 1, 0)]
    return _mixed(*both.values(body), both.come) - np.diff(place, prepend=before)


def _since_before(values: np.ndarray) -> np.ndarray:
    """Changes (T,) since the frame before, the first frame's guessed from the second's."""
    return np.concatenate([values[1:2], values[1:]])


def _turned(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Rotation vectors (..., 3) radians from rotations (..., 4) to others, as seen from the former."""
    return quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(before), after))


def _mixed(a: np.ndarray, b: np.ndarray, share_of_b: np.ndarray) -> np.ndarray:
    return a + share_of_b.reshape(-1, *[1] * (a.ndim - 1)) * (b - a)


def _standing(a: np.ndarray, b: np.ndarray, come: np.ndarray) -> np.ndarray:
    """Soles (R, 2, 2) that stand in a fade: those that do in both stretches, and in one while it hardly gives way."""
    come = come[:, None, None]
    return (a & b) | (a & (come <= 1.0 - _OWN_SHARE)) | (b & (come >= _OWN_SHARE))


@dataclass(frozen=True, eq=False)
class _Stretches:
    """The two stretches around a jump, each as far as the motion goes and carried on from there: around (R,) frames
    from the jump on."""

    count: int
    loop: Loop
    around: np.ndarray
    fps: float

    @property
    def through(self) -> np.ndarray:
        """(R,) how far the fade has come, from 0 to 1."""
        return (self.around - self.around[0]) / len(self.around)

    @property
    def come(self) -> np.ndarray:
        """(R,) share of the beginning stretch."""
        after = self.around >= 0
        given = fade_share(self.through, after)
        return np.where(after, 1.0 - given, given)

    @property
    def _known(self) -> tuple[int, int]:
        """First and last frame from the jump on of which both stretches have a recording."""
        return -min(self.loop.start, -int(self.around[0])), min(self.count - 1 - self.loop.end, int(self.around[-1]))

    def _places(self) -> tuple[np.ndarray, ...]:
        """Frames (R,) of the ending and of the beginning stretch, held at the motion's own ends."""
        return tuple(np.clip(at + self.around, 0, self.count - 1) for at in (self.loop.end, self.loop.start))

    def _carried(self, apart: np.ndarray, ending: np.ndarray, beginning: np.ndarray) -> np.ndarray:
        """Differences (R, ...) of both stretches with those beyond the recording carried on from its end; ending and
        beginning (S, ...): what they change by in each of the S frames before and after the jump."""
        first, last = (edge - int(self.around[0]) for edge in self._known)
        over = max(int(round(_SLOPE_SECONDS * self.fps)), 1)
        whole, slope = last - first >= over, ending.mean(axis=0) - beginning.mean(axis=0)
        out, longest = apart.copy(), _FURTHER * self.fps
        for edge, inner, beyond in (
            (first, min(first + over, last), np.arange(first)),
            (last, max(last - over, first), np.arange(last + 1, len(apart))),
        ):
            near = (apart[edge] - apart[inner]) / (edge - inner) if whole else slope
            far = np.sign(beyond - edge) * longest * (1.0 - np.exp(-np.abs(beyond - edge) / longest))
            out[beyond] = apart[edge] + far.reshape(-1, *[1] * (apart.ndim - 1)) * near
        return out

    @property
    def _changes(self) -> tuple[np.ndarray, np.ndarray]:
        """The last frames (S,) before the jump and the first after it, whose changes are known without the other's."""
        over = max(int(round(_SLOPE_SECONDS * self.fps)), 1)
        return self.loop.end - np.arange(over), self.loop.start + 1 + np.arange(over)

    def values(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values (R, ...) of the ending and of the beginning stretch."""
        ending, beginning = (np.asarray(values[at], dtype=float) for at in self._places())
        if self._known == (self.around[0], self.around[-1]):
            return ending, beginning
        apart = self._carried(ending - beginning, *(values[at] - values[at - 1] for at in self._changes))
        first, last = (edge - int(self.around[0]) for edge in self._known)
        ending[last + 1 :] = beginning[last + 1 :] + apart[last + 1 :]
        beginning[:first] = ending[:first] - apart[:first]
        return ending, beginning

    def rotations(self, rotations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rotations (R, J, 4) of the ending and of the beginning stretch."""
        ending, beginning = (rotations[at].copy() for at in self._places())
        if self._known == (self.around[0], self.around[-1]):
            return ending, beginning
        changes = (_turned(rotations[at - 1], rotations[at]) for at in self._changes)
        turn = quaternion.from_rotation_vector(self._carried(_turned(beginning, ending), *changes))
        first, last = (edge - int(self.around[0]) for edge in self._known)
        ending[last + 1 :] = quaternion.multiply(beginning[last + 1 :], turn[last + 1 :])
        beginning[:first] = quaternion.multiply(ending[:first], quaternion.inverse(turn[:first]))
        return ending, beginning

    def labels(self, standing: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Labels (R, 2, 2) of the ending and of the beginning stretch; where one has no recording, the other's."""
        ending, beginning = (standing[at].copy() for at in self._places())
        first, last = (edge - int(self.around[0]) for edge in self._known)
        ending[last + 1 :], beginning[:first] = beginning[last + 1 :], ending[:first]
        return ending, beginning
