"""Report of unmet constraints: what could not be met in a take, and at which seconds; these lines become warnings.

The constraints, in the order in which they yield, are those of docs/explanation/quality.md (*What yields when not
everything fits*).

Every line is about one kind and lists its stretches. It is computed from what was played, without the library's own
figures, so it costs a synthesis a few milliseconds; jolts need those figures and are reported by `report_jolts`, with
the evaluation.
"""

from __future__ import annotations

from collections import Counter
from functools import lru_cache

import numpy as np

from ...annotation import Timeline, labels_per_frame
from ...annotation.ball_contact import takes_with_foot
from ...base.errors import TimedMessage, format_seconds
from ...base.time_series import drop_short_runs, find_runs, time_derivative
from ...library.clip import (
    BACK_PREFIX,
    BLEND_PREFIX,
    KICK_PREFIX,
    LANDING_FOLDER,
    LOOP_PREFIX,
    SIDE_PREFIX,
    STAND_PREFIX,
    STEP_PREFIX,
    STILL_PREFIX,
    SYNTHETIC_FOLDER,
    TURN_PREFIX,
    WALK_PREFIX,
)
from ...library.coverage import CALM_SPEED, STEP_SPEEDS, Coverage, classify_steps, compute_turn_rate, describe_lack
from ...library.features import SMOOTH_SECONDS
from ...library.library import RESTING_SPEED, Library
from ...library.missing_actions import ACTION_PREFIX, describe_action, list_action_labels
from ...motion import quaternion
from ...motion.humanoid import compute_heading_from_positions
from ...motion.supports import GRAVITY
from ...motion.track import Track, smooth_zero_phase_hann
from . import movement
from .moments import KeyMomentResult, evaluate_moments, measure_contact
from .playback import Playback, compute_playback_rate, find_transitions
from .shown_speeds import describe_lacking_speeds, explain_shown_speeds
from .targets import KEY_TARGETS, TARGETS

WARP_LIMITS = (TARGETS["warp_rate.min"].least, TARGETS["warp_rate.max"].most)
ROOT_ERROR_LIMIT = TARGETS["root_error_m.p95"].most
SLOW_ROOT_ERROR_LIMIT = 1.5 * TARGETS["slow_root_error_m.max"].most  # m; a creeping track itself is off by 8 cm
LEG_MISS_LIMIT = 0.005  # m that a leg may be short without a line
GROUND_LIMIT = -TARGETS["ground_mm.min"].least / 1000.0
CONTACT_GAP_LIMIT = KEY_TARGETS["contact_gap_m"].most
HARDEST_PUSH = 0.6 * GRAVITY
"""m/s^2 of a body over a step; of recordings' bends, starts and stops one in a hundred exceeds .33 to .57 g."""
JOIN_SECONDS = 0.4  # stretches closer than this are one
MISSING_SECONDS = 0.5  # shortest time of a motion that the library lacks that is reported
LABEL_SECONDS = 0.5  # shortest time of a missing label that is reported
MAX_STRETCHES = 6  # stretches that a line lists
_STANDS_AND_GOES_AHEAD = (STAND_PREFIX, STILL_PREFIX, WALK_PREFIX, BLEND_PREFIX)
_TOLERANCE = 1e-3  # of rates and seconds, for rounding
# how a clip's name begins, the kind of motion that recordings lack (`coverage`), and what is shown instead
_SYNTHETIC_INSTEAD = (
    (BLEND_PREFIX, "speeds", "a slower and a faster recording are blended"),
    (WALK_PREFIX, "speeds", "synthetic walking is shown"),
    ("", "speeds", "synthetic running is shown"),  # all others
    (STILL_PREFIX, "stands", "a synthetic stand is shown"),
    (BACK_PREFIX, "backward", "a walk is played backward"),
    (SIDE_PREFIX, "sideways", "synthetic ones are shown"),
    (TURN_PREFIX, "turns", "synthetic ones are shown"),
    (STEP_PREFIX, "moves", "synthetic ones are shown"),
)
_KICK, _KICKS = "kick", SYNTHETIC_FOLDER + KICK_PREFIX  # the label, and how the paths of its synthetic clips begin
_SYNTHETIC_KINDS = (
    (SYNTHETIC_FOLDER + STAND_PREFIX,
     "a recorded stand is played forward and backward: no recording stands for so long"),
    (SYNTHETIC_FOLDER + LOOP_PREFIX,
     "strides of a recorded run are repeated: no recording runs so steadily for so long"),
    (LANDING_FOLDER, "synthetic landing and getting up: the recording ends in flight"),
)


