"""Measures of movement: following the track, sway, surge, speeds, hardness of transitions, and the feet.

Pelvis (T, 2) and track (T, 2) are in metres on the pitch, one row per output frame. The *root* of
docs/explanation/quality.md is the pelvis seen through a 1.5 s window, which removes the sway that a body must keep; the
track goes through the same window. Jerk, the third difference, is compared with what uncut recordings of the same speed
show. Its index t stands for frames t .. t+3, so its middle is frame t + 1.5. A transition at frame s (the first of the
new piece) has its middle at s - 0.5; its window of +-8 frames is jerk indices s-10 .. s+6.

Feet are (T, 2, 2, 3) metres: frame, side (left, right), joint (heel, toe), world position with Z up. The heel is the
foot (ankle) joint; a skeleton without a toe joint repeats it. Contacts are (T, 2) bool, labelled on the source clip and
carried along, so that moving a foot cannot change what is counted (docs/explanation/quality.md).
"""

from __future__ import annotations

import numpy as np

from ...base.time_series import find_runs, interpolate_columns, time_derivative
from ...base.vectors import unit_vectors
from ...motion import quaternion
from ...motion.humanoid import identify_joints
from ...motion.motion import ACCEPTED_RATES
from ...motion.skeleton import Skeleton
from ...motion.track import Track, smooth_zero_phase_hann

ROOT_WINDOW = 1.5  # s, of the root error
TRAVEL_WINDOW = 1.0  # s, of the travel speed
STANDING_SPEED = 0.5  # m/s below which a body counts as standing
SPEED_EDGES = (1.0, 2.0, 3.0, 4.5)  # m/s between the classes of `classify_speed`
MIN_CLASS_VALUES = 30  # values that a class needs, so that its figure is known
# jerk indices to either side of a transition, and from its middle index to its frame
JERK_REACH, TRANSITION_TO_JERK = 8, 2
_WIDTH = 2 * JERK_REACH + 1
NOTICED_SLIDE = 0.021  # m of foot slide from which on people notice it
GMD_HEIGHT, GMD_SPEED, GMD_SECONDS = 0.05, 0.5, 0.25  # m, m/s, s of GMD's skating ratio
# directions along which a stance's travel is measured: the widest of 24 is at least 0.998 of the true one
_DIRECTIONS = np.linspace(0.0, np.pi, 24, endpoint=False)
_DIRECTIONS = np.stack([np.cos(_DIRECTIONS), np.sin(_DIRECTIONS)])


def interpolate_track(track: Track, at: np.ndarray) -> np.ndarray:
    """Interpolate the measured track at given seconds: linear between samples, held beyond the ends.

    Not smoothed. Samples that cleaning filled in or replaced as outliers are left out.

    Args:
        track: the track.
        at: (T,) s.
    Returns:
        (T, 2) m, NaN where no sample is measured.
    """
    known = track.is_measured
    if not known.any():
        return np.full((len(at), 2), np.nan)
    return interpolate_columns(at, track.times[known], track.positions[known])


def measure_root_error(pelvis: np.ndarray, track: np.ndarray, fps: float) -> np.ndarray:
    """Measure the distance between pelvis and track, both through the same zero-phase Hann window of 1.5 s.

    The window is linear, so one pass over the difference is the difference of two passes.

    Args:
        pelvis: (T, 2) m.
        track: (T, 2) m.
        fps: frames per second.
    Returns:
        (T,) m.
    """
    return np.linalg.norm(smooth_zero_phase_hann(pelvis - track, fps, ROOT_WINDOW), axis=-1)


def measure_pelvis_error(pelvis: np.ndarray, track: np.ndarray) -> np.ndarray:
    """Measure the distance (T,) m between pelvis (T, 2) and track (T, 2) as they are, without a window."""
    return np.linalg.norm(pelvis - track, axis=-1)


def measure_sway(pelvis: np.ndarray, fps: float) -> np.ndarray:
    """Measure the distance (T,) m of a pelvis (T, 2) from its own 1.5 s Hann path: a recording's own pelvis error."""
    return measure_pelvis_error(pelvis, smooth_zero_phase_hann(pelvis, fps, ROOT_WINDOW))


