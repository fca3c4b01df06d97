"""Which networks the experiments train, on whom, and the queue that works them off one after another, resumable.

A run is one model trained on one subject and tested on all others. What it found is one small JSON, written whole, so a
queue that was killed goes on where it was: a run with a JSON is done, a training that was broken off goes on from its
checkpoint.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from beyond_mocap.files.whole import atomic_write

HIS = {"conditioned": False, "ik_layer": False, "rollout": 1, "frame": "static", "phase": "distance", "noise": 0.0,
       "linear_start": False, "guided": False}
"""What all of his models have in common (§7)."""


@dataclass(frozen=True)
class Variant:
    """name: in file names and tables. words: what it is, for people. config: names of `training.config`. corrected:
    whether it is tested with pose iterations and inverse kinematics (tables 8.5 to 8.8) or without (8.1 to 8.4).
    everyone: trained on all subjects but the one that it is tested on. linear: linear maps in place of networks."""

    name: str
    words: str
    config: dict
    corrected: bool
    everyone: bool = False
    linear: bool = False


@dataclass(frozen=True)
class Scale:
    """How large: units of the hierarchy's layers (the single network has twice as many, as his), epochs, frames in a
    batch, motions of each subject that are tested, None for all."""

    name: str
    units: int
    epochs: int
    batch: int
    motions: int | None


PAPER = Scale("paper", 256, 400, 32, None)
"""His sizes, macro-epochs and batches (§7.6; 600 epochs for the single network)."""
QUICK = Scale("quick", 64, 40, 128, 6)


def variants(scale: Scale) -> tuple[Variant, ...]:
    """All variants, in the order in which they are worked off."""
    few = {"units": scale.units, "epochs": scale.epochs, "batch": scale.batch}
    many = {"units": 2 * scale.units, "layers": 4, "epochs": scale.epochs * 3 // 2, "batch": scale.batch}
    dropped = {"keep": 0.7}
    first = {**HIS, **dropped, "wrist": "inferred"}
    second = {**HIS, **dropped, "wrist": "given"}
    single = {**first, **many, "kind": "single"}
    ours = {"conditioned": True, "guided": True, "linear_start": True, "ridge": 0.0, "rollout": 8, "learning_rate": 1e-4,
            "frame": "hip", "keep": 1.0, "noise": 0.02, "wrist": "given", **few}
    shipped = {**ours, "epochs": 0, "units": 96}
    plain = {"wrist": "given", "frame": "hip", "units": 1, "layers": 1, "guided": False}
    return (
        *(Variant(name, words, {**plain, **changes}, not name.endswith("raw"), linear=True) for name, words, changes in (
            ("linear", "six linear maps", {"points": 1}), ("linear-phased", "six linear maps, by phase", {}),
            ("linear-raw", "six linear maps", {"points": 1}), ("linear-phased-raw", "six linear maps, by phase", {}),
            ("linear-single-raw", "one linear map, by phase", {"kind": "single"}),
            ("linear-guided", "six linear maps, by phase, limbs told how they would reach", {"guided": True}),
            ("linear-guided-raw", "six linear maps, by phase, limbs told how they would reach", {"guided": True}),
        )),
        Variant("hierarchy", "six phase-functioned networks, wrists given", {**second, **few, "layers": 3}, True),
        Variant("feed-forward", "six feed-forward networks, wrists given",
                {**second, **few, "layers": 8, "points": 1}, True),
        Variant("single-raw", "one phase-functioned network", single, False),
        Variant("hierarchy-raw", "six phase-functioned networks", {**first, **few, "layers": 3}, False),
        Variant("single-effectors", "one network with the end-effector loss (§9.2)",
                {**single, "single_effector": True}, False),
        Variant("ours", "six networks trained in order, fed back (§9.4)", ours, True),
        Variant("start", "as the shipped weights: limbs guided, linear by phase, the ridge chosen", shipped, True),
        Variant("start-raw", "as the shipped weights", shipped, False),
        Variant("start-everyone", "as the shipped weights, from all others retargeted (§10.2)", shipped, True, True),
        Variant("single-equal", "one network with as many parameters as the six", {**single, "units": "equal"}, False),
        Variant("feed-forward-equal", "six feed-forward networks with as many parameters as the six",
                {**second, **few, "layers": 8, "points": 1, "units": "equal"}, True),
        Variant("ours-ik", "ours with inverse kinematics inside the loss (§9.4)", {**ours, "ik_layer": True}, True),
        Variant("ours-warped", "ours with phases warped in time (§9.3)", {**ours, "phase": "warped"}, True),
        Variant("ours-everyone", "ours, trained on all others retargeted (§10.2)", ours, True, True),
    )


@dataclass(frozen=True)
class Run:
    """One model: which data, which variant, which subject (trained on; for `everyone`, tested on)."""

    data: str
    variant: Variant
    subject: str

    def place(self, folder: Path) -> Path:
        """Where its files are, without a suffix."""
        return folder / self.data / self.variant.name / self.subject


def runs(data: Sequence[tuple[str, Sequence[str]]], chosen: Sequence[Variant]) -> Iterator[Run]:
    """Variant after variant, in each of them data after data, all subjects: pairs that are compared end together."""
    for variant in chosen:
        for name, subjects in data:
            for subject in subjects:
                yield Run(name, variant, subject)


def results(folder: Path) -> dict[tuple[str, str, str], dict]:
    """What is done: (data, variant, subject) -> its JSON. One that cannot be read is not done."""
    found = {}
    for path in sorted(folder.glob("*/*/*.json")):
        try:
            found[path.parts[-3], path.parts[-2], path.stem] = json.loads(path.read_text("utf-8"))
        except (ValueError, OSError):
            continue
    return found


def work_off(
    todo: Sequence[Run], folder: Path, do: Callable[[Run, Path], dict], until: float = float("inf"),
    told: Callable[[str], None] = print,
) -> int:
    """Works off what is not done; how many are left. do: gets a run and where its model is to be, returns its JSON.
    until: seconds of the clock (`time.time`) after which no further run is begun."""
    done = set(results(folder))
    left = [run for run in todo if (run.data, run.variant.name, run.subject) not in done]
    for order, run in enumerate(left):
        if time.time() >= until:
            told(f"{len(left) - order} of {len(todo)} runs are left; the same command goes on")
            return len(left) - order
        place = run.place(folder)
        place.parent.mkdir(parents=True, exist_ok=True)
        begun = time.perf_counter()
        told(f"{len(todo) - len(left) + order + 1} of {len(todo)}: {run.data}, {run.variant.name}, {run.subject}")
        found = do(run, place.with_suffix(".npz"))
        minutes = (time.perf_counter() - begun) / 60.0
        atomic_write(place.with_suffix(".json"), json.dumps({**found, "minutes": minutes}, indent=1) + "\n")
        told(f"    {minutes:.2f} minutes")
    return 0
