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
from ..synthesis.construct.transitions import blend_rotations, compute_blend_share
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
UNLIKE_DISTANCE = 0.35
"""Relative distance of a loop's ends above which the user gets a warning, and below which the end of the motion counts
as a step like the others."""
_COST_TOLERANCE = (1.6, 0.02)  # cost limit of further loops: a factor on the lowest cost, and metres more
# weights of scaled strides, and of loops whose ends differ, against transitions
_SCALE_WEIGHT, _DISTANCE_WEIGHT = 3.0, 0.3
_LEAST_SPEED = 0.2  # m/s below which a motion stays in place
_MOST_SECOND_LOOPS = 3  # repeats of a second loop beside the main one, at most

_OWN_SHARE = 0.98  # a sole in contact in one stretch alone stays in contact while that one has at least this share
_EXTRAPOLATION_SECONDS = 0.08  # seconds after which an extrapolated difference no longer grows
_SLOPE_SECONDS = 0.03  # over which the slope of an extrapolated difference is measured


@dataclass(frozen=True, eq=False)
class CycledMotion:
    """A motion that is repeated to a given length.

    Attributes:
        residuals: of the repeated motion.
        transitions: (S,) its first frames after a jump.
        scale: length of its strides over those recorded.
        messages: for the user.
    """

    residuals: Residuals
    transitions: np.ndarray
    scale: float = 1.0
    messages: tuple[str, ...] = ()


def cycle_motion(residuals: Residuals, length: float, loops: tuple[Loop, ...] | None = None) -> CycledMotion:
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
        return CycledMotion(residuals, np.zeros(0, int))
    good_loops = _select_loops(residuals, find_loops(residuals) if loops is None else loops)
    most = KEPT_SCALE if good_loops and good_loops[0].end_distance <= UNLIKE_DISTANCE else MOST_SCALE
    if length <= (1.0 + most) * own:
        scale = length / own if length >= (1.0 - most) * own else 1.0
        return CycledMotion(_scale_strides(residuals, scale), np.zeros(0, int), scale, _report_stride_scale(scale))
    if not good_loops:
        raise InputError("cycling", _describe_failure(residuals), "at least one whole stride", _NEXT_STEP)
    return _fill_length(residuals, good_loops, length, most)


def _fill_length(residuals: Residuals, loops: tuple[Loop, ...], target: float, most: float) -> CycledMotion:
    """Repeat the motion with as many jumps as `target` metres need."""
    own = float(residuals.step.sum())
    length = min(target, _compute_longest(residuals, loops[0], own))
    exact = _find_exact_end(loops, own, length, most)
    jumps = exact or _choose_steady_jumps(residuals, loops, own, length)
    repeated, transitions = _apply_jumps(residuals, jumps)
    messages = _report_unlike_strides(jumps)
    if length < target:
        minutes = len(repeated) / residuals.fps / 60.0
        ends = f"the motion ends after {minutes:.0f} minutes and {length:.0f} m"
        messages += (f"the path of {target:.0f} m is too long: {ends}",)
    if exact:
        scale = length / float(repeated.step.sum())
        return CycledMotion(_scale_strides(repeated, scale), transitions, scale,
                            (*messages, *_report_stride_scale(scale)))
    # No exact end: cut at the nearest frame, with strides scaled if that is hardly visible.
    arc = np.cumsum(repeated.step)
    count = int(np.argmin(np.abs(arc - length))) + 1
    scale = length / float(arc[count - 1])
    if abs(scale - 1.0) > KEPT_SCALE:
        count, scale = int(np.searchsorted(arc, length + SAME_LENGTH, side="right")), 1.0
    repeated = _scale_strides(repeated.select_rows(slice(count)), scale)
    return CycledMotion(repeated, transitions[transitions < count], scale, (*messages, *_report_cut(loops[0])))


def _scale_strides(residuals: Residuals, scale: float) -> Residuals:
    return residuals if scale == 1.0 else residuals.replace_fields(step=residuals.step * scale)


_NEXT_STEP = "switch cycling off, choose a clip that walks or runs for two strides, or shorten the path"


def _describe_failure(residuals: Residuals) -> str:
    metres, seconds = float(residuals.step.sum()), len(residuals) / residuals.fps
    if metres < _LEAST_SPEED * seconds or not (smooth_speed(residuals) > _LEAST_SPEED).any():
        return f"the motion stays in place ({metres:.2f} m in {seconds:.1f} s)"
    return f"no part of the motion ({metres:.2f} m, {seconds:.1f} s) can be repeated"


def _report_unlike_strides(loops: tuple[Loop, ...]) -> tuple[str, ...]:
    unlike = max(loop.relative_distance for loop in loops)
    if unlike <= UNLIKE_DISTANCE:
        return ()
    return (f"no two strides of the motion are alike: at its transitions, poses differ by {100 * unlike:.0f} %",)


def _report_stride_scale(scale: float) -> tuple[str, ...]:
    if abs(scale - 1.0) <= KEPT_SCALE + 1e-3:
        return ()
    word = "longer" if scale > 1.0 else "shorter"
    return (f"strides are {100 * abs(scale - 1.0):.1f} % {word}, so that the motion ends with the path",)


def _report_cut(loop: Loop) -> tuple[str, ...]:
    if loop.end_distance <= UNLIKE_DISTANCE:
        return ()
    return ("no repetition of loops ends with the recorded end at the path's end: the motion is cut there",)