def measure_travel_speed(pelvis: np.ndarray, fps: float) -> np.ndarray:
    """Measure the speed (T,) m/s of a pelvis or track (T, 2) through a 1 s Hann window."""
    return np.linalg.norm(time_derivative(smooth_zero_phase_hann(pelvis, fps, TRAVEL_WINDOW), fps), axis=-1)


def classify_speed(speed: np.ndarray) -> np.ndarray:
    """Return the class 0..4 of speeds (...,) m/s: 0-1, 1-2, 2-3, 3-4.5, above."""
    return np.digitize(speed, SPEED_EDGES)


def measure_surge(pelvis: np.ndarray, fps: float) -> np.ndarray:
    """Measure the pelvis speed along its path minus that speed's 1.5 s Hann.

    The path's direction is that of the velocity through the same window. Its rms guards against still feet that are
    bought with a surging pelvis.

    Args:
        pelvis: (T, 2) m.
        fps: frames per second.
    Returns:
        (T,) m/s.
    """
    speed = time_derivative(pelvis, fps)
    direction = unit_vectors(smooth_zero_phase_hann(speed, fps, ROOT_WINDOW))
    along = np.sum(speed * direction, axis=-1, keepdims=True)
    return (along - smooth_zero_phase_hann(along, fps, ROOT_WINDOW))[:, 0]


def compute_class_rms(values: np.ndarray, classes: np.ndarray) -> np.ndarray:
    """Compute the root mean square in each speed class.

    Args:
        values: (N,).
        classes: (N,) class of each.
    Returns:
        (5,), NaN where a class has fewer than MIN_CLASS_VALUES.
    """
    rms = [np.sqrt(np.mean(values[classes == k] ** 2)) if np.sum(classes == k) >= MIN_CLASS_VALUES else np.nan
           for k in range(5)]
    return np.array(rms)


def fill_from_nearest(values: np.ndarray) -> np.ndarray:
    """Replace every NaN in values (K,) by the nearest entry that is not NaN (the lower one of two)."""
    known = np.flatnonzero(np.isfinite(values))
    if not len(known):
        return values
    return np.array([values[known[np.argmin(np.abs(known - k))]] for k in range(len(values))])


def measure_speed_coverage(requested: np.ndarray, fastest: float, slowest: float) -> dict[str, float]:
    """Measure the shares of frames with a speed that the library cannot play within `ACCEPTED_RATES`.

    Args:
        requested: (T,) m/s of the track.
        fastest: m/s, fastest root of the library.
        slowest: m/s, slowest gait of the library.
    Returns:
        above: share that is faster than the fastest one can be played; below: share that is slower than the slowest
        one, and faster than standing (0.5 m/s). NaN where the library's speed is not known.
    """
    above = np.mean(requested > fastest * ACCEPTED_RATES[1]) if np.isfinite(fastest) else np.nan
    too_slow = (requested < slowest * ACCEPTED_RATES[0]) & (requested > STANDING_SPEED)
    below = np.mean(too_slow) if np.isfinite(slowest) else np.nan
    return {"above": float(above), "below": float(below)}


def compute_jerk(positions: np.ndarray, fps: float) -> np.ndarray:
    """Compute the largest third difference of any joint.

    Args:
        positions: (T, J, 3) m.
        fps: frames per second.
    Returns:
        (T-3,) m/s^3, empty for less than four frames.
    """
    if len(positions) < 4:
        return np.zeros(0)
    third = positions[3:] - positions[:-3] + 3.0 * (positions[1:-2] - positions[2:-1])
    return np.sqrt(np.max(np.sum(third**2, axis=-1), axis=-1)) * fps**3


def compute_window_maxima(values: np.ndarray) -> np.ndarray:
    """Compute the largest value within +-8 indices: (N,) -> (N,); windows end with the values."""
    from scipy.ndimage import maximum_filter1d

    return maximum_filter1d(values, _WIDTH, mode="nearest") if len(values) else values


