"""Generate the library of the passing scenes: strikes from standing, and the motion between them.

    python sample_blend/make_passes.py [FOLDER]

It is a library of its own (`passes/library`), so that takes from the sample's other one do not change. The same code
gives the same bytes. Needs the core only.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
if __name__ == "__main__":
    sys.path[:0] = [str(HERE.parent), str(HERE)]

from make_sample import FPS, Clip, build_clips, label_clip  # noqa: E402

from beyond_mocap.annotation import KeyMoment, Span, Timeline, format_timeline  # noqa: E402
from beyond_mocap.files.bvh import bvh  # noqa: E402
from beyond_mocap.synthetic.idle import CROUCH, build_idle, build_ready_steps  # noqa: E402
from beyond_mocap.synthetic.volleys import VOLLEYS, build_volley  # noqa: E402

REUSED_CLIPS = ("walking_0_8", "walking_1_2", "walking_1_6",
                "walking_turn_left", "walking_turn_right", "walking_back", "walking_left", "walking_right",
                "start_stop_walking", "walk_jog_walk", "jogging_2_4", "jogging_3_5", "jogging_back", "header")
"""Clips of the sample's library that are reused."""
READY_STEPS = (*((f"turn_{side}_{turn}", (0.0, 0.0), sign * turn, f"standing ready turning {side}")
                 for side, sign in (("left", 1), ("right", -1)) for turn in (30, 60, 100, 150)),
               *((f"step_{name}", move, 0.0, "standing ready") for name, move in
                 (("ahead", (0.25, 0.0)), ("back", (-0.25, 0.0)), ("left", (0.0, 0.25)), ("right", (0.0, -0.25)))))
"""Name, metres ahead and to the left, degrees to the left and labels of steps of players who wait for the ball."""
STOP_FRAME = 186
"""Frames after which the player of start_stop_walking has stopped; the clip continues with half a step."""
STRIKES = (("toss", "toss", 1.25), ("toss_quick", "toss", 1.5), ("pass", "pass", 1.25), ("pass_quick", "pass", 1.45),
           ("attack", "attack", 1.4), ("attack_quick", "attack", 1.6), ("receive", "receive", 1.0),
           ("head", "head", 1.25), ("chest", "chest", 1.0), ("hand", "hand", 1.3), ("racquet", "racquet", 1.0),
           ("racquet_slow", "racquet", 0.8))
"""Name, kind (`synthetic.volleys`) and speed of every strike."""


def build_passes_clips() -> list[Clip]:
    """Build all clips of the library."""
    reused = [clip for clip in build_clips() if clip.name in REUSED_CLIPS]
    reused = [replace(c, motion=c.motion.frames(0, STOP_FRAME)) if c.name == "start_stop_walking" else c
              for c in reused]
    ready = [Clip(f"ready_{seed}", build_idle(9.0, fps=FPS, seed=60 + seed), ("standing", "ready"))
             for seed in (1, 2, 3)]
    ready += [Clip(f"ready_{name}", build_ready_steps(move, np.radians(turn), FPS), tuple(labels.split()))
              for name, move, turn, labels in READY_STEPS]
    return [*reused, *ready, *(_build_strike(*row, seed=70 + number) for number, row in enumerate(STRIKES))]


def _build_strike(name: str, kind: str, speed: float, seed: int) -> Clip:
    """Build the clip of a strike."""
    gesture = build_volley(kind, fps=FPS, seed=seed, speed=speed, crouch=CROUCH)
    return Clip(f"volley_{name}", gesture.motion, tuple(VOLLEYS[kind].labels.split()), gesture)


def write_passing_library(folder: Path = HERE / "passes" / "library") -> None:
    """Write the library's files to `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    for clip in build_passes_clips():
        bvh.write_bvh(folder / f"{clip.name}.bvh", clip.motion)
        words = format_timeline(_label_clip(clip))
        (folder / f"{clip.name}.txt").write_text(words, encoding="utf-8", newline="\n")


def _label_clip(clip: Clip) -> Timeline:
    """Return the labels as in the sample's other library; a strike has standing before and after it."""
    gesture = clip.gesture
    if gesture is None or not clip.name.startswith("volley"):
        return label_clip(clip)
    start, stop, end = round(gesture.start, 2), round(gesture.end, 2), clip.motion.duration
    still = (Span(0.0, start, ("standing", "ready")), Span(stop, round(end, 2), ("standing", "ready")))
    return Timeline((still[0], Span(start, stop, clip.words), still[1]), (KeyMoment(gesture.key, clip.words),))


if __name__ == "__main__":
    write_passing_library(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "passes" / "library")
