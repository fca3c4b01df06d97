"""Report of unmet constraints: what could not be met in a take, and at which seconds; these lines become warnings.

The constraints, in the order in which they yield, are those of ../shared/metrics.md ("Where they cannot all hold":
seconds, seam jerk, warp rate, skate, root error, key time, words, bones and ground).

Every line is about one kind and lists its stretches. It is computed from what was played, without the library's own
figures, so it costs a synthesis a few milliseconds; jolts need those figures and are reported by `report_jolts`, with
the evaluation.
"""

from __future__ import annotations

from collections import Counter

import numpy as np

from ...annotation import Timeline, words_per_frame
from ...base.errors import TimedLine, told_time
from ...base.time_series import runs
from ...library.landings import LANDING_FOLDER
from ...library.library import Library
from ...library.made import BLENDED, KICKED, MADE_FOLDER, TAKEN
from ...motion.track import Track
from . import movement
from .moments import Moment, met, moments
from .played import Played, find_transitions, played_rate
from .targets import KEY_TARGETS, TARGETS

REACH = (TARGETS["warp_rate.min"].least, TARGETS["warp_rate.max"].most)
OFF_TRACK = TARGETS["root_error_m.p95"].most
SHORT_LEG = 0.005  # m that a leg may be short without a line
BELOW_GROUND = -TARGETS["ground_mm.min"].least / 1000.0
OUT_OF_REACH = KEY_TARGETS["contact_gap_m"].most
JOIN_SECONDS = 0.4  # stretches closer than this are one
WORD_SECONDS = 0.5  # shortest time of a missing label that is reported
MOST_STRETCHES = 6  # stretches that a line lists
_TOLERANCE = 1e-3  # of rates and seconds, for rounding


def give_way(
    played: Played, *, track: Track | None = None, timeline: Timeline | None = None, library: Library | None = None,
    ik_miss: np.ndarray | None = None, asked: Timeline | None = None,
) -> list[TimedLine]:
    """Report each kind of constraint that is not met, with its seconds on the track's clock.

    What is not known is not reported.

    Args:
        played: the take as played.
        track: the player's samples as measured.
        timeline: the requested timeline, for the key moments.
        library: the recordings, without synthetic clips.
        ik_miss: (T, 2) m that each leg was short of where its foot should be.
        user_timeline: the user's own labels, where `timeline` has automatic ones beside them.
    Returns:
        A line for each kind.
    """
    stride = played.stride(library)
    source = played.clip, played.mirrored, played.clip_frame, stride
    keys = moments(played, timeline.keys, stride, library) if timeline is not None else []
    lines = [
        *_made_lines(played),
        _too_fast(played, track, library),
        _warped(played, source),
        _sliding(played),
        _short_legs(played, ik_miss),
        _off_track(played, track),
        _late(played, keys),
        _out_of_reach(played, keys),
        _other_words(played, asked if asked is not None else timeline, keys, library),
        _below_ground(played),
    ]
    return [line for line in lines if line]


