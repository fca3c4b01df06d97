"""Play Live: from the user's strike, streamed over the network of this machine, to the first frame of its answer."""

from __future__ import annotations

import socket
import tempfile
import threading
import time
from pathlib import Path

from benchmarks.effort import format_head, format_row, measure_seconds
from benchmarks.places import ROOT
from beyond_mocap.files.bvh import bvh
from beyond_mocap.library.build import build_library
from beyond_mocap.library.library import Library
from beyond_mocap.motion.motion import resample
from beyond_mocap.passes.answers_ahead import AnswersAhead
from beyond_mocap.passes.hits import HitMotion, detect_hit_under_way, detect_hits
from beyond_mocap.passes.live_passes import Rally, build_answer, collect_means, start_rally
from beyond_mocap.passes.scene_json import SAMPLES, parse_scene
from beyond_mocap.passes.stream.listener import LOOPBACK, Listener
from beyond_mocap.passes.stream.live_hits import LiveHits
from beyond_mocap.passes.stream.sender import Sender

PASSES, KICKS = ROOT / "sample_blend" / "passes" / "library", ROOT / "sample_blend" / "library"
STRIKES = (*(PASSES / f"volley_{name}.bvh" for name in ("toss", "pass", "attack", "toss_quick", "pass_quick")),
           KICKS / "kick_low_top.bvh", KICKS / "kick_low_inside.bvh")
SIDES = "left", "right"
TICK = 1.0 / 60.0  # s between two updates in Blender
LATEST = 20.0  # s after which a strike counts as not noticed


def stream_strike(path: Path) -> Listener:
    """Start to stream a clip at its own rate, and return its listener."""
    with socket.socket() as free:
        free.bind((LOOPBACK, 0))
        port = free.getsockname()[1]
    listener = Listener(port).start()
    threading.Thread(target=Sender(path, port).send_file, args=(lambda: False,), daemon=True).start()
    return listener


def wait_for_strike(listener: Listener) -> tuple[HitMotion, float, float] | None:
    """Wait for a strike.

    Returns:
        The hit motion, s of its strike and s at which it was noticed on the monotonic clock; None if it was not.
    """
    watch, end = LiveHits(listener), time.monotonic() + LATEST
    while time.monotonic() < end:
        if (found := watch.find_new_hit()) is not None:
            return (*found, time.monotonic())
        time.sleep(TICK)
    return None


def find_delay(path: Path) -> float:
    """Find how long after its strike a clip is noticed if every frame is looked at, at most 60 a second: s in the
    stream's own time, whatever else the machine does.
    """
    motion = bvh.read_bvh(path).motion
    motion = resample(motion, min(motion.fps, 60.0))
    whole = max((detect_hits(motion, "foot", side).strongest for side in SIDES),
                key=lambda hit: hit.max_speed if hit else 0.0)
    noticed = next((end for end in range(whole.key, len(motion)) for side in SIDES
                    if detect_hit_under_way(motion.frames(0, end + 1), "foot", side)), whole.last)
    return (noticed - whole.key) / motion.fps


def plan_all(library: Library, rally: Rally) -> tuple[AnswersAhead, float]:
    """Plan all likely answers of a rally; return them and the processor seconds of one."""
    ahead, seconds = AnswersAhead(collect_means(library, rally.scene), rally), []
    while (request := ahead.choose_next("foot", "", ("Ben", "Cho"), 0)) is not None:
        took, answer = measure_seconds(lambda: build_answer(library, rally, request.strike.hit, request.target), 1)
        ahead.add(request, answer)
        seconds.append(took)
    return ahead, sum(seconds) / len(seconds)


def build_row(path: Path, rally: Rally, ahead: AnswersAhead) -> str:
    """Build the row of one streamed strike."""
    listener = stream_strike(path)
    found = wait_for_strike(listener)
    if found is None:
        return format_row([path.stem, *["not noticed"] * 5])
    hit, struck, noticed = found
    request = ahead.request_for(hit, "Ben", 0)
    answer = ahead.find(request)
    if answer is not None:
        rally.add_pass(answer, rally.ready_time)
    began = time.monotonic()
    listener.stop()
    motion = bvh.read_bvh(path).motion
    whole = ahead.request_for(detect_hits(motion, "foot", hit.side).strongest, "Ben", 0)
    clips = ahead.means.library.clips
    return format_row([path.stem, f"{find_delay(path):.2f}", f"{noticed - struck:.2f}",
                       f"{began - struck:.2f}" if answer else "planned then",
                       clips[request.strike.clip].path,
                       "yes" if whole.key == request.key else clips[whole.strike.clip].path])


def section() -> list[str]:
    """Build the lines for results.md."""
    with tempfile.TemporaryDirectory() as place:
        library = build_library(PASSES, cache_dir=Path(place))
        rally = start_rally(library, parse_scene(SAMPLES["three"]), "Ann")
        ahead, seconds = plan_all(library, rally)
        lines = format_head(("streamed strike", "noticed after s of the stream", "noticed after s",
                             "answer begins after s (target 0.3)",
                             "played", "as by the whole strike"))  # fmt: skip
        lines += [build_row(path, rally, ahead) for path in STRIKES]
    planning = f"Planning an answer takes {seconds:.2f} processor seconds."
    return [*lines, "", f"{planning} Seconds after the strike are by the clock."]
