"""Kill library builds, matches, bodies and trainings at random moments and resume them: `make kill-test`.

After a SIGKILL no file with a final name is half-written. After some kills the command runs to its end: what was left
must not stop it, no temporary file may remain, and the bits are those of a run that nothing interrupted.
"""

import argparse
import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

TOP = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(TOP))

from beyond_mocap.library import cache  # noqa: E402

SAMPLE = TOP / "sample_blend"
KILLS_IN_A_ROW = 4
_CLIPS = ("walking_1_2", "jogging_2_9", "standing_1", "kick_low_inside", "running_4_2")
_MATCH = ("--from", "0", "--to", "2", "--workers", "2", "--players", "home_10", "--no-figures")
# a compiled step takes a minute and is no part of what is tested: it is small, and kept for the runs that follow
_NETWORK = {"units": 8, "rollout": 1, "examples": 4, "ridge": 0.01, "early_stopping": False, "linear_start": False}
_COMPILER = {"XLA_FLAGS": "--xla_backend_optimization_level=0", "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0"}
_TIMED = ("match.json", "report.json", "report.html", "lock", "checkpoint.npz")  # files with times of the run


@dataclass(frozen=True)
class Job:
    """A command that can be killed. build: folder for its outputs -> the command line."""

    name: str
    python: Path
    build: Callable[[Path], list]


def list_jobs(base: Path) -> list[Job]:
    """List the jobs, with their inputs below `base`; a line says what cannot run here."""
    clips = base / "clips"
    clips.mkdir()
    for name in _CLIPS:
        for ending in (".bvh", ".txt"):
            shutil.copy(SAMPLE / "library" / (name + ending), clips)
    small, main = SAMPLE / "match" / "small", Path(sys.executable)
    cached = ("--cache", base / "cache")
    bodies = ("bodies", "--joints", small / "small_joints.csv", "--library", clips, *cached)
    jobs = [
        Job("library", main, lambda out: ["library", clips, "--cache", out]),
        Job(
            "match",
            main,
            lambda out: [
                "match",
                "--tracking",
                small / "small.dat",
                "--meta",
                small / "small_meta.xml",
                "--library",
                clips,
                *cached,
                "--out",
                out,
                *_MATCH,
            ],
        ),
        Job("bodies", main, lambda out: [*bodies, "--out", _clear_finished(out)]),
    ]
    trainer = TOP / ".venv-training" / "bin" / "python"
    if not trainer.exists():
        print("kill-test: no .venv-training; training is skipped (make training)")
        return jobs
    os.environ.update(_COMPILER, JAX_COMPILATION_CACHE_DIR=str(base / "compiled"))
    run(trainer, ["throw", "examples", "--out", base / "examples", "--subjects", "1", "--throws", "4", "--seed", "0"])
    (base / "network.json").write_text(json.dumps(_NETWORK))
    run(trainer, _build_training(base, base / "first.npz"))
    return [*jobs, Job("training", trainer, lambda out: _build_training(base, out / "w.npz"))]


def _clear_finished(out: Path) -> Path:
    """Empty a folder that a kill came too late for: a verb that cannot resume begins in an empty one."""
    if (out / "report.json").exists():
        shutil.rmtree(out)
        out.mkdir()
    return out


def _build_training(base: Path, weights: Path) -> list:
    """Build the command of a training, which continues where there is a checkpoint."""
    kept = weights.with_suffix(".checkpoint.npz")
    options = ["--config", base / "network.json", "--epochs", "6", "--out", weights]
    command = ["throw", "train", base / "examples", *options]
    return [*command, "--resume"] if kept.exists() else command


