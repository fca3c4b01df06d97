"""Cycling: a stretch of the motion is repeated until a path is filled (Path editing §3.2.4).

The document jumps from the last frame to the first (eq. 4.5) and finds the result poor (§5.3). Here the motion starts
as recorded, jumps back at the end of a loop whose two ends look alike (`loops`), as often as needed, and ends as
recorded. The loops and their number are chosen so that the recorded end falls on the end of the path, with all strides
scaled: by at most MOST_SCALE where the motion ends differently from how it continues (it stops, it kicks), by at most
KEPT_SCALE where its end is a step like the others. Where that is impossible, the motion is cut while it moves steadily.

At each jump the two stretches are blended by a quintic for FADE_SECONDS on either side (`jump_fade`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..base.errors import InputError
from .jump_fade import fade_jump, fade_steps, jump_window, list_rows
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


def stays_in_place(residuals: Residuals) -> bool:
    """Return whether a motion does not travel, so that no length of path can be filled with it."""
    seconds = len(residuals) / residuals.fps
    return bool(residuals.step.sum() < _LEAST_SPEED * seconds or not (smooth_speed(residuals) > _LEAST_SPEED).any())


def _describe_failure(residuals: Residuals) -> str:
    metres, seconds = float(residuals.step.sum()), len(residuals) / residuals.fps
    if stays_in_place(residuals):
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
