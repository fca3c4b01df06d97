"""A motion made to go on: a stretch of it shown again and again until a path is filled (Path editing §3.2.4).

The document jumps from the last frame to the first (eq. 4.5) and finds the result poor (§5.3). Here the motion begins as
recorded, jumps back at the end of a loop whose two ends look alike (`loops`), as often as it takes, and ends as recorded.
At each jump both stretches go on for FADE_SECONDS on either side and one gives way to the other by a quintic
(`cross_fade`): rotations, place beside the path and height; the speed over the ground is mixed, not the place along
the path. Where a recording ends within a fade, the difference of both at its end is carried on and dies away.

How often, and over which loop, is chosen so that the recorded end falls on the end of the path, with all strides made
longer or shorter by at most MOST_SCALE; where that cannot be, the motion is cut while it goes on steadily.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..motion import quaternion
from .cross_fade import faded_rotations, share
from .loops import Loop, find_loops, smooth_speed
from .path_frame import Residuals

FADE_SECONDS = 0.2
"""Half a fade, at most; a short loop is faded over its own length."""

MOST_SCALE = 0.05
"""Share by which strides are made longer or shorter so that the motion's end falls on the path's."""

MOST_FRAMES = 108_000
"""An hour at 30 frames per second."""

SAME_LENGTH = 1e-3
"""Metres that path and motion may differ and count as of one length."""

SEEN = 0.35
"""How unlike a loop's ends may be without being told."""

_OWN_SHARE = 0.98  # a sole that stands in one stretch alone stands while that one has at least this share
_FURTHER = 0.08  # seconds after which a difference that is carried on no longer grows
_SLOPE_SECONDS = 0.03
_ALSO_GOOD = (1.6, 0.02)  # loops that cost at most so many times the best one's, and metres more, may be taken too
_OTHERS = 3  # times that another loop than the main one is run through, at most


@dataclass(frozen=True, eq=False)
class Cycled:
    """residuals: the motion that goes on; seams (S,): its frames that are the first after a jump; scale: how much longer
    its strides are than recorded; told: lines for the user."""

    residuals: Residuals
    seams: np.ndarray
    scale: float = 1.0
    told: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Plan:
    """Jumps from frame `end` to frame `start` of a loop, in order; ends: whether strides are scaled so that the motion's
    own end falls on the path's."""

    jumps: tuple[Loop, ...]
    ends: bool


def cycled(residuals: Residuals, length: float, loops: tuple[Loop, ...] | None = None) -> Cycled:
    """The motion repeated until it is `length` metres long; it is returned as it is where it is so long already.

    loops: what `find_loops` found, for callers that keep it. Raises InputError for a motion that has no loop and for a
    length that is no length.
    """
    if not np.isfinite(length) or length <= 0.0:
        raise InputError("path", f"{length:g} m long", "a length above 0", "draw a longer path")
    own = float(residuals.step.sum())
    if own >= length - SAME_LENGTH or length <= (1.0 + MOST_SCALE) * own:
        return _stretched(residuals, length, own)
    found = _good(find_loops(residuals) if loops is None else loops)
    if not found:
        raise InputError("cycling", _why_not(residuals), "at least one whole stride", _NEXT_STEP)
    wanted, length = length, min(length, _longest(residuals, found[0], own))
    plan = _exact_end(found, own, length) or _steady(residuals, found, own, length)
    shown, seams = _jumped(residuals, plan.jumps)
    told = _seen(plan.jumps)
    if length < wanted:
        minutes = len(shown) / residuals.fps / 60.0
        told += (f"the path is {wanted:.0f} m long: the motion ends after {minutes:.0f} minutes and {length:.0f} m of it",)
    if plan.ends:
        scale = length / float(shown.step.sum())
        return Cycled(shown.changed(step=shown.step * scale), seams, scale, told)
    count = int(np.searchsorted(np.cumsum(shown.step), length + SAME_LENGTH, side="right"))
    if count < len(shown):
        told += ("no number of loops brings the motion's own end to the path's end: it is cut there",)
    return Cycled(shown.rows(slice(count)), seams[seams < count], 1.0, told)


