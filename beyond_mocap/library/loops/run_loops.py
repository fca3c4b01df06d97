"""Long runs at an even tempo from the few steady strides that recordings have.

Recorded runs are short: people speed up, run some strides and stop within a studio. Sewn together from many of them, a
run at a steady speed has a stride of 0.45 s beside one of 0.7 s. So the steadiest strides of a recording are repeated,
the last step passing into the first.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...base.time_series import find_runs
from ...base.vectors import arctan2
from ...motion.motion import Motion
from ...motion.phase_blend import Strides, find_strides, repeat_strides
from ..features import Frames

LOOP_SECONDS = 8.0  # of a loop
MIN_SPEED = 2.2  # m/s; slower locomotion is recorded for longer
SPEED_STEP = 1.08  # ratio of neighbouring speeds that have a loop of their own
MAX_MISMATCH = 0.08  # m, mean over all joints, between the step before the repeated ones and the last of them
_REPEATED = (2, 4, 6)  # steps that are repeated
_MAX_SPREAD = 0.10  # of the speed of steps, share of their mean
_CADENCE = (0.87, 1.15)  # ratios to the usual cadence at that speed: starts and stops have quick short steps
_MAX_TURN, _MAX_ASIDE = 0.5, 0.35  # rad by which the heading may turn in all and differ from travel
_PHASES = np.linspace(0.0, 1.0, 9)


def iter_run_loops(clips: Sequence, frames: Frames, fps: float, is_run: np.ndarray,
                   rate: float) -> Iterator[tuple[float, Motion, np.ndarray]]:
    """Iterate over loops of the steadiest strides of a library, at most one for each speed.

    Args:
        clips: of the library.
        frames: their description, N frames.
        fps: of the frames.
        is_run: (N,) bool, frames of recordings that show locomotion and belong to it.
        rate: frames per second of the loops.
    Yields:
        Speed in m/s, the loop, and its contacts (T, 2, 2) bool of left and right, heel and toe.
    """
    best: dict[int, tuple[float, Strides]] = {}
    for strides in _iter_strides(clips, frames, fps, is_run):
        for mismatch, part in iter_steady_parts(strides):
            band = int(np.floor(np.log(part.speed / MIN_SPEED) / np.log(SPEED_STEP)))
            if mismatch < best.get(band, (MAX_MISMATCH, None))[0]:
                best[band] = mismatch, part
    for band in sorted(best):
        part = best[band][1]
        yield (part.speed, *repeat_strides(part, LOOP_SECONDS, rate))


def _iter_strides(clips: Sequence, frames: Frames, fps: float, is_run: np.ndarray) -> Iterator[Strides]:
    """Iterate over the strides of every recorded run forward."""
    forward = np.abs(arctan2(frames.velocity[:, 1], frames.velocity[:, 0])) < _MAX_ASIDE
    wanted = is_run & forward & (frames.speed > MIN_SPEED)
    for index, clip in enumerate(clips):
        at = slice(frames.first[index], frames.first[index] + frames.count[index])
        ratio = clip.motion.fps / fps
        for first, end in find_runs(wanted[at]):
            span = slice(int(np.ceil(first * ratio)), int((end - 1) * ratio) + 1)
            if end - first >= 0.6 * fps:
                strides = find_strides(clip.motion.frames(span.start, span.stop), clip.heel_toe_contacts[span])
                if strides is not None:
                    yield strides


def iter_steady_parts(strides: Strides) -> Iterator[tuple[float, Strides]]:
    """Iterate over the steady straight parts of strides that can be repeated, with how badly their ends fit, m.

    Args:
        strides: a recording.
    Yields:
        The mean distance of all joints, m, between the ends of the part, and the part, an odd number of steps.
    """
    speed = strides.metres / strides.seconds
    at_landings = np.interp(strides.landings, np.arange(len(strides.facing)), strides.facing)
    for count in _REPEATED:
        for first in range(strides.steps - count):
            inside = slice(first, first + count + 1)
            turned = np.ptp(at_landings[first : first + count + 2])
            spread = max(np.std(values[inside]) / np.mean(values[inside]) for values in (speed, strides.seconds))
            part = strides.select_steps(first, first + count + 1)
            if spread <= _MAX_SPREAD and turned <= _MAX_TURN and _has_usual_cadence(part):
                before, after = np.split(part.measure_poses(np.concatenate([_PHASES, count + _PHASES])), 2)
                yield float(np.linalg.norm(after - before, axis=-1).mean()), part


def _has_usual_cadence(strides: Strides) -> bool:
    """Whether strides are about as frequent as people's at that speed."""
    from ...synthetic.gait_tables import interpolate_figure

    usual = float(interpolate_figure("frequency", strides.speed))
    return _CADENCE[0] <= 0.5 / strides.seconds.mean() / usual <= _CADENCE[1]
