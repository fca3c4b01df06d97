"""A player of a match on a bent line, and what a made library shows of him in windows; a stretch of the small match
(sample_blend/match/small), made once; work that other processes can import; a cluster."""

import json
import os
import subprocess
import sys
import time

import numpy as np
import pytest

from beyond_mocap.annotation import parse_timeline
from beyond_mocap.match.pieces import pool
from beyond_mocap.match.pieces.units import build_units
from beyond_mocap.match.pieces.windows import Piece, join_pieces, search_window
from beyond_mocap.match.player_edit import PlayerEdit
from beyond_mocap.match.request import MatchRequest
from beyond_mocap.match.synthesize_match import synthesize_match
from beyond_mocap.motion.track import Track
from beyond_mocap.synthesis.plan import Plan
from tests.core.match.small_match import LIBRARY, PLAYERS, SECONDS, SMALL, TOP

KICK_TIME = 20.5

CHORES = '''
import os, signal, time
from pathlib import Path

def square(number):
    return number * number

def odd(number):
    if number % 2:
        raise ValueError(f"{number} is odd")
    return number

def deadly(number, folder, times):
    """Ends its own process while fewer than `times` marks lie in the folder."""
    if number == 3 and len(list(Path(folder).iterdir())) < times:
        (Path(folder) / str(time.time_ns())).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number, os.getpid()

def blocks(number):
    return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])

def slow(seconds):
    time.sleep(seconds)
    return os.getpid()
'''


def build_weaving_track(start: float, end: float) -> Track:
    """Samples at 25 Hz of a player who walks and jogs on a bent line, from second `start` to `end`."""
    times = np.arange(start, end + 1e-9, 0.04)
    distance = 2.0 * (times - start) + 2.0 * np.sin(0.6 * times)
    return Track(times, np.column_stack([distance, 4.0 * np.sin(0.08 * distance)]), name="home_7")


@pytest.fixture(scope="session")
def weaving_plan() -> Plan:
    """25 s from 5 s on, with a kick at KICK_TIME."""
    timeline = parse_timeline(f"{KICK_TIME} kick right\n", fps=30.0)
    return Plan(track=build_weaving_track(5.0, 30.0), timeline=timeline, nearest=True)


@pytest.fixture(scope="session")
def weaving_pieces(library, weaving_plan) -> tuple[Piece, ...]:
    """What is found for its windows of 8 s."""
    return tuple(search_window(library, unit) for unit in build_units(weaving_plan, window=8.0, overlap=3.0))


@pytest.fixture(scope="session")
def weaving_player(library, weaving_plan, weaving_pieces) -> PlayerEdit:
    """The player that they make, laid out in windows of 8 s."""
    return join_pieces(library, [weaving_plan], weaving_pieces, 8.0)[0]


@pytest.fixture(scope="session")
def chores(tmp_path_factory):
    """A module of work to do that other processes can import: its functions."""
    folder = tmp_path_factory.mktemp("chores")
    (folder / "planted_chores.py").write_text(CHORES)
    sys.path.insert(0, str(folder))
    before = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = os.pathsep.join([str(folder), str(TOP), *([before] if before else [])])
    import planted_chores

    yield planted_chores
    pool.stop_workers()
    sys.path.remove(str(folder))
    os.environ.pop("PYTHONPATH") if before is None else os.environ.update(PYTHONPATH=before)


@pytest.fixture
def cluster(chores, tmp_path):
    """A scheduler and two workers as processes of their own: (address, processes)."""
    pytest.importorskip("distributed")
    where = tmp_path / "scheduler.json"
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--port", "0", "--host", "127.0.0.1",
               "--no-dashboard", "--scheduler-file", str(where)]  # fmt: skip
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": tmp_path}
    processes = [subprocess.Popen(command, **quiet)]
    command = [sys.executable, "-m", "distributed.cli.dask_worker", "--scheduler-file", str(where), "--nthreads", "1",
               "--no-dashboard", "--no-nanny"]  # fmt: skip
    processes += [subprocess.Popen(command, **quiet) for _ in range(2)]
    deadline = time.monotonic() + 300.0
    while not (where.is_file() and where.stat().st_size):
        assert time.monotonic() < deadline, "no scheduler came up"
        time.sleep(0.05)
    yield json.loads(where.read_text())["address"], processes
    for process in processes:
        process.kill()
        process.wait()


@pytest.fixture(scope="session")
def order_to(sample_cache):
    """order_to(folder, **settings): three players of the small match for eight seconds, in windows of five."""

    def build_order(folder, **settings):
        return MatchRequest(**{
            "tracking": SMALL / "small.dat", "library": LIBRARY, "out": folder,
            "cache": sample_cache, "start": SECONDS[0], "end": SECONDS[1], "players": PLAYERS, "bvh": True,
            "window": 5.0, "overlap": 2.0, **settings,
        })  # fmt: skip

    return build_order


@pytest.fixture(scope="session")
def made(order_to, tmp_path_factory):
    """That match, made in this process: (folder, result)."""
    folder = tmp_path_factory.mktemp("made") / "match"
    return folder, synthesize_match(order_to(folder))
