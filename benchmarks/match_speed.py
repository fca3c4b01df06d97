"""What a player of a match costs: processor seconds of search, construction and polishing per 20 s of motion, and what
reading and cleaning a whole half costs.
"""

from __future__ import annotations

import sys
import tempfile

import numpy as np

from benchmarks.effort import seconds
from benchmarks.markdown import head, row
from benchmarks.places import CMU_UNIT, DATA
from beyond_mocap.files.tracking.tracking import Match, read_match
from beyond_mocap.library.build import build
from beyond_mocap.library.library import Library
from beyond_mocap.motion.track import clean, sample
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.resolve_plan import resolve_plan
from beyond_mocap.synthesis.search.path_costs import balanced
from beyond_mocap.synthesis.search.path_search import PathSearch
from beyond_mocap.synthesis.search.wanted import build_order
from beyond_mocap.synthesis.search_library import search_library
from beyond_mocap.synthesis.synthesize import synthesize

WINDOW = 60.0
STARTS = (60.0, 600.0, 1200.0, 1800.0, 2400.0)
EVERY = 4
"""Of the players each fourth is measured, in windows that go round."""


def windows(match: Match) -> list[tuple[str, float]]:
    """(player, start in s) of what is measured."""
    ids = [player.id for player in match.players][::EVERY]
    return [(player, STARTS[number % len(STARTS)]) for number, player in enumerate(ids)]


def window_row(library: Library, match: Match, player: str, start: float) -> str:
    """One player over one window: the search alone, and everything, per 20 s."""
    track, _ = clean(match.track(player, start, start + WINDOW))
    plan = Plan(track=track, nearest=True)
    resolved = resolve_plan(plan, library)
    known = search_library(library, resolved)
    order, weights = build_order(known, resolved), balanced(plan.alpha)
    searched, _ = seconds(lambda: PathSearch(known, order, weights).run())
    whole, take = seconds(lambda: synthesize(library, plan))
    share = 20.0 / (track.times[-1] - track.times[0])
    cells = [player, f"{start:g}", f"{np.mean(order.track.speed):.2f}", str(len(take.seams))]
    return row([*cells, f"{share * searched:.3f}", f"{share * whole:.3f}"])


def half_row(match: Match) -> str:
    """One player's whole half, cleaned and sampled."""
    track = match.track(match.players[0].id)
    cleaned, (known, _) = seconds(lambda: clean(track))
    sampled, _ = seconds(lambda: sample(known, 30.0))
    minutes = (track.times[-1] - track.times[0]) / 60
    return row([match.players[0].id, f"{minutes:.1f}", f"{cleaned:.3f}", f"{sampled:.3f}"])


def peak_memory() -> str:
    """What the process has held at most."""
    import resource

    kilo = 1024 if sys.platform == "darwin" else 1
    return f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024 / kilo:.0f} MiB at most in this process"


def section() -> list[str]:
    """Lines for results.md."""
    with tempfile.TemporaryDirectory() as cache:
        library = build(DATA / "mocap" / "cmu10", unit=CMU_UNIT, cache_dir=cache)
        match = read_match(DATA / "tracking" / "match" / "nl2019_half1.dat", cache_dir=cache)
        lines = head(("player", "from, s", "mean m/s", "seams", "search, s per 20 s", "all, s per 20 s (target 0.35)"))
        lines += [window_row(library, match, *window) for window in windows(match)]
        lines += ["", *head(("player", "min", "clean, s", "sample, s")), half_row(match), "", peak_memory()]
    return lines
