"""Cost of the players of a match, and how they get on together.

`speed_section`: processor seconds of search, construction and polishing per 20 s of motion, and of reading and cleaning
a whole half. `stages_section`: what each stage of a match costs. `crowd_section`: overlaps between players, the cost of
collision avoidance, and players in step; overlaps, skate and jerk without and with the corrections. The share in step
refers to the time of all players.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.effort import format_head, format_row, measure_seconds
from benchmarks.places import CMU_UNIT, DATA, library_folder
from beyond_mocap.files.tracking.tracking import Match, read_match
from beyond_mocap.library.build import build_library
from beyond_mocap.library.library import Library
from beyond_mocap.match.crowd.collision_avoidance import measure_overlap_depths, resolve_collisions
from beyond_mocap.match.crowd.correction import ARMS, ROOT, Correction, apply_correction
from beyond_mocap.match.crowd.variety import measure_share_in_step
from beyond_mocap.match.folder import read_state
from beyond_mocap.match.player_file import read_player
from beyond_mocap.match.player_motion import construct_player
from beyond_mocap.match.request import MatchRequest
from beyond_mocap.match.synthesize_match import synthesize_match
from beyond_mocap.motion.motion import Motion, forward_kinematics
from beyond_mocap.motion.track import clean_track, sample_track
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.quality.movement import compute_jerk, list_foot_joints, measure_contact_speeds
from beyond_mocap.synthesis.resolve_plan import resolve_plan
from beyond_mocap.synthesis.search.cost_weights import balance_weights
from beyond_mocap.synthesis.search.path_search import PathSearch
from beyond_mocap.synthesis.search.request import build_request
from beyond_mocap.synthesis.search_library import extend_library
from beyond_mocap.synthesis.synthesize import synthesize
from beyond_mocap.synthesis.take import Take

SECONDS = (1480.0, 1500.0)
"""Stretch of the recorded half in which players are close together, so that collision avoidance has work to do."""
WINDOW = 60.0  # s that are measured of a player
STARTS = (60.0, 600.0, 1200.0, 1800.0, 2400.0)  # s at which windows begin
EVERY = 4
"""Every fourth player is measured, each in the next window."""
STAGE_SECONDS, STAGE_PLAYERS = (300.0, 600.0), 6
"""Stretch of the recorded half whose stages are measured, and how many of its players."""
HALF_MINUTES, HALF_PLAYERS, CORES = 46.0, 22, 2  # what is extrapolated


def measure_step_share(library: Library, takes: list[Take], firsts: list[int]) -> float:
    """Measure the share of the time of all players in which they are in step with a neighbour.

    Args:
        library: the clips.
        takes: takes of all players.
        firsts: frame of the match at which each begins.
    """
    start, fps = min(firsts), takes[0].motion.fps
    count = max(first + len(take.motion) for first, take in zip(firsts, takes)) - start
    rates = {clip.path: clip.motion.fps for clip in library.with_synthetic_clips.clips}
    names: dict[tuple[str, bool], int] = {}
    clip_numbers, ages = np.full((len(takes), count), -1), np.zeros((len(takes), count))
    places = np.zeros((len(takes), count, 2))
    for row, (take, first) in enumerate(zip(takes, firsts)):
        here = slice(first - start, first - start + len(take.motion))
        what = [(take.clips[clip], bool(mirrored)) for clip, mirrored in zip(take.clip, take.mirrored)]
        clip_numbers[row, here] = [names.setdefault(each, len(names)) for each in what]
        ages[row, here] = take.clip_frame / np.array([rates.get(path, fps) for path, _ in what])
        places[row, here] = take.motion.root_positions[:, :2]
    return measure_share_in_step(clip_numbers, ages, places)


def describe_figures(motions: list[Motion], contacts: list[np.ndarray], firsts: list[int]) -> str:
    """Format overlaps, skate and jerk as one line."""
    depth, fps = np.concatenate(measure_overlap_depths(motions, firsts)), motions[0].fps
    joints = [forward_kinematics(motion)[0] for motion in motions]
    skate = np.concatenate([
        measure_contact_speeds(places[:, list_foot_joints(motion.skeleton)], in_contact, fps).ravel()
        for motion, places, in_contact in zip(motions, joints, contacts)
    ])
    hard = np.concatenate([compute_jerk(places, fps) for places in joints])
    return (
        f"deepest {100 * depth.max():.1f} cm, {np.sum(depth > 0.02) / fps:.1f} player seconds deeper than 2 cm of "
        f"{len(depth) / fps:.0f}; skate {100 * np.nanmean(skate):.2f} cm/s; jerk p95 {np.percentile(hard, 95):.0f}, "
        f"max {hard.max():.0f} m/s^3"
    )


def describe_corrections(corrections: list[Correction], takes: list[Take], firsts: list[int]) -> str:
    """Format how far roots and arms are moved, and how often, as one line."""
    found = zip(corrections, takes, firsts)
    curves = np.concatenate([own.build_curves(at, len(take.motion)) for own, take, at in found])
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
        order = MatchRequest(DATA / "tracking" / "match" / "nl2019_half1.dat", recordings, folder, cache=cache,
                             unit=CMU_UNIT, start=SECONDS[0], end=SECONDS[1], figures=False)
        took, result = measure_seconds(lambda: synthesize_match(order), 1)
        library = build_library(recordings, unit=CMU_UNIT, cache_dir=cache)
        summary = f"- {len(result.finished)} players in {took:.1f} s of processor time, {len(result.failed)} failed"
        return [summary, *(f"- {line}" for line in build_crowd_lines(folder, library))]


def build_crowd_lines(folder: Path, library: Library) -> list[str]:
    """Measure all players of a match folder together, without and with their corrections."""
    edits = [read_player(path) for path in sorted(folder.glob("*.take.npz"))]
    pairs = [(take, edit) for edit in edits for take in construct_player(library, edit, *SECONDS)]
    takes, fps = [take for take, _ in pairs], pairs[0][0].motion.fps
    firsts, contacts = [round(take.start_time * fps) for take in takes], [take.contacts for take in takes]
    motions = [take.motion for take in takes]
    corrections = [edit.correction or Correction.build_empty(fps) for _, edit in pairs]
    corrected = [apply_correction(*each) for each in zip(motions, corrections, firsts)]
    took, _ = measure_seconds(lambda: resolve_collisions(motions, contacts, firsts, fps), 1)
    return [f"{len(takes)} takes; in step {100 * measure_step_share(library, takes, firsts):.2f}%",
            f"without corrections: {describe_figures(motions, contacts, firsts)}",
            f"with them: {describe_figures(corrected, contacts, firsts)}",
            describe_corrections(corrections, takes, firsts),
            f"collision avoidance again in {took:.1f} s of processor time"]


def list_windows(match: Match) -> list[tuple[str, float]]:
    """List (player, start in s) of what is measured."""
    ids = [player.id for player in match.players][::EVERY]
    return [(player, STARTS[number % len(STARTS)]) for number, player in enumerate(ids)]


def build_window_row(library: Library, match: Match, player: str, start: float) -> str:
    """Measure one player over one window: the search alone, and everything, per 20 s."""
    track, _ = clean_track(match.track(player, start, start + WINDOW))
    plan = Plan(track=track, nearest=True)
    resolved = resolve_plan(plan, library)
    extended = extend_library(library, resolved)
    request, weights = build_request(extended, resolved), balance_weights(plan.alpha)
    searched, _ = measure_seconds(lambda: PathSearch(extended, request, weights).run())
    whole, take = measure_seconds(lambda: synthesize(library, plan))
    share = 20.0 / (track.times[-1] - track.times[0])
    cells = [player, f"{start:g}", f"{np.mean(request.track.speed):.2f}", str(len(take.seams))]
    return format_row([*cells, f"{share * searched:.3f}", f"{share * whole:.3f}"])


def build_half_row(match: Match) -> str:
    """Measure cleaning and sampling of one player's whole half."""
    track = match.track(match.players[0].id)
    cleaned, (known, _) = measure_seconds(lambda: clean_track(track))
    sampled, _ = measure_seconds(lambda: sample_track(known, 30.0))
    minutes = (track.times[-1] - track.times[0]) / 60
    return format_row([match.players[0].id, f"{minutes:.1f}", f"{cleaned:.3f}", f"{sampled:.3f}"])


