"""The experiments of Fredriksson §4.5 and §8.3, with planted throws and recorded kicks: one command, resumable.

    .venv-training/bin/python -m benchmarks.throw_experiments --quick        # small networks, few epochs
    .venv-training/bin/python -m benchmarks.throw_experiments                # his sizes and epochs: a day of one core
    .venv-training/bin/python -m benchmarks.throw_experiments --quick --tables  # train nothing, write the tables

Every model is trained on one subject and tested on all others, what is asked for scaled by height. Broken off, by
Ctrl-C or `--minutes`, the same command goes on. Models and figures go below build/throw-experiments; the tables into
docs/throw-experiments.md.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from benchmarks import throw_folders, throw_results
from benchmarks.places import DATA, ROOT
from benchmarks.throw_runs import PAPER, QUICK, Run, Scale, Variant, runs, variants, work_off

PLACE = ROOT / "build" / "throw-experiments"
RESULTS = ROOT / "benchmarks" / "throw_results"
PAGE = ROOT / "docs" / "throw-experiments.md"
BEGIN, END = "<!-- tables -->", "<!-- end of tables -->"
PLANTED_SUBJECTS, PLANTED_THROWS, PLANTED_SEED = 4, 40, 1
FPS = 30.0
AROUND = {"planted": (1.6, 1.2), "lmd": (1.2, 0.8)}
"""Data -> seconds before and after the release: what comes before and after is standing."""
ACTIONS = {"planted": "throw", "lmd": "kick"}
"""Data -> what is done there."""


def folder_of(data: str) -> Path:
    """The recordings of one kind; made where they are missing."""
    if data == "lmd":
        return throw_folders.lmd_kicks()
    folder = throw_folders.PLACE / "planted_throws"
    if not (folder / "throws.csv").is_file():
        subprocess.run(
            [sys.executable, "-m", "beyond_mocap", "throw", "examples", "--out", str(folder), "--action", "throw",
             "--subjects", str(PLANTED_SUBJECTS), "--throws", str(PLANTED_THROWS), "--seed", str(PLANTED_SEED)],
            check=True, cwd=ROOT,
        )  # fmt: skip
    return folder


@lru_cache(maxsize=None)
def examples_of(data: str, skeleton_of: str | None = None) -> tuple:
    """All examples, each on its own skeleton, or all on one subject's."""
    from beyond_mocap.throw_examples import examples_in

    skeleton = None
    if skeleton_of is not None:
        skeleton = next(e.motion.skeleton for e in examples_of(data) if e.subject == skeleton_of)
    return tuple(cut(example, *AROUND[data]) for example in examples_in(folder_of(data), ACTIONS[data], FPS, skeleton))


def cut(example, before: float, after: float):
    """The example from so many seconds before its release to so many after; what windows see beyond stays known."""
    from beyond_mocap.synthesis.phase_network.example import effectors_of

    first = max(int(example.release - before * FPS), 0)
    last = min(int(example.release + after * FPS) + 1, len(example.motion))
    ways = effectors_of(example.motion)

    def known(*parts):
        parts = [part for part in parts if part is not None and len(part)]
        return np.concatenate(parts) if parts else None

    return replace(
        example, motion=example.motion.frames(first, last), release=example.release - first,
        before=known(example.before, ways[:first]), after=known(ways[last:], example.after),
    )  # fmt: skip


def subjects_of(data: str) -> tuple[str, ...]:
    """Who is in the recordings."""
    return tuple(dict.fromkeys(example.subject for example in examples_of(data)))


def worked(run: Run, folder: Path, scale: Scale) -> dict:
    """One run: trains where no model is there yet, tests, and tells both."""
    from beyond_mocap import __version__
    from beyond_mocap.evaluate_throws import FULL, RAW, evaluate_throws, some_of_each
    from beyond_mocap.files.network_npz import read_model
    from beyond_mocap.files.tables import plain
    from beyond_mocap.files.whole import atomic_write

    place = run.place(folder)
    place.parent.mkdir(parents=True, exist_ok=True)
    model_path, beside = place.with_suffix(".npz"), place.with_suffix(".trained")
    if not (model_path.is_file() and beside.is_file()):
        atomic_write(beside, json.dumps(_train(run, model_path, scale)))
    model = read_model(model_path)
    tested = [e for e in examples_of(run.data) if (e.subject == run.subject) == run.variant.everyone]
    found = evaluate_throws(model, some_of_each(tested, scale.motions), FULL if run.variant.corrected else RAW)
    return {
        "version": __version__, "training": json.loads(beside.read_text("utf-8")), "parameters": parameters_of(model),
        "broken": sum("lose the body" in line for line in found.left_out), "each": plain(found.report()["each"]),
    }  # fmt: skip


