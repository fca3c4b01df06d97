"""The five scenarios with two libraries: time, every figure of method `path` beside its target, and edits.

The edits: every key moment moved by 0.2 s, earlier and later, and the
track dragged by half a metre at a quarter, half and three quarters of its time, within a second and a half to either
side. Measured are processor seconds from a changed plan to the new take, how much of it is new, and what shows at the
ends of that.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks import effort
from benchmarks.places import LIBRARIES, library_folder, read_scenario
from beyond_mocap.annotation import Timeline
from beyond_mocap.base.easing import smoothstep
from beyond_mocap.evaluation.report import evaluate, judge_figures
from beyond_mocap.library.build import build_library
from beyond_mocap.library.library import Library
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.track import Track
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.resynthesize import resynthesize
from beyond_mocap.synthesis.synthesize import synthesize
from beyond_mocap.synthesis.take import Take

NUMBERS = (1, 2, 3, 4, 5)

LATER, ASIDE, WIDTH = 0.2, 0.5, 1.5  # s by which key moments move; m and s of the bump in the track
TARGET = 0.3  # s of an edit


def section() -> list[str]:
    """Build the lines for results.md."""
    lines = [f"- {effort.report_blas_speed()}", f"- {effort.report_bvh_speed()}", f"- {effort.report_library_speed()}",
             ""]
    with tempfile.TemporaryDirectory() as place:
        for name in LIBRARIES:
            lines += measure_library(name, Path(place) / name)
    return lines


def measure_library(name: str, place: Path) -> list[str]:
    """Measure one library, with its cache in `place`."""
    folder, unit, cache = library_folder(name, place), LIBRARIES[name], place / "cache"
    cold, _ = effort.measure_seconds(lambda: build_library(folder, unit=unit, cache_dir=cache, rebuild=True), 1)
    warm, library = effort.measure_seconds(lambda: build_library(folder, unit=unit, cache_dir=cache))
    reports = {number: evaluate_scenario(library, number) for number in NUMBERS}
    took = [20.0 * report["seconds"]["total"] / report["duration_s"] for report in reports.values()]
    return [f"### Library {name}", "", f"- library: {cold:.2f} s from text, {warm:.2f} s from its cache",
            f"- {np.mean(took):.2f} s for 20 s of motion (target 0.5), {max(took):.2f} at most",
            f"- {effort.report_peak_memory(name, folder, cache)}", "", *build_figure_table(reports), "",
            *measure_edits(library, map(read_scenario, NUMBERS)), ""]


def evaluate_scenario(library: Library, number: int) -> dict:
    """Evaluate a scenario, with the best processor time of three runs."""
    track, timeline = read_scenario(number)
    plan = Plan(track=track, timeline=timeline, library=library.folder, nearest=True)
    best, take = effort.measure_seconds(lambda: synthesize(library, plan))
    take.seconds["total"] = best
    return evaluate(take, track, library)


def build_figure_table(reports: Mapping[int, Mapping]) -> list[str]:
    """Build a row for each figure with a target: its value per scenario, the recordings' own, where it is met."""
    rows = {number: {row.name: row for row in judge_figures(report)} for number, report in reports.items()}
    lines = effort.format_head(["figure", "target", *(f"scenario {number}" for number in rows), "recordings", "met in"])
    for name in dict.fromkeys(row.name for of in rows.values() for row in of.values() if row.status):
        found = [of.get(name) for of in rows.values()]
        known = [row for row in found if row is not None and row.status]
        met_count = sum(row.status == "met" for row in known)
        verdict = f"{met_count} of {len(known)}" if met_count == len(known) else f"**{met_count} of {len(known)}**"
        values = ["" if row is None else str(row.value) for row in found]
        lines.append(effort.format_row([name, known[0].target, *values, str(known[0].own), verdict]))
    return lines


def measure_edits(library: Library, requests: Iterable[tuple[Track, Timeline]], runs: int = 3) -> list[str]:
    """Measure a kind of edit per row, over all requests.

    Args:
        library: the clips.
        requests: (track, timeline) of each.
        runs: the best of so many runs counts.
    Returns:
        Lines of Markdown.
    """
    figures: dict[str, list[tuple[float, ...]]] = {}
    for track, timeline in requests:
        before = synthesize(library, Plan(track=track, timeline=timeline, nearest=True))
        for kind, plan in _iter_edits(before.plan):
            best, after = _resynthesize_timed(library, plan, before, runs)
            changed = np.flatnonzero(_find_changed(before, after))
            if len(changed):
                figures.setdefault(kind, []).append((best, len(changed) / after.motion.fps,
                                                     *_measure_ends(before, after, changed)))
    return [
        f"| edit | n | median s | 95 % s | within {TARGET:g} s | regenerated, median s | "
        "jerk at its ends, before -> after | feet slide there, before -> after |",
        "|---" * 8 + "|",
        *(_format_row(kind, np.array(found)) for kind, found in figures.items()),
    ]