def collect_uncut_windows(values: np.ndarray, speed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute windowed maxima of an uncut clip where the whole window lies inside it, and the speed in their middle.

    Args:
        values: (T-3,) m/s^3 of `compute_jerk`.
        speed: (T,) m/s.
    Returns:
        (M,) and (M,) with M = T - 19, or none in a short clip.
    """
    if len(values) < _WIDTH:
        return np.zeros(0), np.zeros(0)
    whole = slice(JERK_REACH, len(values) - JERK_REACH)
    return compute_window_maxima(values)[whole], speed[TRANSITION_TO_JERK:][whole]


def compute_real_p95(windows: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Compute the 95th percentile of uncut windows in each speed class.

    A class with fewer than MIN_CLASS_VALUES windows takes the nearest class that has them: runs above 4.5 m/s are rare.

    Args:
        windows: (M,) m/s^3.
        speed: (M,) m/s.
    Returns:
        (5,) m/s^3, NaN where no class has enough.
    """
    classes = classify_speed(speed)
    values = [windows[classes == k] for k in range(5)]
    return fill_from_nearest(np.array([np.percentile(v, 95) if len(v) >= MIN_CLASS_VALUES else np.nan for v in values]))


def find_recorded_classes(speed: np.ndarray) -> np.ndarray:
    """Find the speed classes (5,) bool with MIN_CLASS_VALUES or more of the speeds (M,) m/s."""
    return np.bincount(classify_speed(speed), minlength=5) >= MIN_CLASS_VALUES


def compute_transition_ratios(values: np.ndarray, transitions: np.ndarray, speed: np.ndarray,
                              real: np.ndarray) -> np.ndarray:
    """Compute windowed jerk at each transition over the real p95 at that speed.

    Args:
        values: (T-3,) m/s^3.
        transitions: (S,) frames of transitions.
        speed: (T,) m/s.
        real: (5,) m/s^3 of `compute_real_p95`.
    Returns:
        (S,).
    """
    if not len(values) or not len(transitions):
        return np.zeros(0)
    middle = np.clip(transitions - TRANSITION_TO_JERK, 0, len(values) - 1)
    return compute_window_maxima(values)[middle] / real[classify_speed(speed[transitions])]


def compute_jerk_ratios(values: np.ndarray, speed: np.ndarray, real: np.ndarray) -> np.ndarray:
    """Compute windowed jerk over the real p95 at that speed, in the middle of every window: (T-3,)."""
    pace = speed[TRANSITION_TO_JERK : TRANSITION_TO_JERK + len(values)]
    return compute_window_maxima(values) / real[classify_speed(pace)]


def compute_rest_ratios(values: np.ndarray, transitions: np.ndarray, speed: np.ndarray, real: np.ndarray) -> np.ndarray:
    """Compute the same ratio in the middle of every window that touches no transition's window: (M,).

    A locked knee can pop anywhere.
    """
    if not len(values):
        return np.zeros(0)
    free = np.ones(len(values), dtype=bool)
    for transition in transitions - TRANSITION_TO_JERK:
        free[max(transition - 2 * JERK_REACH, 0) : transition + 2 * JERK_REACH + 1] = False
    return compute_jerk_ratios(values, speed, real)[free]


def list_foot_joints(skeleton: Skeleton) -> np.ndarray:
    """Return joint indices (2, 2): side (left, right) x (heel, toe)."""
    body = identify_joints(skeleton)
    return np.array([[limb.foot, limb.toe_or_foot] for limb in (body.left, body.right)])


def measure_contact_speeds(feet: np.ndarray, contacts: np.ndarray, fps: float) -> np.ndarray:
    """Measure the level speed of each foot while it is in contact.

    Mean of heel and toe from one frame to the next, counted where both frames are in contact (Kimodo's skate on
    contacts).

    Args:
        feet: (T, 2, 2, 3) m.
        contacts: (T, 2) bool.
        fps: frames per second.
    Returns:
        (T-1, 2) m/s, NaN elsewhere.
    """
    step = np.linalg.norm(np.diff(feet[..., :2], axis=0), axis=-1).mean(axis=-1) * fps
    return np.where(contacts[:-1] & contacts[1:], step, np.nan)


def list_stances(contacts: np.ndarray) -> np.ndarray:
    """List the runs of at least two contact frames: (S, 3) int rows of first frame, frame after the last, side."""
    rows = []
    for side in range(contacts.shape[1]):
        rows += [(start, stop, side) for start, stop in find_runs(contacts[:, side]) if stop - start >= 2]
    return np.array(rows, dtype=int).reshape(-1, 3)


def measure_stance_travel(toes: np.ndarray, spans: np.ndarray) -> np.ndarray:
    """Measure the largest level distance between two places of the planted toe within each stance.

    Args:
        toes: (T, 2, 3) m.
        spans: (S, 3) of `list_stances`.
    Returns:
        (S,) m.
    """
    travel = np.zeros(len(spans))
    # positions along each direction; a last row of zeros, so that a stance may end at T for `reduceat`
    along = np.concatenate([toes[..., :2] @ _DIRECTIONS, np.zeros((1, 2, _DIRECTIONS.shape[1]))])
    for side in (0, 1):
        on_side = spans[:, 2] == side
        if on_side.any():
            bounds = spans[on_side, :2].ravel()
            # `reduceat` over (first, end) pairs: every second result is the stance itself
            widest = np.maximum.reduceat(along[:, side], bounds)[::2] - np.minimum.reduceat(along[:, side], bounds)[::2]
            travel[on_side] = widest.max(axis=1)
    return travel


def find_skating_steps(toes: np.ndarray, floor: float, fps: float) -> np.ndarray:
    """Find GMD's skating frames, of either foot.

    Toe lower than 5 cm above the floor at t and t+1, faster than 0.5 m/s, and its 0.25 s mean speed too.

    Args:
        toes: (T, 2, 3) m.
        floor: m, height of the floor.
        fps: frames per second.
    Returns:
        (T-1,) bool.
    Source: Karunratanakul et al. 2023, Guided Motion Diffusion, `calculate_skating_ratio` (their code works at 20 fps).
    """
    from scipy.ndimage import uniform_filter1d

    speed = np.linalg.norm(np.diff(toes[..., :2], axis=0), axis=-1) * fps
    width = 2 * int(GMD_SECONDS * fps / 2) + 1
    mean = uniform_filter1d(speed, width, axis=0, mode="constant") if len(speed) else speed
    low = toes[..., 2] - floor < GMD_HEIGHT
    return ((low[:-1] & low[1:]) & (speed > GMD_SPEED) & (mean > GMD_SPEED)).any(axis=1)


def measure_support_height(feet: np.ndarray, contacts: np.ndarray, heel_rest: float) -> np.ndarray:
    """Measure the height above the ground of each planted foot's lower part.

    A foot on its heel counts by the heel, a foot on its toes by the toe, so neither rolling raises the figure.

    Args:
        feet: (T, 2, 2, 3) m.
        contacts: (T, 2) bool.
        heel_rest: m, height of the heel joint while the sole is flat.
    Returns:
        (T, 2) m, NaN where there is no contact.
    """
    lower = np.minimum(feet[..., 1, 2], feet[..., 0, 2] - heel_rest)
    return np.where(contacts, lower, np.nan)


def measure_tip_height(skeleton: Skeleton, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Measure the height of the lower foot's tip, the end site of its toe (of the foot where it has no toe).

    Where a skeleton has no toe joints the floor is known from the ankles alone, and only the tips show a boot that is
    in the ground.

    Args:
        skeleton: the skeleton.
        positions: (T, J, 3) m, world.
        rotations: (T, J, 4), world.
    Returns:
        (T,) m, NaN without an end site.
    """
    body, lowest = identify_joints(skeleton), np.full(len(positions), np.nan)
    for parent, offset in zip(skeleton.end_parents, skeleton.end_offsets):
        if parent in (body.left.toe_or_foot, body.right.toe_or_foot) and np.any(offset):
            tip = positions[:, parent] + quaternion.rotate(rotations[:, parent], offset)
            lowest = np.fmin(lowest, tip[:, 2])
    return lowest


def measure_heel_rest(feet: np.ndarray, contacts: np.ndarray) -> float:
    """Measure the height of the heel joint on a flat foot: the 2nd percentile while both feet are in contact.

    Over all frames where they never are, as in a run.

    Args:
        feet: (T, 2, 2, 3) m.
        contacts: (T, 2) bool.
    Returns:
        m, NaN for no frames.
    """
    both = contacts.all(axis=1)
    heights = feet[both if both.any() else slice(None), :, 0, 2]
    return float(np.percentile(heights, 2)) if heights.size else np.nan