def _train(run: Run, out: Path, scale: Scale) -> dict:
    """Trains a run's model and tells how large it is and how long it was trained."""
    from training.config import config_of
    from training.train import train

    from beyond_mocap.files.network_npz import write_model

    from benchmarks.throw_linear import linear_model

    given = _given(run)
    frames = sum(len(one.motion) - 1 for one in given)
    wished = {**run.variant.config, "action": ACTIONS[run.data], "fps": FPS}
    if wished["units"] == "equal":
        wished["units"] = equal_units(run, scale, given[0].motion.skeleton)
    steps = wished.pop("steps", None)
    if steps:
        wished["epochs"] = max(1, round(steps / -(-frames // wished["batch"])))
    elif run.variant.everyone:
        wished["epochs"] = -(-wished["epochs"] // (len(subjects_of(run.data)) - 1))
    config = config_of({**wished, "mirrored": False}, run.variant.name)  # all throw and kick with the same side
    begun = time.perf_counter()
    if run.variant.linear:
        model = linear_model(given, config.settings)
    else:
        checkpoint = out.with_suffix(".checkpoint.npz")
        model = train(given, config, checkpoint=checkpoint, resume=checkpoint.is_file())
        checkpoint.unlink(missing_ok=True)
    write_model(model, out)
    return {
        "examples": len(given), "frames": frames, "units": config.settings.units, "layers": config.settings.layers,
        "steps": 0 if run.variant.linear else config.epochs * -(-frames // config.batch), "batch": config.batch,
        "rate": config.learning_rate, "minutes": round((time.perf_counter() - begun) / 60.0, 2),
    }  # fmt: skip


def _given(run: Run) -> list:
    """What a run's model is trained on."""
    if not run.variant.everyone:
        return [e for e in examples_of(run.data) if e.subject == run.subject]
    first = next(name for name in subjects_of(run.data) if name != run.subject)
    return [e for e in examples_of(run.data, first) if e.subject != run.subject]


def parameters_of(model) -> int:
    """Numbers in all networks that are not nothing."""
    return sum(int(np.count_nonzero(part)) for network in model.networks.values()
               for part in (*network.weights, *network.biases))


def equal_units(run: Run, scale: Scale, skeleton) -> int:
    """Units of a layer with which this run's networks have as many parameters as the phase-functioned hierarchy that
    they are compared with."""
    other = next(v for v in variants(scale) if v.name == "hierarchy")
    wanted = _size(skeleton, other.config)
    sizes = {units: _size(skeleton, {**run.variant.config, "units": units}) for units in range(8, 2049, 4)}
    return min(sizes, key=lambda units: abs(sizes[units] - wanted))


def _size(skeleton, config: dict) -> int:
    """Parameters of the networks that a config describes."""
    from training.config import config_of

    from beyond_mocap.synthesis.phase_network.chains import chains_of
    from beyond_mocap.synthesis.phase_network.features import widths

    settings = config_of({name: value for name, value in config.items() if name != "steps"}, "sizes").settings
    layers, units, points = settings.layers, settings.units, settings.points
    return sum(
        points * ((given + 1) * units + (layers - 1) * (units + 1) * units + (units + 1) * answered)
        for given, answered in widths(chains_of(skeleton), settings).values()
    )


def main() -> int:
    """Works off the queue and writes the tables."""
    options = argparse.ArgumentParser(prog="python -m benchmarks.throw_experiments", description=__doc__.split("\n")[0])
    options.add_argument("--quick", action="store_true", help="small networks and few epochs")
    options.add_argument("--units", type=int, help="of the hierarchy's layers; the single network has twice as many")
    options.add_argument("--epochs", type=int)
    options.add_argument("--motions", type=int, help="of each subject that are tested")
    options.add_argument("--data", nargs="+", choices=tuple(ACTIONS), default=list(ACTIONS))
    options.add_argument("--only", nargs="+", metavar="VARIANT", help="these, in this order")
    options.add_argument("--steps", type=int, help="of Adam, in place of epochs")
    options.add_argument("--minutes", type=float, help="begin no further run after so many")
    options.add_argument("--tables", action="store_true", help="train nothing; write the tables of what is done")
    chosen = options.parse_args()
    if not (DATA / "mocap" / "lmd").is_dir():
        print(f"{DATA} is missing: kicks are left out")
        chosen.data = [name for name in chosen.data if name != "lmd"]
    scale = QUICK if chosen.quick else PAPER
    given = {name: getattr(chosen, name) for name in ("units", "epochs", "motions", "steps") if getattr(chosen, name)}
    scale = replace(scale, **given)
    folder = PLACE / scale.name
    every = {variant.name: variant for variant in variants(scale)}
    unknown = [name for name in chosen.only or () if name not in every]
    if unknown:
        options.error(f"no variant {unknown[0]!r}; there are {', '.join(every)}")
    left = 0
    if not chosen.tables:
        wanted: list[Variant] = [every[name] for name in chosen.only or every]
        todo = list(runs([(name, subjects_of(name)) for name in chosen.data], wanted))
        until = time.time() + 60.0 * chosen.minutes if chosen.minutes else float("inf")
        left = work_off(
            todo, scale, RESULTS, lambda run: worked(run, folder, scale), until, lambda line: print(line, flush=True)
        )
    else:
        throw_results.tidy(RESULTS, scale.name)
        write_tables(scale)
    return 1 if left else 0


def write_tables(scale: Scale) -> None:
    """Puts the tables of what is done between the page's marks."""
    from beyond_mocap.files.whole import atomic_write

    from benchmarks.throw_tables import document

    head, _, rest = PAGE.read_text("utf-8").partition(BEGIN)
    _, _, tail = rest.partition(END)
    lines = document(throw_results.read(RESULTS, scale.name), scale)
    atomic_write(PAGE, "\n".join([head + BEGIN, "", *lines, "", END]) + tail)


if __name__ == "__main__":
    sys.exit(main())