def _format_row(kind: str, values: np.ndarray) -> str:
    """Format the row of a kind of edit."""
    seconds, changed, jerk, jerk_after, slide, slide_after = values.T
    return (
        f"| {kind} | {len(values)} | {np.median(seconds):.2f} | {np.percentile(seconds, 95):.2f} | "
        f"{np.mean(seconds <= TARGET):.0%} | "
        f"{np.median(changed):.1f} | {np.nanmedian(jerk):.0f} -> {np.nanmedian(jerk_after):.0f} m/s^3 | "
        f"{np.nanmean(slide):.1f} -> {np.nanmean(slide_after):.1f} cm/s |"
    )


def _iter_edits(plan: Plan) -> Iterator[tuple[str, Plan]]:
    """Generate (kind, changed plan) of every edit."""
    keys, times = plan.timeline.keys, plan.track.times
    for number, key in enumerate(keys):
        for moved in (key.time - LATER, key.time + LATER):
            if times[0] < moved < times[-1]:
                others = (*keys[:number], replace(key, time=moved), *keys[number + 1 :])
                yield "key moment moved by 0.2 s", replace(plan, timeline=replace(plan.timeline, keys=others))
    for share in (0.25, 0.5, 0.75):
        at = times[0] + share * (times[-1] - times[0])
        yield "track dragged by 0.5 m", replace(plan, track=drag_track(plan.track, at))


def drag_track(track: Track, at: float, aside: Sequence[float] = (0.0, ASIDE), width: float = WIDTH) -> Track:
    """Drag a track aside with a smooth bump.

    Args:
        track: the track.
        at: s of the bump's top.
        aside: (2,) m.
        width: s to either side.
    """
    bump = smoothstep(1.0 - np.abs(track.times - at) / width)[:, None] * np.asarray(aside)
    return replace(track, positions=track.positions + bump)


def _resynthesize_timed(library: Library, plan: Plan, before: Take, runs: int) -> tuple[float, Take]:
    """Resynthesize, and measure the best processor time."""
    best, after = np.inf, before
    for _ in range(runs):
        started = time.process_time()
        after = resynthesize(library, plan, before)
        best = min(best, time.process_time() - started)
    return best, after


def _find_changed(before: Take, after: Take) -> np.ndarray:
    """Return (T,) bool: frames of which any bit has changed."""
    a, b = before.motion, after.motion
    return np.any(a.root_positions != b.root_positions, axis=1) | np.any(a.rotations != b.rotations, axis=(1, 2))


def _measure_ends(before: Take, after: Take, changed: np.ndarray) -> tuple[float, ...]:
    """Measure the frames in which old and new motion are blended: largest jerk of any joint and speed of planted toes.

    Returns:
        Before and after, m/s^3 and cm/s; NaN where the whole take is new.
    """
    count, hand = len(after.motion), int(0.5 * after.motion.fps)
    starts = [changed[0]] * (changed[0] > 0) + [changed[-1] - hand] * (changed[-1] + 1 < count)
    frames = np.unique(np.clip([np.arange(start - 3, start + hand + 3) for start in starts], 0, count - 4))
    return tuple(value for pair in zip(_measure_frames(before, frames), _measure_frames(after, frames))
                 for value in pair)


def _measure_frames(take: Take, frames: np.ndarray) -> tuple[float, float]:
    """Measure jerk and toe speed of a take in some frames."""
    if not len(frames):
        return np.nan, np.nan
    places, _ = forward_kinematics(take.motion)
    jerk = np.linalg.norm(np.diff(places, 3, axis=0), axis=2).max(axis=1) * take.motion.fps**3
    body = identify_joints(take.motion.skeleton)
    toes = places[:, [body.left.toe_or_foot, body.right.toe_or_foot], :2]
    speed = 100.0 * np.linalg.norm(np.diff(toes, axis=0), axis=2) * take.motion.fps
    still = (take.contacts[1:] & take.contacts[:-1])[frames]
    return float(jerk[frames].max()), float(speed[frames][still].mean()) if still.any() else np.nan