_NEXT_STEP = "switch cycling off, take a clip that walks or runs for two strides, or shorten the path"


def _stretched(residuals: Residuals, length: float, own: float) -> Cycled:
    """A motion about as long as the path, or longer: its strides scaled where that lets its end fall on the path's."""
    scale = length / own if own > 0.0 else 1.0
    if abs(own - length) <= SAME_LENGTH or scale < 1.0 - MOST_SCALE:
        return Cycled(residuals, np.zeros(0, int))
    return Cycled(residuals.changed(step=residuals.step * scale), np.zeros(0, int), scale)


def _why_not(residuals: Residuals) -> str:
    metres, seconds = float(residuals.step.sum()), len(residuals) / residuals.fps
    if metres < 0.3 or not (smooth_speed(residuals) > 0.2).any():
        return f"the motion stays where it is ({metres:.2f} m in {seconds:.1f} s)"
    return f"no stretch of the motion ({metres:.2f} m, {seconds:.1f} s) can be repeated"


def _seen(jumps: tuple[Loop, ...]) -> tuple[str, ...]:
    unlike = max(loop.unlike for loop in jumps)
    if unlike <= SEEN:
        return ()
    return (f"no two strides of the motion are alike: where it is repeated, poses are {100 * unlike:.0f} % apart",)


def _good(loops: tuple[Loop, ...]) -> tuple[Loop, ...]:
    """The loops that are nearly as good as the best, without those that lead nowhere."""
    loops = tuple(loop for loop in loops if loop.metres > 0.1)
    most = _ALSO_GOOD[0] * loops[0].cost + _ALSO_GOOD[1] if loops else 0.0
    return tuple(loop for loop in loops if loop.cost <= most)


def _exact_end(loops: tuple[Loop, ...], own: float, length: float) -> _Plan | None:
    """The jumps with which the motion's own end falls on the path's, or None where no strides within MOST_SCALE do it."""
    best, least = None, np.inf
    for main in loops:
        for other in loops:
            for times in range(_OTHERS + 1 if other is not main else 1):
                more = length - own - times * other.metres
                around = more / main.metres
                for count in {max(int(np.floor(around)), 0), max(int(np.ceil(around)), 0)}:
                    jumps = _ordered(main, count, other, times)
                    scale = length / (own + count * main.metres + times * other.metres)
                    if not jumps or abs(scale - 1.0) > MOST_SCALE:
                        continue
                    rating = _rating(jumps, scale, loops[0].cost)
                    if rating < least - 1e-12:
                        best, least = _Plan(jumps, True), rating
    return best


def _rating(jumps: tuple[Loop, ...], scale: float, best: float) -> float:
    """What speaks against a plan: strides of another length, many jumps, jumps that are seen."""
    strides = sum(loop.strides for loop in jumps)
    worse = sum(loop.cost for loop in jumps) / len(jumps) / max(best, 1e-6) - 1.0
    return abs(scale - 1.0) / MOST_SCALE + len(jumps) / max(strides, 1.0) + worse


def _ordered(main: Loop, count: int, other: Loop, times: int) -> tuple[Loop, ...]:
    """`main` run through `count` times and `other` `times` times, in an order that can be shown; () where none can."""
    if not count or not times:
        return (main,) * count + (other,) * times
    for first, second in (((main, count), (other, times)), ((other, times), (main, count))):
        if second[0].end - first[0].start >= min(len(first[0]), len(second[0])):
            return (first[0],) * first[1] + (second[0],) * second[1]
    return ()


