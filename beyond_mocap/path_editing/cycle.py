"""Cycling: a stretch of the motion is repeated until a path is filled (Path editing §3.2.4).

The document jumps from the last frame to the first (eq. 4.5) and finds the result poor (§5.3). Here the motion starts
as recorded, jumps back at the end of a loop whose two ends look alike (`loops`), as often as needed, and ends as
recorded. The loops and their number are chosen so that the recorded end falls on the end of the path, with all strides
scaled: by at most MOST_SCALE where the motion ends differently from how it continues (it stops, it kicks), by at most
KEPT_SCALE where its end is a step like the others. Where that is impossible, the motion is cut while it moves steadily.

At each jump the two stretches are blended by a quintic for FADE_SECONDS on either side. Rotations, the place beside the
path and the height are blended themselves; along the path the speed is blended, not the place. Where a recording ends
within a fade, the difference of both at its end is extrapolated and decays with the remaining fade. A foot that only
one stretch has in contact is not in contact while the fade moves it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..base.errors import InputError
from ..motion import quaternion
from ..synthesis.construct.transitions import fade_share, faded_rotations
from .loops import Loop, find_loops, smooth_speed
from .path_frame import Residuals

FADE_SECONDS = 0.2
"""Half a fade, at most; a short loop has a fade of its own length."""
MOST_SCALE, KEPT_SCALE = 0.05, 0.009
"""Shares by which strides are scaled at most so that the motion's end falls on the path's: where that end matters, and
where the speed is to be kept."""
MOST_FRAMES = 108_000
"""An hour at 30 frames per second."""
SAME_LENGTH = 1e-3
"""Metres by which path and motion may differ and still count as equally long."""
SEEN = 0.35
"""Relative distance of a loop's ends above which the user gets a warning, and below which the end of the motion counts
as a step like the others."""
_ALSO_GOOD = (1.6, 0.02)  # cost limit of further loops: a factor on the lowest cost, and metres more
_KEEPS, _ALIKE = 3.0, 0.3  # weights of scaled strides, and of loops whose ends differ, against transitions
_CREEPS = 0.2  # m/s below which a motion stays in place
_OTHERS = 3  # repeats of a second loop beside the main one, at most

_OWN_SHARE = 0.98  # a sole in contact in one stretch alone stays in contact while that one has at least this share
_FURTHER = 0.08  # seconds after which an extrapolated difference no longer grows
_SLOPE_SECONDS = 0.03  # over which the slope of an extrapolated difference is measured


@dataclass(frozen=True, eq=False)
class Cycled:
    """A motion that is repeated to a given length.

    Attributes:
        residuals: of the repeated motion.
        transitions: (S,) its first frames after a jump.
        scale: length of its strides over those recorded.
        messages: for the user.
    """

    residuals: Residuals
    seams: np.ndarray
    scale: float = 1.0
    told: tuple[str, ...] = ()


def cycled(residuals: Residuals, length: float, loops: tuple[Loop, ...] | None = None) -> Cycled:
    """Repeat a motion until it has a given length; a motion that is long enough is returned as it is.

    Args:
        residuals: the motion relative to its own path.
        length: metres of the new path.
        loops: result of `find_loops`, for callers that keep it.
    Returns:
        The repeated motion, its transitions and messages.
    Raises:
        InputError: if the motion has no loop, or if the length is not a positive number.
    """
    if not np.isfinite(length) or length <= 0.0:
        raise InputError("path", f"is {length:g} m long", "a length above 0", "draw a longer path")
    own = float(residuals.step.sum())
    if abs(own - length) <= SAME_LENGTH:
        return Cycled(residuals, np.zeros(0, int))
    found = _good(residuals, find_loops(residuals) if loops is None else loops)
    most = KEPT_SCALE if found and found[0].ending <= SEEN else MOST_SCALE
    if length <= (1.0 + most) * own:
        scale = length / own if length >= (1.0 - most) * own else 1.0
        return Cycled(_scaled(residuals, scale), np.zeros(0, int), scale, _other_strides(scale))
    if not found:
        raise InputError("cycling", _why_not(residuals), "at least one whole stride", _NEXT_STEP)
    return _filled(residuals, found, length, most)


def _filled(residuals: Residuals, loops: tuple[Loop, ...], wanted: float, most: float) -> Cycled:
    """Repeat the motion with as many jumps as `target` metres need."""
    own = float(residuals.step.sum())
    length = min(wanted, _longest(residuals, loops[0], own))
    exact = _exact_end(loops, own, length, most)
    jumps = exact or _steady(residuals, loops, own, length)
    shown, seams = _jumped(residuals, jumps)
    told = _seen(jumps)
    if length < wanted:
        minutes = len(shown) / residuals.fps / 60.0
        ends = f"the motion ends after {minutes:.0f} minutes and {length:.0f} m"
        told += (f"the path of {wanted:.0f} m is too long: {ends}",)
    if exact:
        scale = length / float(shown.step.sum())
        return Cycled(_scaled(shown, scale), seams, scale, (*told, *_other_strides(scale)))
    # No exact end: cut at the nearest frame, with strides scaled if that is hardly visible.
    arc = np.cumsum(shown.step)
    count = int(np.argmin(np.abs(arc - length))) + 1
    scale = length / float(arc[count - 1])
    if abs(scale - 1.0) > KEPT_SCALE:
        count, scale = int(np.searchsorted(arc, length + SAME_LENGTH, side="right")), 1.0
    shown = _scaled(shown.rows(slice(count)), scale)
    return Cycled(shown, seams[seams < count], scale, (*told, *_cut(loops[0])))


def _scaled(residuals: Residuals, scale: float) -> Residuals:
    return residuals if scale == 1.0 else residuals.changed(step=residuals.step * scale)


_NEXT_STEP = "switch cycling off, choose a clip that walks or runs for two strides, or shorten the path"


def _why_not(residuals: Residuals) -> str:
    metres, seconds = float(residuals.step.sum()), len(residuals) / residuals.fps
    if metres < _CREEPS * seconds or not (smooth_speed(residuals) > _CREEPS).any():
        return f"the motion stays in place ({metres:.2f} m in {seconds:.1f} s)"
    return f"no part of the motion ({metres:.2f} m, {seconds:.1f} s) can be repeated"


def _seen(loops: tuple[Loop, ...]) -> tuple[str, ...]:
    unlike = max(loop.unlike for loop in loops)
    if unlike <= SEEN:
        return ()
    return (f"no two strides of the motion are alike: at its transitions, poses differ by {100 * unlike:.0f} %",)


def _other_strides(scale: float) -> tuple[str, ...]:
    if abs(scale - 1.0) <= KEPT_SCALE + 1e-3:
        return ()
    word = "longer" if scale > 1.0 else "shorter"
    return (f"strides are {100 * abs(scale - 1.0):.1f} % {word}, so that the motion ends with the path",)


def _cut(loop: Loop) -> tuple[str, ...]:
    if loop.ending <= SEEN:
        return ()
    return ("no repetition of loops ends with the recorded end at the path's end: the motion is cut there",)


def _good(residuals: Residuals, loops: tuple[Loop, ...]) -> tuple[Loop, ...]:
    """Select the loops nearly as good as the best, without those that do not move, with their length after fading."""
    loops = tuple(loop for loop in loops if loop.metres > 0.1)
    most = _ALSO_GOOD[0] * loops[0].cost + _ALSO_GOOD[1] if loops else 0.0
    return tuple(_as_long_as_faded(residuals, loop) for loop in loops if loop.cost <= most)


def _as_long_as_faded(residuals: Residuals, loop: Loop) -> Loop:
    reach = _reach(residuals, (loop,))
    own = residuals.step[np.clip(jump_window(loop, reach), 1, len(residuals) - 1)]
    return replace(loop, metres=loop.metres + float(fade_steps(residuals, loop, reach).sum() - own.sum()))


def _exact_end(loops: tuple[Loop, ...], own: float, length: float, most: float) -> tuple[Loop, ...]:
    """Find the jumps with which the motion's own end falls on the path's; () if strides would scale by more than
    `most`.
    """
    best, least = (), np.inf
    for main in loops:
        for other in loops:
            # `other` runs `times` times; then `main` fills the rest, rounded down or up.
            for times in range(_OTHERS + 1 if other is not main else 1):
                more = length - own - times * other.metres
                around = more / main.metres
                for count in {max(int(np.floor(around)), 0), max(int(np.ceil(around)), 0)}:
                    jumps = _ordered(main, count, other, times)
                    scale = length / (own + count * main.metres + times * other.metres)
                    if not jumps or abs(scale - 1.0) > most:
                        continue
                    rating = _rating(jumps, scale, loops[0].cost)
                    if rating < least - 1e-12:
                        best, least = jumps, rating
    return best


def _rating(jumps: tuple[Loop, ...], scale: float, best: float) -> float:
    """Rate a plan, lower is better: scaled strides, many jumps and visible jumps count against it."""
    strides = sum(loop.strides for loop in jumps)
    worse = sum(loop.cost for loop in jumps) / len(jumps) / max(best, 1e-6) - 1.0
    return _KEEPS * abs(scale - 1.0) / MOST_SCALE + len(jumps) / max(strides, 1.0) + _ALIKE * worse


def _ordered(main: Loop, count: int, other: Loop, times: int) -> tuple[Loop, ...]:
    """Order `count` jumps of `main` and `times` of `other` so that they can be played; () if no order can."""
    if not count or not times:
        return (main,) * count + (other,) * times
    for first, second in (((main, count), (other, times)), ((other, times), (main, count))):
        if second[0].end - first[0].start >= min(len(first[0]), len(second[0])):
            return (first[0],) * first[1] + (second[0],) * second[1]
    return ()


def _steady(residuals: Residuals, loops: tuple[Loop, ...], own: float, length: float) -> tuple[Loop, ...]:
    """Choose one loop, repeated until the path's end falls into it or before it, so that no stop is cut in the middle.

    A motion that ends as it continues is repeated until it is long enough.
    """
    loop = min(loops, key=lambda loop: _rating((loop,), 1.0, loops[0].cost))
    outro = float(residuals.step[loop.end + 1 :].sum()) if loop.ending > SEEN else 0.0
    return (loop,) * max(int(np.ceil((length - own + outro) / loop.metres)), 1)


def _longest(residuals: Residuals, loop: Loop, own: float) -> float:
    """Compute the metres that MOST_FRAMES cover."""
    return own + max((MOST_FRAMES - len(residuals)) // len(loop), 1) * loop.metres


def _jumped(residuals: Residuals, jumps: tuple[Loop, ...]) -> tuple[Residuals, np.ndarray]:
    """Apply all jumps with their fades; return the motion and its transitions (S,).

    Each jump over the same loop has the same fade, so that it is computed once: frames come from the motion, followed
    by one fade for each kind of loop.
    """
    count, kinds = len(residuals), list(dict.fromkeys(jumps))
    reach = _reach(residuals, jumps)
    begins = [0] + [loop.start for loop in jumps]
    ends = [loop.end for loop in jumps] + [count]
    # `taken` (N,) is the row of each output frame: 0 .. count - 1 in the motion, then 2 * reach rows of each fade.
    taken = np.concatenate([np.arange(a, b) for a, b in zip(begins, ends)])
    seams = np.cumsum([b - a for a, b in zip(begins, ends)])[:-1]
    parts = {name: [values] for name, values in list_rows(residuals).items()}
    for loop in kinds:
        for name, values in fade_jump(residuals, loop, reach).items():
            parts[name].append(values)
    kind = np.array([kinds.index(loop) for loop in jumps])
    around = np.arange(-reach, reach)
    taken[seams[:, None] + around] = count + kind[:, None] * 2 * reach + around + reach
    source = np.concatenate([np.arange(count), *(jump_window(loop, reach) for loop in kinds)])
    values = {name: np.concatenate(each)[taken] for name, each in parts.items()}
    values["frames"] = residuals.frames[source[taken]]
    return residuals.changed(**values), seams


def _reach(residuals: Residuals, jumps: tuple[Loop, ...]) -> int:
    """Compute the frames of a fade on either side, so that no two fades overlap."""
    pieces = [jumps[0].end] + [b.end - a.start for a, b in zip(jumps[:-1], jumps[1:])]
    pieces.append(len(residuals) - jumps[-1].start)
    return max(min(int(round(FADE_SECONDS * residuals.fps)), min(pieces) // 2), 1)


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


def fade_jump(residuals: Residuals, loop: Loop, reach: int) -> dict[str, np.ndarray]:
    """Blend the frames around a jump, from those around the loop's end to those around its start.

    Args:
        residuals: the motion.
        loop: the loop that the jump repeats.
        reach: frames on either side.
    Returns:
        Arrays by field name as in `list_rows`, (2 * reach, ...).
    """
    both = _Stretches(len(residuals), loop, np.arange(-reach, reach), residuals.fps)
    after, come = both.around >= 0, both.come
    shown = list_rows(residuals)
    shown["turn"] = _since_before(shown["turn"])
    rotations, standing = shown.pop("rotations"), shown.pop("standing")
    out = {name: _mixed(*both.values(values), come) for name, values in shown.items()}
    ending, beginning = both.rotations(rotations)
    own, other = (np.where(after[:, None, None], *pair) for pair in ((beginning, ending), (ending, beginning)))
    out["rotations"] = faded_rotations(own, np.arange(2 * reach), other, both.through, after)
    out["standing"] = _standing(*both.labels(standing), come)
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
    both = _Stretches(len(residuals), loop, np.arange(-reach, reach), residuals.fps)
    along = residuals.place[:, 0]
    body = _since_before(residuals.step) + _since_before(np.diff(along, prepend=along[0]))
    place = _mixed(*both.values(along), both.come)
    before = along[max(loop.end - reach - 1, 0)]
    return _mixed(*both.values(body), both.come) - np.diff(place, prepend=before)


def _since_before(values: np.ndarray) -> np.ndarray:
    """Compute the changes (T,) since the frame before; the first repeats the second."""
    return np.concatenate([values[1:2], values[1:]])


def _turned(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Compute rotation vectors (..., 3) radians from rotations `before` to `after` (..., 4), in the frame of the
    former.
    """
    return quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(before), after))


