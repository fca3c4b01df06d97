"""Fuzz every reader and verb with damaged files: `make fuzz`, or `python tests/fuzz/fuzz.py --help`.

Each input is decided by its target's name and a number, so that a line of a fault, or of corpus.txt, makes it again. An
input may be taken, or refused with status 2 or 3 and one line; everything else is a fault: a traceback, other output on
stderr, a file left by a refused command, a number that is not finite, too much time or memory.
"""

import argparse
import contextlib
import io
import json
import multiprocessing
import os
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from fnmatch import fnmatch
from pathlib import Path
from random import Random

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[1])]

from made_seeds import build_made_seeds  # noqa: E402
from mutate import mutate  # noqa: E402
from seeds import SAMPLE, build_seeds, shorten_bvh  # noqa: E402
from targets import Target, list_targets  # noqa: E402

from beyond_mocap.base.errors import BeyondMocapError  # noqa: E402

FAULTS = HERE.parents[1] / "build" / "fuzz"
_MEMORY = 8_000_000_000  # bytes of address space of a worker
_LEFT_ALONE = re.compile(r"^(note: |\{\"|$)")  # what may stand on stderr beside the one line


class TimeLimit(BaseException):
    """An input took too long; not an Exception, so that no reader takes it for a damaged file."""


class Fault(Exception):
    """What is wrong with the answer to an input."""


def prepare(folder: Path) -> tuple[dict[str, Path], dict[str, Path]]:
    """Write seeds and valid files, and build the caches of libraries: (seeds, valid files by name)."""
    seeds = build_seeds(folder)
    for name in ("walk", "stand"):
        source = "walking_1_2" if name == "walk" else "standing_1"
        shorten_bvh(SAMPLE / "library" / f"{source}.bvh", folder / f"long_{name}.bvh", 60)
        (folder / "clips").mkdir(exist_ok=True)
        shutil.copy(folder / f"long_{name}.bvh", folder / "clips" / f"{name}.bvh")
        (folder / "clips" / f"{name}.txt").write_text(f"0 1.9 {'walking' if name == 'walk' else 'standing'}\n")
    files = {
        "walk": folder / "walk.bvh",
        "curve": folder / "curve.csv",
        "track": folder / "track.csv",
        "trc": folder / "walk.trc",
        "library": folder / "clips",
        "cache": folder / "cache",
        "strikes": SAMPLE / "passes" / "library",
        "strikes_cache": folder / "strikes_cache",
    }
    return {**seeds, **build_made_seeds(folder)}, files


def damage(target: Target, number: int, seeds: dict[str, Path], place: Path) -> Path:
    """Write the damaged input of a target and a number into an empty folder; return the file or folder."""
    rng = Random(f"{target.name} {number}")
    name = rng.choice(sorted(seed for seed in seeds if any(fnmatch(seed, pattern) for pattern in target.seeds)))
    if not seeds[name].is_dir():
        path = place / name
        path.write_bytes(mutate(seeds[name].read_bytes(), name, rng))
        return path
    folder = place / name
    shutil.copytree(seeds[name], folder)
    hurt = rng.choice(sorted(folder.iterdir()))
    hurt.write_bytes(mutate(hurt.read_bytes(), hurt.name, rng))
    return folder


def check(target: Target, number: int, seeds: dict[str, Path], base: Path) -> str:
    """Run one input; return "" or what is wrong."""
    place, out = base / f"{os.getpid()}" / "in", base / f"{os.getpid()}" / "out"
    shutil.rmtree(place.parent, ignore_errors=True)
    place.mkdir(parents=True)
    out.mkdir()
    for path in base.glob("long_*.bvh"):
        shutil.copy(path, place.parent)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        path = damage(target, number, seeds, place)
    said = io.StringIO()
    signal.signal(signal.SIGALRM, _end_of_time)
    signal.setitimer(signal.ITIMER_REAL, 6.0 * target.seconds)
    used = time.process_time()
    try:
        with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
            warnings.simplefilter("always")
            warnings.simplefilter("ignore", ResourceWarning)  # of kloppy; Python shows none
            try:
                status = target.read(path, out)
            except BeyondMocapError as error:
                status = None
                if "\n" in str(error):
                    raise Fault(f"more than one line: {error}") from None
        signal.setitimer(signal.ITIMER_REAL, 0)
        if time.process_time() - used > target.seconds:
            raise Fault(f"took {time.process_time() - used:.0f} s of processor time")
        check_answer(status, said.getvalue(), out)
    except TimeLimit:
        return f"took longer than {target.seconds} s"
    except Fault as fault:
        return str(fault)
    except BaseException:
        return traceback.format_exc()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
    return ""


def _end_of_time(*_):
    raise TimeLimit