def start(python: Path, command: list) -> subprocess.Popen:
    """Start a command in a session of its own."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    return subprocess.Popen(
        [python, "-m", "beyond_mocap", *map(str, command)],
        cwd=TOP,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )


def run(python: Path, command: list) -> None:
    """Run a command to its end; SystemExit with its words where it fails."""
    process = start(python, command)
    said = process.communicate()[0]
    if process.returncode:
        sys.exit(f"kill-test: {' '.join(map(str, command))}: status {process.returncode}: {said}")


def run_whole(job: Job, out: Path) -> tuple[dict[str, str], float]:
    """Run a job that nothing interrupts: digests of its files, and its seconds."""
    out.mkdir()
    began = time.time()
    run(job.python, job.build(out))
    return read_digests(out), time.time() - began


def kill_once(job: Job, out: Path, moment: float) -> None:
    """Kill a job with all its processes after `moment` seconds, and check what it leaves."""
    process = start(job.python, job.build(out))
    try:
        process.wait(moment)
    except subprocess.TimeoutExpired:
        pass
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        pass
    process.communicate()
    for path in list_files(out):
        check_whole(path)


def list_files(out: Path) -> list[Path]:
    """List the files with final names."""
    files = [path for path in sorted(out.rglob("*")) if path.is_file()]
    return [path for path in files if not any(name.endswith(".part") for name in path.relative_to(out).parts)]


def check_whole(path: Path) -> None:
    """Check that a file is whole; SystemExit where it is not."""
    try:
        if path.suffix == ".npz":
            with zipfile.ZipFile(path) as archive:
                assert archive.testzip() is None
        elif path.suffix == ".json":
            text = path.read_text()
            if text.startswith('"'):  # that of a cache, behind its digest
                assert cache._read_header(path.parent, path.stem)
            else:
                json.loads(text)
        elif path.suffix in (".csv", ".bvh"):
            assert path.read_bytes().endswith(b"\n")
    except (AssertionError, ValueError, zipfile.BadZipFile) as error:
        sys.exit(f"kill-test: {path} is half-written ({error})")


def read_digests(out: Path) -> dict[str, str]:
    """Read the digests of all results by name, without those that contain times of the run."""
    if (out / "library.json").exists():
        return read_cache_digests(out)
    results = [path for path in list_files(out) if not path.name.endswith(_TIMED) and ".work" not in path.parts]
    return {str(path.relative_to(out)): hashlib.sha256(path.read_bytes()).hexdigest() for path in results}


def read_cache_digests(place: Path) -> dict[str, str]:
    """Read the digests of the arrays that a library's header names, and of what it says of them.

    The folder's name differs from build to build, and the header has it, the files' times and a digest of itself. A
    killed build's folder may stay until it is old, and figures that are stored beside a library may be missing.
    """
    header = cache._read_header(place, "library")
    folder, files = place / header.pop("folder"), header.pop("files")
    digests = {name: hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in files}
    return digests | {"library.json": hashlib.sha256(json.dumps(header).encode()).hexdigest()}


def test_job(job: Job, base: Path, kills: int, rng: random.Random) -> int:
    """Kill a job at random moments, and resume it after some kills in a row; return the number of kills."""
    expected, seconds = run_whole(job, base / f"{job.name}_whole")
    done = 0
    while done < kills:
        out = base / f"{job.name}_{done}"
        out.mkdir()
        for _ in range(min(KILLS_IN_A_ROW, kills - done)):
            kill_once(job, out, rng.uniform(0.0, seconds))
            done += 1
        run(job.python, job.build(out))
        left = [path.name for path in out.rglob("*.part")]
        if left and job.name in ("match", "bodies"):
            sys.exit(f"kill-test: {job.name}: {left[0]} is left in {out}")
        found = read_digests(out)
        if found != expected:
            keep = TOP / "build" / "killed"
            shutil.rmtree(keep, ignore_errors=True)
            shutil.copytree(out, keep)
            differ = sorted(name for name in {**expected, **found} if expected.get(name) != found.get(name))
            sys.exit(f"kill-test: {job.name}: {', '.join(differ)[:300]} differ from a run without kills; see {keep}")
        shutil.rmtree(out)
        print(f"kill-test: {job.name}: {done} of {kills} kills, same bits", flush=True)
    return done


def main() -> None:
    """Kill all jobs and say how often."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=100, help="of all jobs together; default 100")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="of the moments; default: the time")
    parser.add_argument("--job", action="append", help="only this job: library, match, bodies or training")
    options = parser.parse_args()
    rng = random.Random(options.seed)
    with tempfile.TemporaryDirectory(prefix="beyond-mocap-kill-") as folder:
        jobs = [job for job in list_jobs(Path(folder)) if not options.job or job.name in options.job]
        counts = [test_job(job, Path(folder), -(-options.kills // len(jobs)), rng) for job in jobs]
    print(f"kill-test: {sum(counts)} kills of {', '.join(job.name for job in jobs)}, seed {options.seed}: no fault")


if __name__ == "__main__":
    main()
