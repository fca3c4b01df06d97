"""Which networks the experiments train, on whom, and the queue that works them off one after another, resumable.

A run is one model trained on one subject and tested on all others. What it found is one line of `throw_results`,
written whole, so a queue that was killed goes on where it was, on another machine too: a run with a line is done, a
training that was broken off goes on from its checkpoint.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks import throw_results

HIS = {"conditioned": False, "ik_layer": False, "rollout": 1, "frame": "static", "phase": "distance", "noise": 0.0,
       "linear_start": False, "guided": False, "carried": False, "learning_rate": 3e-4, "l1": 0.01, "limb_weight": 50.0,
       "body_weight": 33.0}
"""What all of his models have in common (§7). He names no learning rate."""
FED = {"conditioned": True, "batch": 128, "rollout": 4, "noise": 0.02, "keep": 1.0, "learning_rate": 1e-3}
"""What keeps a network that is given its own answers on the road: they are fed back in training too, from poses that
are somewhat off."""


LEAST = 96
"""Units, as shipped weights have them: fewer cannot carry the linear start of the body, which takes two for each
answer."""


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
    batch, motions of each subject that are tested, None for all. steps: of Adam, in place of epochs, so that whoever
    has fewer recordings is trained as long. fed: the same of networks that are fed back, whose steps see several
    frames."""

    name: str
    units: int
    epochs: int
    batch: int
    motions: int | None
    steps: int | None = None
    fed: int | None = None


PAPER = Scale("paper", 256, 400, 32, None)
"""His sizes, macro-epochs and batches (§7.6; 600 epochs for the single network)."""
QUICK = Scale("quick", 64, 40, 32, 4, 2000, 640)


