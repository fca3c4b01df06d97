"""Cost of the players of a match, and how they get on together.

`speed_section`: processor seconds of search, construction and polishing per 20 s of motion, and of reading and cleaning
a whole half. `crowd_section`: overlaps between players, the cost of collision avoidance, and players in step; overlaps,
skate and jerk without and with the corrections. The share in step refers to the time of all players.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.effort import format_head, format_row, seconds
from benchmarks.places import CMU_UNIT, DATA
from beyond_mocap.files.tracking.tracking import Match, read_match
from beyond_mocap.library.build import build
from beyond_mocap.library.library import Library
from beyond_mocap.match.crowd.correction import ARMS, ROOT, Correction, applied
from beyond_mocap.match.crowd.crowd import kept_apart, overlap_depths
from beyond_mocap.match.crowd.variety import share_in_step
from beyond_mocap.match.expand import expanded
from beyond_mocap.match.make import make_match
from beyond_mocap.match.order import MatchOrder
from beyond_mocap.match.player_edit import read_player
from beyond_mocap.motion.motion import Motion, forward_kinematics
from beyond_mocap.motion.track import clean, sample
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.quality.movement import contact_speeds, foot_joints, jerk
from beyond_mocap.synthesis.resolve_plan import resolve_plan
from beyond_mocap.synthesis.search.path_costs import balanced
from beyond_mocap.synthesis.search.path_search import PathSearch
from beyond_mocap.synthesis.search.wanted import build_order
from beyond_mocap.synthesis.search_library import search_library
from beyond_mocap.synthesis.synthesize import synthesize
from beyond_mocap.synthesis.take import Take

SECONDS = (1480.0, 1500.0)
"""Stretch of the recorded half in which players are close together, so that collision avoidance has work to do."""
WINDOW = 60.0  # s that are measured of a player
STARTS = (60.0, 600.0, 1200.0, 1800.0, 2400.0)  # s at which windows begin
EVERY = 4
"""Every fourth player is measured, each in the next window."""


def step_share(library: Library, takes: list[Take], firsts: list[int]) -> float:
    """Measure the share of the time of all players in which they are in step with a neighbour.

    Args:
        library: the clips.
        takes: takes of all players.
        firsts: frame of the match at which each begins.
    """
    start, fps = min(firsts), takes[0].motion.fps
    count = max(first + len(take.motion) for first, take in zip(firsts, takes)) - start
    rates = {clip.path: clip.motion.fps for clip in library.extended.clips}
    names: dict[tuple[str, bool], int] = {}
    shown, ages = np.full((len(takes), count), -1), np.zeros((len(takes), count))
    places = np.zeros((len(takes), count, 2))
    for row, (take, first) in enumerate(zip(takes, firsts)):
        here = slice(first - start, first - start + len(take.motion))
        what = [(take.clips[clip], bool(mirrored)) for clip, mirrored in zip(take.clip, take.mirrored)]
        shown[row, here] = [names.setdefault(each, len(names)) for each in what]
        ages[row, here] = take.clip_frame / np.array([rates.get(path, fps) for path, _ in what])
        places[row, here] = take.motion.root_positions[:, :2]
    return share_in_step(shown, ages, places)


def figures(motions: list[Motion], contacts: list[np.ndarray], firsts: list[int]) -> str:
    """Format overlaps, skate and jerk as one line."""
    depth, fps = np.concatenate(overlap_depths(motions, firsts)), motions[0].fps
    joints = [forward_kinematics(motion)[0] for motion in motions]
    skate = np.concatenate([
        contact_speeds(places[:, foot_joints(motion.skeleton)], stands, fps).ravel()
        for motion, places, stands in zip(motions, joints, contacts)
    ])
    hard = np.concatenate([jerk(places, fps) for places in joints])
    return (
        f"deepest {100 * depth.max():.1f} cm, {np.sum(depth > 0.02) / fps:.1f} player seconds deeper than 2 cm of "
        f"{len(depth) / fps:.0f}; skate {100 * np.nanmean(skate):.2f} cm/s; jerk p95 {np.percentile(hard, 95):.0f}, "
        f"max {hard.max():.0f} m/s^3"
    )


def what_is_changed(corrections: list[Correction], takes: list[Take], firsts: list[int]) -> str:
    """Format how far roots and arms are moved, and how often, as one line."""
    curves = np.concatenate([own.curves(at, len(take.motion)) for own, take, at in zip(corrections, takes, firsts)])
    root, arms = np.linalg.norm(curves[:, ROOT], axis=1), np.linalg.norm(curves[:, ARMS].reshape(-1, 2, 3), axis=2)
    knots = sum(len(own.knots) for own in corrections)
    return (
        f"changed {100 * curves.any(axis=1).mean():.1f}% of the time: roots by {100 * root.max():.1f} cm at most, arms "
        f"by {np.degrees(arms.max()):.0f} degrees; {knots} knots, {knots * 32 / 1024:.0f} KiB"
    )


def crowd_section() -> list[str]:
    """Build the lines for results.md: SECONDS of a recorded half, synthesized and measured."""
    with tempfile.TemporaryDirectory() as place:
        folder, cache, recordings = Path(place) / "match", Path(place) / "cache", DATA / "mocap" / "cmu10"
        order = MatchOrder(DATA / "tracking" / "match" / "nl2019_half1.dat", recordings, folder, cache=cache,
                           unit=CMU_UNIT, start=SECONDS[0], end=SECONDS[1], figures=False)
        took, result = seconds(lambda: make_match(order), 1)
        library = build(recordings, unit=CMU_UNIT, cache_dir=cache)
        made = f"- {len(result.done)} players in {took:.1f} s of processor time, {len(result.failed)} failed"
        return [made, *(f"- {line}" for line in crowd_lines(folder, library))]


def crowd_lines(folder: Path, library: Library) -> list[str]:
    """Measure all players of a match folder together, without and with their corrections."""
    edits = [read_player(path) for path in sorted(folder.glob("*.take.npz"))]
    pairs = [(take, edit) for edit in edits for take in expanded(library, edit, *SECONDS)]
    takes, fps = [take for take, _ in pairs], pairs[0][0].motion.fps
    firsts, contacts = [round(take.start_time * fps) for take in takes], [take.contacts for take in takes]
    motions = [take.motion for take in takes]
    kept = [edit.correction or Correction.none(fps) for _, edit in pairs]
    corrected = [applied(*each) for each in zip(motions, kept, firsts)]
    took, _ = seconds(lambda: kept_apart(motions, contacts, firsts, fps), 1)
    return [f"{len(takes)} takes; in step {100 * step_share(library, takes, firsts):.2f}%",
            f"without corrections: {figures(motions, contacts, firsts)}",
            f"with them: {figures(corrected, contacts, firsts)}", what_is_changed(kept, takes, firsts),
            f"collision avoidance again in {took:.1f} s of processor time"]


def windows(match: Match) -> list[tuple[str, float]]:
    """List (player, start in s) of what is measured."""
    ids = [player.id for player in match.players][::EVERY]
    return [(player, STARTS[number % len(STARTS)]) for number, player in enumerate(ids)]


def window_row(library: Library, match: Match, player: str, start: float) -> str:
    """Measure one player over one window: the search alone, and everything, per 20 s."""
    track, _ = clean(match.track(player, start, start + WINDOW))
    plan = Plan(track=track, nearest=True)
    resolved = resolve_plan(plan, library)
    known = search_library(library, resolved)
    order, weights = build_order(known, resolved), balanced(plan.alpha)
    searched, _ = seconds(lambda: PathSearch(known, order, weights).run())
    whole, take = seconds(lambda: synthesize(library, plan))
    share = 20.0 / (track.times[-1] - track.times[0])
    cells = [player, f"{start:g}", f"{np.mean(order.track.speed):.2f}", str(len(take.seams))]
    return format_row([*cells, f"{share * searched:.3f}", f"{share * whole:.3f}"])


def half_row(match: Match) -> str:
    """Measure cleaning and sampling of one player's whole half."""
    track = match.track(match.players[0].id)
    cleaned, (known, _) = seconds(lambda: clean(track))
    sampled, _ = seconds(lambda: sample(known, 30.0))
    minutes = (track.times[-1] - track.times[0]) / 60
    return format_row([match.players[0].id, f"{minutes:.1f}", f"{cleaned:.3f}", f"{sampled:.3f}"])


def peak_memory() -> str:
    """Report the peak memory of this process."""
    import resource

    kilo = 1024 if sys.platform == "darwin" else 1
    return f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024 / kilo:.0f} MiB at most in this process"


def speed_section() -> list[str]:
    """Build the lines for results.md."""
    with tempfile.TemporaryDirectory() as cache:
        library = build(DATA / "mocap" / "cmu10", unit=CMU_UNIT, cache_dir=cache)
        match = read_match(DATA / "tracking" / "match" / "nl2019_half1.dat", cache_dir=cache)
        lines = format_head(("player", "from, s", "mean m/s", "transitions", "search, s per 20 s",
                             "all, s per 20 s (target 0.35)"))
        lines += [window_row(library, match, *window) for window in windows(match)]
        lines += ["", *format_head(("player", "min", "clean, s", "sample, s")), half_row(match), "", peak_memory()]
    return lines