def check_answer(status: int | None, said: str, out: Path) -> None:
    """Check exit status, standard error and files; Fault for what is wrong."""
    lines = [line for line in said.splitlines() if not _LEFT_ALONE.match(line)]
    expected = 1 if status else 0
    if status not in (None, 0, 2, 3):
        raise Fault(f"status {status}: {said}")
    if len(lines) != expected or "Traceback" in said or "not enough memory" in said:
        raise Fault(f"status {status}, and on stderr: {said}")
    files = [path for path in out.rglob("*") if path.is_file()]
    if status and files:
        raise Fault(f"status {status}, but {files[0].name} is written")
    for path in files:
        check_file(path)


def check_file(path: Path) -> None:
    """Check that a written file is whole and has finite numbers."""
    text = path.read_text("utf-8")
    if path.name.startswith("."):
        raise Fault(f"{path.name} is left")
    if path.suffix == ".json":
        json.loads(text, parse_constant=_refuse_constant)
    elif path.suffix in (".bvh", ".csv") and (bad := re.search(r"(?<![\w])[-+]?(nan|inf)\b", text, re.IGNORECASE)):
        raise Fault(f"{path.name} has {bad[0]}")


def _refuse_constant(name: str):
    raise Fault(f"a report has {name}")


def work(job) -> tuple[int, list[tuple[str, int, str]], dict[str, float]]:
    """Run inputs until the end of the time: their number, the faults, and seconds of processor time by target."""
    worker, options, folder, seeds, files = job
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    targets = [
        one for one in list_targets(files) if any(fnmatch(seed, pattern) for seed in seeds for pattern in one.seeds)
    ]
    by_name = {one.name: one for one in targets}
    chosen = [one for one in targets if not options.target or one.name in options.target]
    weights, faults, seconds, count = [one.weight for one in chosen], [], {}, 0
    for target, number in [] if options.target else read_corpus()[worker :: options.workers]:
        if target in by_name and (wrong := check(by_name[target], number, seeds, folder)):
            faults.append(keep(by_name[target], number, seeds, wrong))
    end, number = time.time() + options.seconds, options.start + worker
    while time.time() < end and count < options.inputs / options.workers:
        target = Random(number).choices(chosen, weights)[0]
        began = time.process_time()
        if wrong := check(target, number, seeds, folder):
            faults.append(keep(target, number, seeds, wrong))
        seconds[target.name] = seconds.get(target.name, 0.0) + time.process_time() - began
        number, count = number + options.workers, count + 1
    return count, faults, seconds


def read_corpus() -> list[tuple[str, int]]:
    """Read the inputs that found a fault before: (target, number)."""
    rows = [line.partition("#")[0].rsplit(maxsplit=1) for line in (HERE / "corpus.txt").read_text().splitlines()]
    return [(row[0], int(row[1])) for row in rows if len(row) == 2]


def keep(target: Target, number: int, seeds: dict[str, Path], wrong: str) -> tuple[str, int, str]:
    """Keep a faulty input and what is wrong below build/fuzz."""
    place = FAULTS / f"{target.name.replace(' ', '_')}_{number}"
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    damage(target, number, seeds, place)
    (place / "wrong.txt").write_text(wrong)
    print(f"FAULT {target.name} {number}: {wrong.strip().splitlines()[-1][:200]}", flush=True)
    return target.name, number, wrong


def main() -> int:
    """Fuzz, print what was found, and return 1 for any fault."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=600.0, help="how long; default 600")
    parser.add_argument("--inputs", type=int, default=10**9, help="at most so many inputs")
    parser.add_argument("--workers", type=int, default=2, help="processes; default 2")
    parser.add_argument("--start", type=int, default=int(time.time()), help="first number; default: the time")
    parser.add_argument("--target", action="append", help="only this target; may be repeated")
    options = parser.parse_args()
    began = time.time()
    with tempfile.TemporaryDirectory(prefix="beyond-mocap-fuzz-") as folder:
        seeds, files = prepare(Path(folder))
        jobs = [(worker, options, Path(folder), seeds, files) for worker in range(options.workers)]
        with multiprocessing.get_context("fork").Pool(options.workers) as pool:
            results = pool.map(work, jobs, chunksize=1)
    count, took = sum(one[0] for one in results), time.time() - began
    faults = [fault for one in results for fault in one[1]]
    totals: dict[str, float] = {}
    for _, _, seconds in results:
        for name, value in seconds.items():
            totals[name] = totals.get(name, 0.0) + value
    used = sum(totals.values())
    slow = ", ".join(f"{name} {totals[name]:.0f} s" for name in sorted(totals, key=totals.get, reverse=True)[:6])
    print(
        f"{count} inputs from number {options.start} in {took:.0f} s and {used:.0f} s of processor time "
        f"({1000 * used / max(count, 1):.0f} ms each), {len(faults)} faults; most of it: {slow}"
    )
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