def stages_section() -> list[str]:
    """Build the lines for results.md: the stages of STAGE_PLAYERS players, library mixed, in this process."""
    with tempfile.TemporaryDirectory() as place:
        folder, recordings, cache = Path(place) / "match", library_folder("mixed", Path(place)), Path(place) / "cache"
        feed = DATA / "tracking" / "match" / "nl2019_half1.dat"
        players = read_match(feed, cache_dir=cache).players
        chosen = tuple(player.id for player in players[1 :: len(players) // STAGE_PLAYERS][:STAGE_PLAYERS])
        warm_up = MatchRequest(feed, recordings, Path(place) / "first", cache=cache, start=STAGE_SECONDS[0],
                               end=STAGE_SECONDS[0] + 10.0, players=chosen[:1])
        synthesize_match(warm_up)  # what is computed once for each process and library
        synthesize_match(replace(warm_up, out=folder, end=STAGE_SECONDS[1], players=chosen))
        state = read_state(folder)
    minutes = sum(end - start for row in state["players"] for start, end in row["stretches_s"]) / 60.0
    return [*build_stage_rows(state, minutes), "", report_peak_memory()]


def build_stage_rows(state: dict, minutes: float) -> list[str]:
    """Build a table of the stages of a match's state with so many minutes of players: processor seconds per minute of a
    player, and minutes of clock time of a whole half.
    """
    main, shared, match_minutes = state["main_cpu_s"], state["worker_cpu_s"], (state["to_s"] - state["from_s"]) / 60.0
    scale = HALF_MINUTES * HALF_PLAYERS / minutes
    # seconds, and seconds of a half: the ball is one for all players, the page has a fixed number of pictures
    stages = {"ball": (main["ball"], main["ball"] / match_minutes * HALF_MINUTES),
              "words": (main["words"], main["words"] * scale),
              **{name: (seconds, seconds * scale / CORES) for name, seconds in shared.items()},
              "page": (main["page"], main["page"])}
    whole = sum(seconds for seconds, _ in stages.values())
    lines = format_head(("stage", "s per player-minute", "share", "a half, min"))
    lines += [format_row([name, f"{seconds / minutes:.3f}", f"{100 * seconds / whole:.0f}%", f"{half / 60:.1f}"])
              for name, (seconds, half) in stages.items()]
    lists = sum(stages[name][1] for name in ("ball", "words", "search")) / 60.0
    everything = sum(half for _, half in stages.values()) / 60.0
    return [*lines, "", f"a half of {HALF_MINUTES:g} min, {HALF_PLAYERS} players, {CORES} cores, extrapolated from "
            f"{minutes:.0f} minutes of players: edit lists {lists:.1f} min (target 4), everything {everything:.1f} min "
            "(target 7)"]


def report_peak_memory() -> str:
    """Report the peak memory of this process."""
    import resource

    kilo = 1024 if sys.platform == "darwin" else 1
    return f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024 / kilo:.0f} MiB at most in this process"


def speed_section() -> list[str]:
    """Build the lines for results.md."""
    with tempfile.TemporaryDirectory() as cache:
        library = build_library(DATA / "mocap" / "cmu10", unit=CMU_UNIT, cache_dir=cache)
        match = read_match(DATA / "tracking" / "match" / "nl2019_half1.dat", cache_dir=cache)
        lines = format_head(("player", "from, s", "mean m/s", "transitions", "search, s per 20 s",
                             "all, s per 20 s (target 0.35)"))
        lines += [build_window_row(library, match, *window) for window in list_windows(match)]
        lines += ["", *format_head(("player", "min", "clean, s", "sample, s")), build_half_row(match), "",
                  report_peak_memory()]
    return lines
