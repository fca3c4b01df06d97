"""What a match takes: stages, processor time, memory, with one worker and with two, and what follows for more.

    python -m benchmarks.match_job MATCH LIBRARY [--from S --to S] [--workers N ...] [--cache DIR]

Every number of workers makes the span in a folder of its own, from nothing; the edit lists have to be the same bits.
The extrapolation takes a half as 46 minutes of 22 players and a match as two, each stage's processor time growing with
the seconds; a season has 380 matches.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from beyond_mocap.match.folder import read_state
from beyond_mocap.match.make import make_match
from beyond_mocap.match.order import MatchOrder

HALF, MATCHES = 46 * 60.0, 380
STAGES = ("read", "library", "ball", "words", "search", "crowd", "figures", "total")


def made(order: MatchOrder) -> tuple[dict, dict[str, bytes]]:
    """What match.json says of an order that is made, and its edit lists."""
    make_match(order)
    return read_state(order.out), {path.name: path.read_bytes() for path in order.out.glob("*.take.npz")}


def row(workers: int, state: dict) -> str:
    """One line of the table."""
    seconds = " ".join(f"{state['seconds'].get(stage, 0.0):7.1f}" for stage in STAGES)
    cpu = " ".join(f"{stage} {value:.1f}" for stage, value in state["worker_cpu_s"].items())
    memory = state["peak_memory_mb"]
    whole = memory["main"] + workers * memory["worker"] * (workers > 1)
    return f"{workers:7d} {seconds}   {cpu}; at most {whole:.0f} MB in all ({memory['main']:.0f} + workers)"


def extrapolated(state: dict) -> list[str]:
    """Lines on a half and a season, out of one state."""
    span = state["to_s"] - state["from_s"]
    players = sum(end - start for one in state["players"] for start, end in one["stretches_s"]) / span
    cpu, alone = state["worker_cpu_s"], state["main_cpu_s"]["ball"] + state["main_cpu_s"]["words"]
    share = HALF / span * 22.0 / players
    lists = cpu["search"] * share / 2.0 + alone * HALF / span
    whole = sum(cpu.values()) * share + alone * HALF / span
    hours = 2.0 * whole * MATCHES / 3600.0
    return [
        f"a half of 46 min, 22 players, two cores, to edit lists: {lists / 60.0:.1f} min "
        f"({cpu['search'] * share:.0f} s of search, {alone * HALF / span:.0f} s of ball and words)",
        f"a match with crowd and figures: {2.0 * whole / 60.0:.0f} min of one core; "
        f"a season of {MATCHES} matches: {hours:.0f} core hours, {hours / 64.0:.1f} h on 64 cores",
    ]


def main() -> None:
    """Prints the table and the extrapolation."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.match_job")
    parser.add_argument("match", type=Path)
    parser.add_argument("library", type=Path)
    parser.add_argument("--from", dest="start", type=float, default=0.0)
    parser.add_argument("--to", dest="end", type=float, default=60.0)
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--cache", type=Path)
    options = parser.parse_args()
    print("workers " + " ".join(f"{stage:>7s}" for stage in STAGES) + "   processor time of workers, s")
    lists = []
    with tempfile.TemporaryDirectory() as place:
        for workers in options.workers:
            order = MatchOrder(
                options.match, options.library, Path(place) / str(workers), cache=options.cache, start=options.start,
                end=options.end, workers=workers,
            )  # fmt: skip
            state, files = made(order)
            lists.append(files)
            print(row(workers, state), flush=True)
    print("edit lists the same bits: " + ("yes" if all(one == lists[0] for one in lists) else "NO"))
    print("\n".join(extrapolated(state)))


if __name__ == "__main__":
    main()