def jolts(times: np.ndarray, starts: np.ndarray, ratios: np.ndarray) -> TimedLine | None:
    """Report transitions that are harder than recordings are.

    Args:
        times: (T,) s.
        starts: (S,) frames of transitions.
        ratios: (S,) of `movement.compute_transition_ratios`.
    Returns:
        A line, None where there is none.
    """
    most, flags = TARGETS["seam_jerk_ratio.max"].most, np.zeros(len(times), bool)
    hard = ratios > most
    for start in starts[hard]:
        flags[max(start - movement.JERK_REACH // 2, 0) : start + movement.JERK_REACH // 2] = True
    hardest = f"{ratios.max(where=hard, initial=0.0):.2f} times as hard as recordings of that speed"
    return _line(times, flags, f"transitions jolt up to {hardest} (target {most:g})")


def stretches(times: np.ndarray, flags: np.ndarray) -> str:
    """Format where flags (T,) hold, such as "4.2-6.0, 7.3 s".

    Stretches less than JOIN_SECONDS apart are one; of more than MAX_STRETCHES the longest are listed.
    """
    first, last = _joined(times, flags)
    longest = np.sort(np.argsort(first - last, kind="stable")[:MOST_STRETCHES])
    named = ", ".join(_span(first[i], last[i]) for i in longest)
    left = len(first) - len(longest)
    return f"{named} s" + (f" and {left} shorter" if left else "")


def _line(times: np.ndarray, flags: np.ndarray, what: str, more: str = "") -> TimedLine | None:
    """Build the line "4.2-6.0 s: what", with the stretches in which flags (T,) hold; None where they never do.

    `more` comes before the colon.
    """
    if not np.any(flags):
        return None
    return TimedLine(f"{stretches(times, flags)}{more}: {what}", *zip(*_joined(times, flags)))


def _joined(times: np.ndarray, flags: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return first and last second (S,), (S,) of the stretches in which flags (T,) hold, near ones merged."""
    first, last = np.array([(times[a], times[b - 1]) for a, b in runs(flags)]).T
    apart = np.flatnonzero(first[1:] - last[:-1] >= JOIN_SECONDS)
    return first[np.append(0, apart + 1)], last[np.append(apart, len(last) - 1)]


def _span(first: float, last: float) -> str:
    """Format a stretch, or a moment."""
    low, high = f"{first:.1f}", f"{last:.1f}"
    return low if low == high else f"{low}-{high}"


def _whose(played: Played, *begins: str) -> np.ndarray:
    """Return (T,) bool: frames of clips whose path begins with one of `begins`."""
    table = np.array([path.startswith(begins) for path in played.clips] + [False])
    return table[played.clip]


def _made_lines(played: Played) -> list[TimedLine | None]:
    """Report each kind of synthetic clip: running, two recordings blended, kicks, taken balls, landings."""
    blends, kicks, takes = (_whose(played, MADE_FOLDER + name) for name in (BLENDED, KICKED, TAKEN))
    running = _whose(played, MADE_FOLDER) & ~blends & ~kicks & ~takes
    kinds = (
        (running, "synthetic running: no recording has the speed of the track"),
        (blends, "blended from a slower and a faster recording: none has the speed of the track"),
        (kicks, "synthetic kick on the run: no recorded kick is as fast as the player"),
        (takes, "synthetic reception on the run: no recorded one is as fast as the player"),
        (_whose(played, LANDING_FOLDER), "synthetic landing and getting up: the recording ends in flight"),
    )
    return [_line(played.times, there, what, f" ({np.sum(there) / played.motion.fps:.1f} s in all)")
            for there, what in kinds]


def _too_fast(played: Played, track: Track | None, library: Library | None) -> TimedLine | None:
    """Report recordings stretched to a speed that they do not have, even within the limit of the time warp."""
    if track is None or library is None:
        return None
    speed = movement.travel_speed(movement.track_at(track, played.times), played.motion.fps)
    fast = (speed > library.fastest * REACH[1]) & ~_whose(played, MADE_FOLDER)
    most = speed.max(where=fast, initial=0.0)
    return _line(
        played.times, fast,
        f"the track reaches {most:.1f} m/s, faster than the library's {library.fastest:.1f} m/s x {REACH[1]:g}: "
        "strides are stretched",
    )  # fmt: skip


def _warped(played: Played, source) -> TimedLine | None:
    """Report clips played too fast or too slow."""
    rate = played_rate(*source)
    rate[find_transitions(*source) - 1] = np.nan
    beyond = np.append((rate < REACH[0] - _TOLERANCE) | (rate > REACH[1] + _TOLERANCE), False)
    if not np.any(beyond):
        return None
    low, high = np.nanmin(rate), np.nanmax(rate)
    return _line(
        played.times, beyond,
        f"clips are played at {low:.2f} to {high:.2f} times their recorded speed (target {REACH[0]:g} to {REACH[1]:g})",
    )  # fmt: skip


def _sliding(played: Played) -> TimedLine | None:
    """Report stances whose toe travels visibly."""
    stances = movement.stances(played.contacts)
    travel = movement.stance_travel(played.feet[:, :, 1], stances)
    flags = np.zeros(len(played.motion), bool)
    for first, end, _ in stances[travel > movement.NOTICED_SLIDE]:
        flags[first:end] = True
    return _line(played.times, flags, f"a planted foot slides by up to {100 * travel.max(initial=0.0):.0f} cm")


def _short_legs(played: Played, ik_miss: np.ndarray | None) -> TimedLine | None:
    """Report legs that do not reach the place of their foot."""
    if ik_miss is None:
        return None
    miss = np.asarray(ik_miss).reshape(len(played.motion), -1).max(axis=1)
    what = f"a leg is up to {100 * miss.max(initial=0.0):.1f} cm too short to reach the place of its foot"
    return _line(played.times, miss > SHORT_LEG, what)


def _off_track(played: Played, track: Track | None) -> TimedLine | None:
    """Report a root that is off the track."""
    if track is None:
        return None
    error = movement.root_error(played.pelvis, movement.track_at(track, played.times), played.motion.fps)
    return _line(played.times, error > OFF_TRACK, f"the body is off the track by up to {error.max(initial=0.0):.2f} m")


def _late(played: Played, keys: list[Moment]) -> TimedLine | None:
    """Report key moments that are not played at their time."""
    half = 0.5 / played.motion.fps + _TOLERANCE
    errors = [(moment.asked.time, moment.played_at - moment.asked.in_force) for moment in keys]
    late = [(time, error) for time, error in errors if np.isfinite(error) and abs(error) > half]
    return _at_moments("key moments are not at their time", late, "{:+.2f} s")


def _out_of_reach(played: Played, keys: list[Moment]) -> TimedLine | None:
    """Report key moments at which the ball is not reached."""
    gaps = [(moment.asked.time, met(played, moment)[1]) for moment in keys]
    far = [(time, gap) for time, gap in gaps if np.isfinite(gap) and gap > OUT_OF_REACH]
    return _at_moments("the body does not reach the ball at key moments", far, "{:.2f} m")


def _at_moments(what: str, found: list[tuple[float, float]], form: str) -> TimedLine | None:
    """Build the line "what: 4.2 s by 0.13 m, ..." for (second, by how much) of key moments; None without any."""
    listed = ", ".join(f"{told_time(time)} s by {form.format(value)}" for time, value in found)
    return TimedLine(f"{what}: {listed}", *((time, time) for time, _ in found)) if found else None


def _other_words(
    played: Played, asked: Timeline | None, keys: list[Moment], library: Library | None
) -> TimedLine | None:
    """Report labels of the user's spans that clips carry, but that are not shown for LABEL_SECONDS or more.

    Entry and exit of key moments do not count.
    """
    if asked is None or played.words is None or library is None:
        return None
    had = [(words or frozenset()) & library.words for words in words_per_frame(asked, played.times)]
    missing = [want.difference(shown) for want, shown in zip(had, played.words)]
    for moment in keys:
        missing[moment.entry : moment.exit + 1] = [frozenset()] * (moment.exit + 1 - moment.entry)
    # runs of frames with and without missing labels
    edges = [0, *(i for i in range(1, len(missing)) if bool(missing[i]) != bool(missing[i - 1])), len(missing)]
    long = [span for span in zip(edges, edges[1:]) if span[1] - span[0] >= WORD_SECONDS * played.motion.fps]
    flags = np.zeros(len(missing), bool)
    for low, high in long:
        flags[low:high] = bool(missing[low])
    count = Counter(word for frame in np.flatnonzero(flags) for word in sorted(missing[frame]))
    words = ", ".join(word for word, _ in count.most_common(3)) + (", ..." if len(count) > 3 else "")
    return _line(played.times, flags, f"requested labels that are not shown: {words}")


def _below_ground(played: Played) -> TimedLine | None:
    """Report joints below the ground."""
    lowest = played.positions[..., 2].min(axis=1)
    depth = -100 * lowest.min(initial=0.0)
    return _line(played.times, lowest < -BELOW_GROUND, f"the body is below the ground by up to {depth:.1f} cm")