def report_unmet_constraints(
    played: Playback, *, track: Track | None = None, timeline: Timeline | None = None, library: Library | None = None,
    ik_miss: np.ndarray | None = None, user_timeline: Timeline | None = None, has_actions: bool = True,
) -> list[TimedMessage]:
    """Report each kind of constraint that is not met, with its seconds on the track's clock.

    What is not known is not reported.

    Args:
        played: the take as played.
        track: the player's samples as measured.
        timeline: the requested timeline, for the key moments.
        library: the recordings, without synthetic clips.
        ik_miss: (T, 2) m that each leg was short of where its foot should be.
        user_timeline: the user's own labels, where `timeline` has automatic ones beside them.
        has_actions: whether synthetic actions could be shown; their labels are those of the library, too.
    Returns:
        A line for each kind.
    """
    stride = played.compute_stride(library)
    source = played.clip, played.mirrored, played.clip_frame, stride
    keys = evaluate_moments(played, timeline.keys, stride, library) if timeline is not None else []
    lines = [
        *_report_synthetic(played, library),
        *_report_missing_motion(played, library),
        _report_cut_receptions(played, keys, library),
        _report_stretched_strides(played, track, library),
        _report_warp(played, source),
        _report_sliding(played),
        _report_short_legs(played, ik_miss),
        _report_root_error(played, track),
        _report_key_times(played, keys),
        _report_contact_gaps(played, keys),
        _report_missing_labels(played, user_timeline if user_timeline is not None else timeline, keys, library=library,
                               has_actions=has_actions),
        _report_below_ground(played),
    ]
    return [line for line in lines if line]


def report_jolts(times: np.ndarray, flags: np.ndarray, most: float) -> TimedMessage | None:
    """Report jerk that is harder than recordings have it.

    Args:
        times: (T,) s.
        flags: (T,) bool, frames with such a jerk.
        most: the highest one, over the 95th percentile of recordings at that speed.
    Returns:
        A line, None where there is none.
    """
    hardest = f"{most:.2f} times as hard as recordings of that speed"
    return _build_line(times, flags, f"the body jolts up to {hardest} (target {TARGETS['seam_jerk_ratio.max'].most:g})")


def report_hard_pushes(times: np.ndarray, acceleration: np.ndarray) -> TimedMessage | None:
    """Report where a track is accelerated harder than boots on grass can push a body.

    Args:
        times: (T,) s.
        acceleration: (T,) m/s^2 of the track, level, smoothed over a step.
    Returns:
        A line, None where it never is.
    """
    most = f"up to {acceleration.max(initial=0.0) / GRAVITY:.1f} g"
    return _build_line(times, acceleration > HARDEST_PUSH, f"the track asks for {most} in a bend, start or stop, more "
                       f"than players get ({HARDEST_PUSH / GRAVITY:.1f} g); the body stays on it and leans less")


def format_stretches(times: np.ndarray, flags: np.ndarray) -> str:
    """Format where flags (T,) hold, such as "4.2-6.0, 7.3 s".

    Stretches less than JOIN_SECONDS apart are one; of more than MAX_STRETCHES the longest are listed.
    """
    first, last = _merge_flags(times, flags)
    longest = np.sort(np.argsort(first - last, kind="stable")[:MAX_STRETCHES])
    named = ", ".join(_format_span(first[i], last[i]) for i in longest)
    left = len(first) - len(longest)
    return f"{named} s" + (f" and {left} shorter" if left else "")


def _build_line(times: np.ndarray, flags: np.ndarray, what: str, more: str = "") -> TimedMessage | None:
    """Build the line "4.2-6.0 s: what", with the stretches in which flags (T,) hold; None where they never do.

    `more` comes before the colon.
    """
    if not np.any(flags):
        return None
    return TimedMessage(f"{format_stretches(times, flags)}{more}: {what}", *zip(*_merge_flags(times, flags)))