def _select_loops(residuals: Residuals, loops: tuple[Loop, ...]) -> tuple[Loop, ...]:
    """Select the loops nearly as good as the best, without those that do not move, with their length after fading."""
    loops = tuple(loop for loop in loops if loop.metres > 0.1)
    most = _COST_TOLERANCE[0] * loops[0].cost + _COST_TOLERANCE[1] if loops else 0.0
    return tuple(_measure_faded_loop(residuals, loop) for loop in loops if loop.cost <= most)


def _measure_faded_loop(residuals: Residuals, loop: Loop) -> Loop:
    reach = _compute_fade_reach(residuals, (loop,))
    own = residuals.step[np.clip(jump_window(loop, reach), 1, len(residuals) - 1)]
    return replace(loop, metres=loop.metres + float(fade_steps(residuals, loop, reach).sum() - own.sum()))


def _find_exact_end(loops: tuple[Loop, ...], own: float, length: float, most: float) -> tuple[Loop, ...]:
    """Find the jumps with which the motion's own end falls on the path's; () if strides would scale by more than
    `most`.
    """
    best, least = (), np.inf
    for main in loops:
        for other in loops:
            # `other` runs `times` times; then `main` fills the rest, rounded down or up.
            for times in range(_MOST_SECOND_LOOPS + 1 if other is not main else 1):
                more = length - own - times * other.metres
                around = more / main.metres
                for count in {max(int(np.floor(around)), 0), max(int(np.ceil(around)), 0)}:
                    jumps = _order_jumps(main, count, other, times)
                    scale = length / (own + count * main.metres + times * other.metres)
                    if not jumps or abs(scale - 1.0) > most:
                        continue
                    rating = _compute_rating(jumps, scale, loops[0].cost)
                    if rating < least - 1e-12:
                        best, least = jumps, rating
    return best


def _compute_rating(jumps: tuple[Loop, ...], scale: float, best: float) -> float:
    """Rate a plan, lower is better: scaled strides, many jumps and visible jumps count against it."""
    strides = sum(loop.strides for loop in jumps)
    worse = sum(loop.cost for loop in jumps) / len(jumps) / max(best, 1e-6) - 1.0
    return _SCALE_WEIGHT * abs(scale - 1.0) / MOST_SCALE + len(jumps) / max(strides, 1.0) + _DISTANCE_WEIGHT * worse


def _order_jumps(main: Loop, count: int, other: Loop, times: int) -> tuple[Loop, ...]:
    """Order `count` jumps of `main` and `times` of `other` so that they can be played; () if no order can."""
    if not count or not times:
        return (main,) * count + (other,) * times
    for first, second in (((main, count), (other, times)), ((other, times), (main, count))):
        if second[0].end - first[0].start >= min(len(first[0]), len(second[0])):
            return (first[0],) * first[1] + (second[0],) * second[1]
    return ()


def _choose_steady_jumps(residuals: Residuals, loops: tuple[Loop, ...], own: float, length: float) -> tuple[Loop, ...]:
    """Choose one loop, repeated until the path's end falls into it or before it, so that no stop is cut in the middle.

    A motion that ends as it continues is repeated until it is long enough.
    """
    loop = min(loops, key=lambda loop: _compute_rating((loop,), 1.0, loops[0].cost))
    outro = float(residuals.step[loop.end + 1 :].sum()) if loop.end_distance > UNLIKE_DISTANCE else 0.0
    return (loop,) * max(int(np.ceil((length - own + outro) / loop.metres)), 1)


def _compute_longest(residuals: Residuals, loop: Loop, own: float) -> float:
    """Compute the metres that MOST_FRAMES cover."""
    return own + max((MOST_FRAMES - len(residuals)) // len(loop), 1) * loop.metres


def _apply_jumps(residuals: Residuals, jumps: tuple[Loop, ...]) -> tuple[Residuals, np.ndarray]:
    """Apply all jumps with their fades; return the motion and its transitions (S,).

    Each jump over the same loop has the same fade, so that it is computed once: frames come from the motion, followed
    by one fade for each kind of loop.
    """
    count, kinds = len(residuals), list(dict.fromkeys(jumps))
    reach = _compute_fade_reach(residuals, jumps)
    begins = [0] + [loop.start for loop in jumps]
    ends = [loop.end for loop in jumps] + [count]
    # `taken` (N,) is the row of each output frame: 0 .. count - 1 in the motion, then 2 * reach rows of each fade.
    taken = np.concatenate([np.arange(a, b) for a, b in zip(begins, ends)])
    transitions = np.cumsum([b - a for a, b in zip(begins, ends)])[:-1]
    parts = {name: [values] for name, values in list_rows(residuals).items()}
    for loop in kinds:
        for name, values in fade_jump(residuals, loop, reach).items():
            parts[name].append(values)
    kind = np.array([kinds.index(loop) for loop in jumps])
    around = np.arange(-reach, reach)
    taken[transitions[:, None] + around] = count + kind[:, None] * 2 * reach + around + reach
    source = np.concatenate([np.arange(count), *(jump_window(loop, reach) for loop in kinds)])
    values = {name: np.concatenate(each)[taken] for name, each in parts.items()}
    values["frames"] = residuals.frames[source[taken]]
    return residuals.replace_fields(**values), transitions


def _compute_fade_reach(residuals: Residuals, jumps: tuple[Loop, ...]) -> int:
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