def _mixed(a: np.ndarray, b: np.ndarray, share_of_b: np.ndarray) -> np.ndarray:
    return a + share_of_b.reshape(-1, *[1] * (a.ndim - 1)) * (b - a)


def _standing(a: np.ndarray, b: np.ndarray, come: np.ndarray) -> np.ndarray:
    """Blend soles in contact (R, 2, 2): those of both stretches, and those of one while it has nearly the whole
    share.
    """
    come = come[:, None, None]
    return (a & b) | (a & (come <= 1.0 - _OWN_SHARE)) | (b & (come >= _OWN_SHARE))


@dataclass(frozen=True, eq=False)
class _Stretches:
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
    def through(self) -> np.ndarray:
        """(R,) progress of the fade, from 0 to 1."""
        return (self.around - self.around[0]) / len(self.around)

    @property
    def come(self) -> np.ndarray:
        """(R,) share of the incoming stretch, which starts the loop."""
        after = self.around >= 0
        given = fade_share(self.through, after)
        return np.where(after, 1.0 - given, given)

    @property
    def _known(self) -> tuple[int, int]:
        """First and last frame, relative to the jump, for which both stretches are recorded."""
        return -min(self.loop.start, -int(self.around[0])), min(self.count - 1 - self.loop.end, int(self.around[-1]))

    def _places(self) -> tuple[np.ndarray, ...]:
        """Compute the frames (R,) of the outgoing and of the incoming stretch, limited to the motion."""
        return tuple(np.clip(at + self.around, 0, self.count - 1) for at in (self.loop.end, self.loop.start))

    def _carried(self, apart: np.ndarray, ending: np.ndarray, beginning: np.ndarray) -> np.ndarray:
        """Extrapolate the differences (R, ...) of both stretches beyond the recording.

        ending, beginning (S, ...): by how much they change in each of the S frames before and after the jump.
        """
        first, last = (edge - int(self.around[0]) for edge in self._known)
        over = max(int(round(_SLOPE_SECONDS * self.fps)), 1)
        whole, slope = last - first >= over, ending.mean(axis=0) - beginning.mean(axis=0)
        out, longest = apart.copy(), _FURTHER * self.fps
        # Both sides: `edge` is the last recorded row, `inner` the one for the slope, `beyond` the rows to fill.
        for edge, inner, beyond in ((first, min(first + over, last), np.arange(first)),
                                    (last, max(last - over, first), np.arange(last + 1, len(apart)))):
            near = (apart[edge] - apart[inner]) / (edge - inner) if whole else slope
            far = np.sign(beyond - edge) * longest * (1.0 - np.exp(-np.abs(beyond - edge) / longest))
            out[beyond] = apart[edge] + far.reshape(-1, *[1] * (apart.ndim - 1)) * near
        return out

    @property
    def _changes(self) -> tuple[np.ndarray, np.ndarray]:
        """The last frames (S,) before the jump and the first after it, whose changes are known without the other
        stretch.
        """
        over = max(int(round(_SLOPE_SECONDS * self.fps)), 1)
        return self.loop.end - np.arange(over), self.loop.start + 1 + np.arange(over)

    def values(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sample values (R, ...) of the outgoing and of the incoming stretch."""
        ending, beginning = (np.asarray(values[at], dtype=float) for at in self._places())
        if self._known == (self.around[0], self.around[-1]):
            return ending, beginning
        apart = self._carried(ending - beginning, *(values[at] - values[at - 1] for at in self._changes))
        first, last = (edge - int(self.around[0]) for edge in self._known)
        ending[last + 1 :] = beginning[last + 1 :] + apart[last + 1 :]
        beginning[:first] = ending[:first] - apart[:first]
        return ending, beginning

    def rotations(self, rotations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sample rotations (R, J, 4) of the outgoing and of the incoming stretch."""
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
        """Sample contacts (R, 2, 2) of both stretches; where one has no recording, those of the other."""
        ending, beginning = (standing[at].copy() for at in self._places())
        first, last = (edge - int(self.around[0]) for edge in self._known)
        ending[last + 1 :], beginning[:first] = beginning[last + 1 :], ending[:first]
        return ending, beginning