def variants(scale: Scale) -> tuple[Variant, ...]:
    """All variants, in the order in which they are worked off."""
    few = {"units": scale.units, "batch": scale.batch, **_long(scale.epochs, scale.steps)}
    longer = _long(scale.epochs * 3 // 2, scale.steps and scale.steps * 3 // 2)
    many = {"units": 2 * scale.units, "layers": 4, "batch": scale.batch, **longer}
    again = _long(scale.epochs, scale.fed)
    dropped = {"keep": 0.7}
    first = {**HIS, **dropped, "wrist": "inferred"}
    second = {**HIS, **dropped, "wrist": "given"}
    single = {**first, **many, "kind": "single"}
    ours = {**FED, **_long(scale.epochs // 2, scale.fed and scale.fed // 2), "guided": True, "carried": True,
            "linear_start": True, "ridge": 0.0, "start_noise": 0.07, "rollout": 8, "learning_rate": 1e-4,
            "frame": "hip",
            "wrist": "given", "units": max(scale.units, LEAST)}
    shipped = {**ours, "epochs": 0, "steps": None, "units": LEAST}
    plain = {"wrist": "given", "frame": "hip", "units": 1, "layers": 1, "guided": False, "carried": False}
    return (
        *(Variant(name, words, {**plain, **changes}, not name.endswith("raw"), linear=True)
          for name, words, changes in (
            ("linear", "six linear maps", {"points": 1}), ("linear-phased", "six linear maps, by phase", {}),
            ("linear-raw", "six linear maps", {"points": 1}), ("linear-phased-raw", "six linear maps, by phase", {}),
            ("linear-single-raw", "one linear map, by phase", {"kind": "single"}),
            ("linear-guided", "six linear maps, by phase, limbs told how they would reach", {"guided": True}),
            ("linear-guided-raw", "six linear maps, by phase, limbs told how they would reach", {"guided": True}),
        )),
        Variant("single-raw", "one phase-functioned network", single, False),
        Variant("hierarchy-raw", "six phase-functioned networks", {**first, **few, "layers": 3}, False),
        Variant("hierarchy", "six phase-functioned networks, wrists given", {**second, **few, "layers": 3}, True),
        Variant("feed-forward", "six feed-forward networks, wrists given",
                {**second, **few, "layers": 8, "points": 1}, True),
        Variant("single-fed-raw", "one network, its own frames fed back in training", {**single, **again, **FED},
                False),
        Variant("hierarchy-fed-raw", "six networks in order, their own frames fed back in training",
                {**first, **few, **again, **FED, "layers": 3}, False),
        Variant("single-effectors", "one network with the end-effector loss (§9.2)",
                {**single, "single_effector": True}, False),
        Variant("single-effectors-fed", "one network, fed back, with the end-effector loss (§9.2)",
                {**single, **again, **FED, "single_effector": True}, False),
        Variant("feed-forward-equal", "six feed-forward networks with as many parameters as the six",
                {**second, **few, "layers": 8, "points": 1, "units": "equal"}, True),
        Variant("start", "as the shipped weights: limbs guided, linear by phase, the ridge chosen", shipped, True),
        Variant("start-raw", "as the shipped weights", shipped, False),
        Variant("start-everyone", "as the shipped weights, from all others retargeted (§10.2)", shipped, True, True),
        Variant("start-warped", "as the shipped weights, phases warped in time (§9.3)", {**shipped, "phase": "warped"},
                True),
        Variant("ours", "six networks trained in order, fed back (§9.4)", ours, True),
        Variant("ours-ik", "ours with inverse kinematics inside the loss (§9.4)", {**ours, "ik_layer": True}, True),
        Variant("ours-warped", "ours with phases warped in time (§9.3)", {**ours, "phase": "warped"}, True),
        Variant("ours-everyone", "ours, trained on all others retargeted (§10.2)", ours, True, True),
    )


def _long(epochs: int, steps: int | None) -> dict:
    """How long is trained."""
    return {"epochs": epochs} if steps is None else {"steps": steps}


@dataclass(frozen=True)
class Run:
    """One model: which data, which variant, which subject (trained on; for `everyone`, tested on)."""

    data: str
    variant: Variant
    subject: str

    @property
    def key(self) -> throw_results.Key:
        """Its place among the results."""
        return self.data, self.variant.name, self.subject

    def place(self, folder: Path) -> Path:
        """Where its model is, without a suffix; variants that are only tested otherwise share one."""
        trained = _letters(self.variant.config, self.variant.everyone, self.variant.linear)
        return folder / self.data / trained / self.subject

    def stamp(self, scale: Scale) -> str:
        """What is asked for, as 12 letters: results of anything else are not this run's."""
        return _letters(
            self.variant.config, self.variant.corrected, self.variant.everyone, self.variant.linear, scale.motions
        )


def _letters(*asked) -> str:
    return hashlib.sha256(json.dumps(asked, sort_keys=True).encode()).hexdigest()[:12]


def runs(data: Sequence[tuple[str, Sequence[str]]], chosen: Sequence[Variant]) -> Iterator[Run]:
    """Variant after variant, in each of them data after data, all subjects: pairs that are compared end together."""
    for variant in chosen:
        for name, subjects in data:
            for subject in subjects:
                yield Run(name, variant, subject)


def work_off(
    todo: Sequence[Run], scale: Scale, kept: Path, do: Callable[[Run], dict], until: float = float("inf"),
    told: Callable[[str], None] = print,
) -> int:
    """Works off what is not done; how many are left. kept: folder of the results. do: gets a run, returns what it
    found. until: seconds of the clock (`time.time`) after which no further run is begun."""

    # asked for each anew: another process may work off the same queue from its other end
    def is_done(run: Run) -> bool:
        found = throw_results.read(kept, scale.name).get(run.key)
        return found is not None and found.get("stamp") == run.stamp(scale)

    left = [run for run in todo if not is_done(run)]
    for order, run in enumerate(left):
        if is_done(run):
            continue
        if time.time() >= until:
            told(f"{len(left) - order} of {len(todo)} runs are left; the same command goes on")
            return len(left) - order
        begun = time.perf_counter()
        told(f"{len(todo) - len(left) + order + 1} of {len(todo)}: {run.data}, {run.variant.name}, {run.subject}")
        found = do(run)
        throw_results.keep(kept, scale.name, run.key, {"stamp": run.stamp(scale), **found})
        told(f"    {(time.perf_counter() - begun) / 60.0:.2f} minutes")
    return 0
