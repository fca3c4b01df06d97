"""Windows of a match against one long search: how much of a player is the same, and what the windows cost.

    python -m benchmarks.match_windows MATCH LIBRARY [--players ID ...] [--from S --to S] [--windows S ...]
        [--overlaps S ...]

Every player is searched once over the whole span and once in windows, which are joined. Frames that show the same clip
at the same frame (to within a tenth of one) are counted, all of them and those further than the overlap from any joint;
beside it what `PathCosts` says each way costs per slot, seams per minute, and how many joints lie where both windows
agree. The row "later" is one long search too, which begins LATER seconds after the other: a beam does not find the very
best way, so even that shows something else for a while.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from beyond_mocap.files.tracking import read_match
from beyond_mocap.library.features import FPS
from beyond_mocap.library.library import Library
from beyond_mocap.library.build import build
from beyond_mocap.match.cut_plan import cut_plan
from beyond_mocap.match.library_clips import bound
from beyond_mocap.match.named_edit import NamedEdit, part
from beyond_mocap.match.searched import searched, searched_library
from beyond_mocap.match.splice import spliced
from beyond_mocap.match.units import units_of
from beyond_mocap.motion.track import clean
from beyond_mocap.plan import Plan
from beyond_mocap.resolve_plan import resolve_plan
from beyond_mocap.synthesis.offer import RATES, SLOT
from beyond_mocap.synthesis.path_costs import PathCosts
from beyond_mocap.synthesis.wanted import build_order

LONG = 3600.0
LATER = 8.0
"""Seconds."""


def joined(library: Library, plan: Plan, window: float, overlap: float):
    """The edit list of a plan in windows, its joints, and seconds of processor time."""
    begun = time.process_time()
    pieces = [searched(library, unit) for unit in units_of(plan, 0, window, overlap)]
    edit, joints = spliced(library, [plan], pieces)
    return edit.stretches[0].edit, joints, time.process_time() - begun


def same(one: NamedEdit, other: NamedEdit) -> np.ndarray:
    """(T,) bool: frames that show the same of the same clip."""
    (clip, frame), (there, at) = one.frames(), other.frames()
    names = [np.array([f"{path} {mirrored}" for path, mirrored in edit.clips]) for edit in (one, other)]
    return (names[0][clip] == names[1][there]) & (np.abs(frame - at) < 0.1)


def cost(library: Library, plan: Plan, edit: NamedEdit) -> float:
    """What a way costs, per slot: what is missed in each slot of the grid, and its cuts."""
    library = searched_library(library, plan)
    order, edit = build_order(library, resolve_plan(plan, library)), bound(library, edit)
    costs, total = PathCosts(library, order), 0.0
    for low in range(0, len(edit) - SLOT, SLOT):
        step = edit.frame[low + 1] - edit.frame[low]
        number = np.array([np.abs(RATES - step).argmin()])
        frame = costs.inside(edit.frame[low : low + 1])
        found = sum(float(np.ravel(values)[0]) for _, values in costs.misfit_terms(low, low + SLOT, number, frame))
        total += found
    for seam in edit.seams:
        step = edit.frame[seam - 1] - edit.frame[seam - 2] if seam > 1 else 1.0
        terms = costs.cut_terms(edit.frame[[seam - 1]] + step, edit.frame[[seam]])
        total += sum(float(np.ravel(values)[0]) for _, values in terms)
    return total / (len(edit) / SLOT)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("match")
    parser.add_argument("library")
    parser.add_argument("--players", nargs="+", default=["home_5", "away_4"])
    parser.add_argument("--from", dest="start", type=float, default=300.0)
    parser.add_argument("--to", dest="end", type=float, default=600.0)
    parser.add_argument("--windows", nargs="+", type=float, default=[60.0])
    parser.add_argument("--overlaps", nargs="+", type=float, default=[4.0, 8.0, 12.0])
    parser.add_argument("--cache")
    asked = parser.parse_args()
    match, library = read_match(asked.match), build(asked.library, cache_dir=asked.cache)
    print("| player | window s | overlap s | same % | same away from joints % | joints agreed | cost (long) | "
          "seams/min (long) | s CPU (long) |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|---|")
    for player in asked.players:
        track, _ = clean(match.track(player, asked.start, asked.end))
        plan = Plan(track=track, nearest=True)
        long, _, took = joined(library, plan, LONG, 4.0)
        rows = [cost(library, plan, long), 60.0 * FPS * len(long.seams) / len(long), took]
        first = int(LATER * FPS)
        later, _, _ = joined(library, cut_plan(plan, track.times[0] + LATER, track.times[-1]), LONG, 4.0)
        agrees = same(part(long, first, first + len(later)), later)
        print(f"| {player} | later | | {100 * agrees.mean():.1f} | {100 * agrees[first:].mean():.1f} | | | | |")
        for window in asked.windows:
            for overlap in asked.overlaps:
                edit, joints, took = joined(library, plan, window, overlap)
                agrees = same(long, edit)
                away = np.abs(np.arange(len(edit))[:, None] - [joint.frame for joint in joints]).min(axis=1)
                away = away > overlap * FPS
                figures = [cost(library, plan, edit), 60.0 * FPS * len(edit.seams) / len(edit), took]
                told = " | ".join(f"{value:.3g} ({then:.3g})" for value, then in zip(figures, rows))
                print(f"| {player} | {window:g} | {overlap:g} | {100 * agrees.mean():.1f} | "
                      f"{100 * agrees[away].mean():.1f} | {sum(joint.agreed for joint in joints)} of {len(joints)} | "
                      f"{told} |", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