def _steady(residuals: Residuals, loops: tuple[Loop, ...], own: float, length: float) -> _Plan:
    """The best loop until the path's end falls into it or before it, so that nobody is cut in the middle of stopping."""
    loop = loops[0]
    outro = float(residuals.step[loop.end + 1 :].sum())
    return _Plan((loop,) * max(int(np.ceil((length - own + outro) / loop.metres)), 1), False)


def _longest(residuals: Residuals, loop: Loop, own: float) -> float:
    """Metres that MOST_FRAMES are good for."""
    return own + max((MOST_FRAMES - len(residuals)) // len(loop), 1) * loop.metres


def _jumped(residuals: Residuals, jumps: tuple[Loop, ...]) -> tuple[Residuals, np.ndarray]:
    """The motion with all jumps made and faded over, and its seams (S,).

    Every jump over one loop is faded alike, so that it is worked out once: the frames are taken from the motion with
    one fade for each loop behind it.
    """
    count, kinds = len(residuals), list(dict.fromkeys(jumps))
    reach = _reach(residuals, jumps)
    begins = [0] + [loop.start for loop in jumps]
    ends = [loop.end for loop in jumps] + [count]
    taken = np.concatenate([np.arange(a, b) for a, b in zip(begins, ends)])
    seams = np.cumsum([b - a for a, b in zip(begins, ends)])[:-1]
    shown = {name: [values] for name, values in _rows(residuals).items()}
    for loop in kinds:
        for name, values in _faded(residuals, loop, reach).items():
            shown[name].append(values)
    kind = np.array([kinds.index(loop) for loop in jumps])
    window = np.arange(-reach, reach)
    source = np.arange(count)
    source = np.concatenate([source, *([np.r_[loop.end + window[:reach], loop.start + window[reach:]] for loop in kinds])])
    taken[seams[:, None] + window] = count + kind[:, None] * 2 * reach + window + reach
    values = {name: np.concatenate(parts)[taken] for name, parts in shown.items()}
    values["frames"] = residuals.frames[source[taken]]
    return residuals.changed(**values), seams


def _reach(residuals: Residuals, jumps: tuple[Loop, ...]) -> int:
    """Frames of a fade on either side, so many that no two fades meet."""
    pieces = [jumps[0].end] + [b.end - a.start for a, b in zip(jumps[:-1], jumps[1:])]
    pieces.append(len(residuals) - jumps[-1].start)
    return max(min(int(round(FADE_SECONDS * residuals.fps)), min(pieces) // 2), 1)


def _rows(residuals: Residuals) -> dict[str, np.ndarray]:
    """Everything but the numbers of the frames, which cannot be mixed."""
    return {name: values for name, values in residuals.arrays.items() if name != "frames"}


def _faded(residuals: Residuals, loop: Loop, reach: int) -> dict[str, np.ndarray]:
    """Every row of the 2 * reach frames around a jump, faded from the frames around the loop's end to those around its
    start."""
    window = np.arange(-reach, reach)
    after = window >= 0
    through = (window + reach) / (2.0 * reach)
    come = np.where(after, 1.0 - share(through, after), share(through, after))
    both = _Both(len(residuals), loop, window, residuals.fps)
    rows = _rows(residuals)
    for name in ("step", "turn"):
        rows[name] = _since_before(rows[name])
    rotations, standing = rows.pop("rotations"), rows.pop("standing")
    out = {name: _mixed(*both.values(values), come) for name, values in rows.items()}
    ending, beginning = both.rotations(rotations)
    own, other = (np.where(after[:, None, None], *pair) for pair in ((beginning, ending), (ending, beginning)))
    out["rotations"] = faded_rotations(own, np.arange(len(window)), other, through, after)
    out["standing"] = _standing(*both.labels(standing), come)
    out["step"] = out["step"] + _along(rows["place"], out["place"], both, come)
    return out


def _turned(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Rotation vectors (..., 3) radians from rotations (..., 4) to others, as seen from the former."""
    return quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(before), after))


def _since_before(values: np.ndarray) -> np.ndarray:
    """Changes (T,) since the frame before, the first frame's guessed from the second's."""
    return np.concatenate([values[1:2], values[1:]])


def _mixed(a: np.ndarray, b: np.ndarray, share_of_b: np.ndarray) -> np.ndarray:
    return a + share_of_b.reshape(-1, *[1] * (a.ndim - 1)) * (b - a)


def _along(place: np.ndarray, faded: np.ndarray, both: _Both, come: np.ndarray) -> np.ndarray:
    """(R,) metres to add to the steps, so that the body's speed along the path is the mean of both stretches' speeds
    although the place in the frame goes over from the one's to the other's."""
    moved = _since_before(np.diff(place[:, 0], prepend=place[0, 0]))
    wanted = _mixed(*both.values(moved), come)
    before = place[max(both.loop.end + both.window[0] - 1, 0), 0]
    return wanted - np.diff(faded[:, 0], prepend=before)


def _standing(a: np.ndarray, b: np.ndarray, come: np.ndarray) -> np.ndarray:
    """Soles (R, 2, 2) that stand in a fade: those that do in both stretches, and in one while it hardly gives way."""
    come = come[:, None, None]
    return (a & b) | (a & (come <= 1.0 - _OWN_SHARE)) | (b & (come >= _OWN_SHARE))


@dataclass(frozen=True, eq=False)
class _Both:
    """The two stretches around a jump, each as far as the motion goes and carried on from there: window (R,) frames from
    the jump on."""

    count: int
    loop: Loop
    window: np.ndarray
    fps: float

    @property
    def _known(self) -> tuple[int, int]:
        """First and last frame from the jump on of which both stretches have a recording."""
        return -min(self.loop.start, -int(self.window[0])), min(self.count - 1 - self.loop.end, int(self.window[-1]))

    def _places(self) -> tuple[np.ndarray, np.ndarray]:
        """Frames (R,) of the ending and of the beginning stretch, held at the motion's own ends."""
        return tuple(np.clip(at + self.window, 0, self.count - 1) for at in (self.loop.end, self.loop.start))

    def _carried(self, apart: np.ndarray, ending: np.ndarray, beginning: np.ndarray) -> np.ndarray:
        """Differences (R, ...) of both stretches with those beyond the recording carried on from its end; ending and
        beginning (S, ...): what they change by in each of the S frames before and after the jump."""
        first, last = (edge - int(self.window[0]) for edge in self._known)
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
        if self._known == (self.window[0], self.window[-1]):
            return ending, beginning
        apart = self._carried(ending - beginning, *(values[at] - values[at - 1] for at in self._changes))
        first, last = (edge - int(self.window[0]) for edge in self._known)
        ending[last + 1 :] = beginning[last + 1 :] + apart[last + 1 :]
        beginning[:first] = ending[:first] - apart[:first]
        return ending, beginning

    def rotations(self, rotations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rotations (R, J, 4) of the ending and of the beginning stretch."""
        ending, beginning = (rotations[at].copy() for at in self._places())
        if self._known == (self.window[0], self.window[-1]):
            return ending, beginning
        changes = (_turned(rotations[at - 1], rotations[at]) for at in self._changes)
        turn = quaternion.from_rotation_vector(self._carried(_turned(beginning, ending), *changes))
        first, last = (edge - int(self.window[0]) for edge in self._known)
        ending[last + 1 :] = quaternion.multiply(beginning[last + 1 :], turn[last + 1 :])
        beginning[:first] = quaternion.multiply(ending[:first], quaternion.inverse(turn[:first]))
        return ending, beginning

    def labels(self, standing: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Labels (R, 2, 2) of the ending and of the beginning stretch; where one has no recording, the other's."""
        ending, beginning = (standing[at].copy() for at in self._places())
        first, last = (edge - int(self.window[0]) for edge in self._known)
        ending[last + 1 :], beginning[:first] = beginning[last + 1 :], ending[:first]
        return ending, beginning