def _merge_flags(times: np.ndarray, flags: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return first and last second (S,), (S,) of the stretches in which flags (T,) hold, near ones merged."""
    first, last = np.array([(times[a], times[b - 1]) for a, b in find_runs(flags)]).T
    apart = np.flatnonzero(first[1:] - last[:-1] >= JOIN_SECONDS)
    return first[np.append(0, apart + 1)], last[np.append(apart, len(last) - 1)]


def _format_span(first: float, last: float) -> str:
    """Format a stretch, or a moment."""
    low, high = f"{first:.1f}", f"{last:.1f}"
    return low if low == high else f"{low}-{high}"


def _frames_of_clips(played: Playback, *begins: str) -> np.ndarray:
    """Return (T,) bool: frames of clips whose path begins with one of `begins`."""
    table = np.array([path.startswith(begins) for path in played.clips] + [False])
    return table[played.clip]


def _report_synthetic(played: Playback, library: Library | None) -> list[TimedMessage | None]:
    """Report each kind of synthetic clip, and what the recordings lack where that is why it is shown."""
    describe = describe_lack if library is None else library.coverage.describe_lack
    kinds = [(_frames_of_clips(played, prefix), what) for prefix, what in _SYNTHETIC_KINDS]
    named = tuple(SYNTHETIC_FOLDER + prefix for prefix, *_ in _SYNTHETIC_INSTEAD if prefix)
    others = _frames_of_clips(played, SYNTHETIC_FOLDER) & ~_frames_of_clips(
        played, SYNTHETIC_FOLDER + ACTION_PREFIX, _KICKS, *named, *(prefix for prefix, _ in _SYNTHETIC_KINDS))
    kicks = _find_kicks(played)
    run_ups = _frames_of_clips(played, _KICKS) & ~kicks
    kinds += [(kicks, "synthetic kick on the run: no recorded kick is as fast as the player"),
              (run_ups, "run-up of a synthetic kick: no recorded motion fits as well")]
    kinds += [(there, f"synthetic {name}: no recorded one fits") for name, there in _list_shown_actions(played)]
    fps = played.motion.fps
    for prefix, kind, instead in _SYNTHETIC_INSTEAD:
        there = _frames_of_clips(played, SYNTHETIC_FOLDER + prefix) if prefix else others
        if kind == "speeds" and library is not None and there.any():
            speed = movement.measure_travel_speed(played.pelvis, fps)
            kinds += explain_shown_speeds(library, there, speed, fps, instead)
        else:
            kinds.append((there, describe(kind, instead)))
    return [_build_line(played.times, there, what, f" ({np.sum(there) / fps:.1f} s in all)")
            for there, what in kinds]


def _find_kicks(played: Playback) -> np.ndarray:
    """Find the frames (T,) bool of synthetic kicks that are shown up to the kick, not for their run-up alone."""
    shown = np.zeros(len(played.times), dtype=bool)
    for first, end in find_runs(_frames_of_clips(played, _KICKS)):
        shown[first:end] = played.words is None or any(_KICK in words for words in played.words[first:end])
    return shown


def _list_shown_actions(played: Playback) -> list[tuple[str, np.ndarray]]:
    """List the synthetic actions that are shown: name, and (T,) bool frames."""
    names = np.array([describe_action(path) or "" for path in played.clips] + [""])
    return [(str(name), (names == name)[played.clip]) for name in np.unique(names[names != ""])]


def _report_cut_receptions(played: Playback, keys: list[KeyMomentResult], library: Library | None
                           ) -> TimedMessage | None:
    """Report receptions that are cut out of dribbles (`library.receptions`)."""
    shown = np.zeros(len(played.times), bool)
    cut = {(library.clips[key.clip].path, key.frame) for key in library.cut_receptions} if library and any(
        takes_with_foot(moment.requested.words) for moment in keys) else set()
    for moment in keys:
        shown[moment.entry : moment.exit + 1] |= (moment.clip, moment.clip_frame) in cut
    return _build_line(played.times, shown, "reception cut out of a dribble: no recording is labelled with one")


def _report_missing_motion(played: Playback, library: Library | None) -> list[TimedMessage | None]:
    """Report each kind of motion that the library lacks and the body needs for MISSING_SECONDS or more at a time, where
    neither a synthetic clip stands in nor a recording shows it.
    """
    if library is None:
        return []
    fps, coverage = played.motion.fps, library.coverage
    heading = np.unwrap(compute_heading_from_positions(played.motion.skeleton, played.positions))
    path = smooth_zero_phase_hann(played.pelvis, fps, SMOOTH_SECONDS)
    velocity = quaternion.rotate_level(time_derivative(path, fps), -heading)
    speed = np.linalg.norm(velocity, axis=1)
    synthetic = _frames_of_clips(played, SYNTHETIC_FOLDER)
    ahead = _frames_of_clips(played, *(SYNTHETIC_FOLDER + name for name in _STANDS_AND_GOES_AHEAD))
    stands = _frames_of_clips(played, SYNTHETIC_FOLDER + STAND_PREFIX)  # recorded ones, played to and fro
    recorded = _classify_recorded_steps(played, library)
    steps = classify_steps(velocity, compute_turn_rate(heading, fps))
    needed = {
        "belonging": ~(synthetic & ~stands) & (speed < CALM_SPEED), "stands": ~synthetic & (speed < RESTING_SPEED),
        "speeds": ~synthetic & (speed > STEP_SPEEDS[0]) & (speed < coverage.slowest_speed),
        **{kind: flags & ~(synthetic & ~ahead) & ~recorded[kind] for kind, flags in steps.items()},
    }
    lines = []
    for kind, flags in needed.items():
        there = drop_short_runs(flags, MISSING_SECONDS * fps)
        if coverage.lacks(kind) and there.any():
            lines.append(_build_line(played.times, there, _describe_missing_motion(coverage, kind, speed[there])))
    return lines


def _describe_missing_motion(coverage: Coverage, kind: str, speed: np.ndarray) -> str:
    """Describe a kind of motion that recordings lack, for which others are shown at speeds (T,) m/s."""
    instead = "the nearest recording is shown"
    if kind == "speeds":
        return describe_lacking_speeds(coverage, [speed], instead)
    return coverage.lines[kind] if kind == "belonging" else coverage.describe_lack(kind, instead)


def _classify_recorded_steps(played: Playback, library: Library) -> dict[str, np.ndarray]:
    """Classify the recorded frames that are shown by `classify_steps`: kind -> (T,) bool."""
    frames = library.frames
    numbers = {(clip.path, clip.mirrored): number for number, clip in enumerate(library.clips)}
    found = {kind: np.zeros(len(played.motion), bool) for kind in ("turns", "sideways", "backward")}
    for index, mirrored in sorted(set(zip(played.clip.tolist(), played.mirrored.tolist()))):
        number = numbers.get((played.clips[index].removeprefix(LANDING_FOLDER), mirrored)) if index >= 0 else None
        if number is None:
            continue
        there = (played.clip == index) & (played.mirrored == mirrored)
        part = slice(frames.first[number], frames.first[number] + frames.count[number])
        nearest = np.searchsorted(frames.source[part], played.clip_frame[there])
        rate = compute_turn_rate(frames.heading[part], library.fps)
        for kind, flags in classify_steps(frames.velocity[part], rate).items():
            found[kind][there] = flags[np.minimum(nearest, len(flags) - 1)]
    return found


def _report_stretched_strides(played: Playback, track: Track | None, library: Library | None) -> TimedMessage | None:
    """Report recordings stretched to a speed that they do not have, even within the limit of the time warp."""
    if track is None or library is None:
        return None
    speed = movement.measure_travel_speed(movement.interpolate_track(track, played.times), played.motion.fps)
    fast = (speed > library.max_speed * WARP_LIMITS[1]) & ~_frames_of_clips(played, SYNTHETIC_FOLDER)
    most = speed.max(where=fast, initial=0.0)
    return _build_line(
        played.times, fast,
        f"the track reaches {most:.1f} m/s, faster than the library's {library.max_speed:.1f} m/s x "
        f"{WARP_LIMITS[1]:g}: no recording keeps up",
    )  # fmt: skip


def _report_warp(played: Playback, source) -> TimedMessage | None:
    """Report clips played too fast or too slow."""
    rate = compute_playback_rate(*source)
    rate[find_transitions(*source) - 1] = np.nan
    beyond = np.append((rate < WARP_LIMITS[0] - _TOLERANCE) | (rate > WARP_LIMITS[1] + _TOLERANCE), False)
    if not np.any(beyond):
        return None
    low, high = np.nanmin(rate), np.nanmax(rate)
    return _build_line(
        played.times, beyond,
        f"clips are played at {low:.2f} to {high:.2f} times their recorded speed (target {WARP_LIMITS[0]:g} to "
        f"{WARP_LIMITS[1]:g})",
    )  # fmt: skip


def _report_sliding(played: Playback) -> TimedMessage | None:
    """Report stances whose toe travels visibly."""
    stances = movement.list_stances(played.contacts)
    travel = movement.measure_stance_travel(played.feet[:, :, 1], stances)
    flags = np.zeros(len(played.motion), bool)
    for first, end, _ in stances[travel > movement.NOTICED_SLIDE]:
        flags[first:end] = True
    return _build_line(played.times, flags, f"a planted foot slides by up to {100 * travel.max(initial=0.0):.0f} cm")


def _report_short_legs(played: Playback, ik_miss: np.ndarray | None) -> TimedMessage | None:
    """Report legs that do not reach the place of their foot."""
    if ik_miss is None:
        return None
    miss = np.asarray(ik_miss).reshape(len(played.motion), -1).max(axis=1)
    what = f"a leg is up to {100 * miss.max(initial=0.0):.1f} cm too short to reach the place of its foot"
    return _build_line(played.times, miss > LEG_MISS_LIMIT, what)


def _report_root_error(played: Playback, track: Track | None) -> TimedMessage | None:
    """Report a root that is off the track."""
    if track is None:
        return None
    target, fps = movement.interpolate_track(track, played.times), played.motion.fps
    error = movement.measure_root_error(played.pelvis, target, fps)
    slow = movement.measure_travel_speed(target, fps) < movement.SPEED_EDGES[0]
    off = error > np.where(slow, SLOW_ROOT_ERROR_LIMIT, ROOT_ERROR_LIMIT)
    return _build_line(played.times, off,
                       f"the body is off the track by up to {error.max(where=off, initial=0.0):.2f} m")


def _report_key_times(played: Playback, keys: list[KeyMomentResult]) -> TimedMessage | None:
    """Report key moments that are not played at their time."""
    half = 0.5 / played.motion.fps + _TOLERANCE
    errors = [(moment.requested.time, moment.played_at - moment.requested.resolved_time) for moment in keys]
    late = [(time, error) for time, error in errors if np.isfinite(error) and abs(error) > half]
    return _build_moment_line("key moments are not at their time", late, "{:+.2f} s")


def _report_contact_gaps(played: Playback, keys: list[KeyMomentResult]) -> TimedMessage | None:
    """Report key moments at which the ball is not reached."""
    gaps = [(moment.requested.time, measure_contact(played, moment)[1]) for moment in keys]
    far = [(time, gap) for time, gap in gaps if np.isfinite(gap) and gap > CONTACT_GAP_LIMIT]
    return _build_moment_line("the body does not reach the ball at key moments", far, "{:.2f} m")


def _build_moment_line(what: str, found: list[tuple[float, float]], form: str) -> TimedMessage | None:
    """Build the line "what: 4.2 s by 0.13 m, ..." for (second, by how much) of key moments; None without any.

    Of more than MAX_STRETCHES the largest are listed.
    """
    largest = sorted(sorted(range(len(found)), key=lambda i: -abs(found[i][1]))[:MAX_STRETCHES])
    listed = ", ".join(f"{format_seconds(found[i][0])} s by {form.format(found[i][1])}" for i in largest)
    left = f" and {len(found) - len(largest)} by less" if len(found) > len(largest) else ""
    return TimedMessage(f"{what}: {listed}{left}", *((time, time) for time, _ in found)) if found else None


def _report_missing_labels(
    played: Playback, timeline: Timeline | None, keys: list[KeyMomentResult], library: Library | None, has_actions: bool
) -> TimedMessage | None:
    """Report labels of the user's spans that clips or synthetic actions carry, but that are not shown for
    LABEL_SECONDS or more.

    Entry and exit of key moments do not count.
    """
    if timeline is None or played.words is None or library is None:
        return None
    wanted = [words or frozenset() for words in labels_per_frame(timeline, played.times)]
    is_recorded = library.labels.issuperset(frozenset().union(*wanted))
    known = library.labels.union(*(list_action_labels(is_span=True) if has_actions and not is_recorded else ()))
    find_missing = lru_cache(None)(lambda words, shown: (words & known).difference(shown))  # frames repeat their labels
    missing = list(map(find_missing, wanted, played.words))
    for moment in keys:
        missing[moment.entry : moment.exit + 1] = [frozenset()] * (moment.exit + 1 - moment.entry)
    # runs of frames with and without missing labels
    edges = [0, *(i for i in range(1, len(missing)) if bool(missing[i]) != bool(missing[i - 1])), len(missing)]
    long = [span for span in zip(edges, edges[1:]) if span[1] - span[0] >= LABEL_SECONDS * played.motion.fps]
    flags = np.zeros(len(missing), bool)
    for low, high in long:
        flags[low:high] = bool(missing[low])
    count = Counter(word for frame in np.flatnonzero(flags) for word in sorted(missing[frame]))
    words = ", ".join(word for word, _ in count.most_common(3)) + (", ..." if len(count) > 3 else "")
    return _build_line(played.times, flags, f"requested labels that are not shown: {words}")


def _report_below_ground(played: Playback) -> TimedMessage | None:
    """Report joints below the ground."""
    lowest = played.positions[..., 2].min(axis=1)
    depth = -100 * lowest.min(initial=0.0)
    return _build_line(played.times, lowest < -GROUND_LIMIT, f"the body is below the ground by up to {depth:.1f} cm")
