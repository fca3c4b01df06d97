"""Hit analysis on recorded kicks and on made ones whose moment is known; what matching one example costs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from beyond_mocap.annotation import read_annotation_csv
from beyond_mocap.ball.hit_library import HitLibrary
from beyond_mocap.ball.hits import Hits, analyse
from beyond_mocap.files import bvh
from beyond_mocap.library.build import build
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.gait import gait
from beyond_mocap.motion.gestures import STRIKES, strike
from beyond_mocap.motion.humanoid import identify
from beyond_mocap.motion.motion import Motion
from beyond_mocap.motion.volleys import volley

from benchmarks import effort
from benchmarks.markdown import head, row
from benchmarks.places import DATA

RATE = 120.0
NEAR = 3.0 / RATE
FOLDERS = ("cmu10", "lmd/Player1", "lmd/Player2", "lmd/Player4", "lmd/Player6")
_MANY = 300


@dataclass(frozen=True)
class Found:
    """One labelled kick: clip, label s, s from the label to the nearest hit's key and to the strongest one's (inf where
    there is none), and how many other hit motions of that foot the clip has outside all labelled ones."""

    clip: str
    label: float
    nearest: float
    strongest: float
    others: int


def kicks(folder: str) -> list[Found]:
    """All labelled kicks of a folder."""
    rows = read_annotation_csv(DATA / "mocap" / "annotations.csv")
    found = []
    for name in sorted(rows):
        labelled = [one for one in rows[name] if one.key is not None and one.words[0] == "kick"]
        if name.startswith(folder) and labelled:
            motion = bvh.read(DATA / "mocap" / name).motion
            hits = {side: analyse(motion, "foot", side) for side in {one.words[1] for one in labelled}}
            found += [_found(name, one, hits, labelled, motion.fps) for one in labelled]
    return found


def _found(name, labelled, hits: dict[str, Hits], rows, fps: float) -> Found:
    of = hits[labelled.words[1]]
    away = [abs(one.key - labelled.key) / fps for one in of.motions]
    strongest = np.inf if of.strongest is None else abs(of.strongest.key - labelled.key) / fps
    others = sum(not any(one.first <= row.key <= one.last for row in rows) for one in of.motions)
    return Found(name, labelled.key / fps, min(away, default=np.inf), strongest, others)


def swing(moment: float, fps: float, limb: str = "upper_leg", side: str = "right") -> Motion:
    """Who stands, swings one limb back, forward (fastest at `moment` s) and down again."""
    standing = gait(0.0, 3.5, fps, seed=5)
    times = np.arange(len(standing)) / fps
    angle = sum(
        turn / (1.0 + np.exp((moment + when - times) / wide))
        for turn, when, wide in ((-0.5, -0.5, 0.07), (2.0, 0.0, 0.035), (-1.5, 0.7, 0.1))
    )
    joint = getattr(getattr(identify(standing.skeleton), side), limb)
    rotations = np.array(standing.rotations)
    turned = quaternion.about_axis(np.array([0.0, -1.0, 0.0]), angle)
    rotations[:, joint] = quaternion.multiply(turned, rotations[:, joint])
    return replace(standing, rotations=rotations)


def planted() -> np.ndarray:
    """(K,) frames between the moment at which a planted swing is fastest and the found one; inf where none is found."""
    off = []
    for moment in (1.4, 1.613, 1.777):
        for fps in (23.976, 30.0, 60.0, 120.0):
            for part, limb in (("foot", "upper_leg"), ("hand", "upper_arm")):
                hits = analyse(swing(moment, fps, limb), part, "right")
                off.append(min((abs(one.key - moment * fps) for one in hits.motions), default=np.inf))
    return np.array(off)


def made_kicks() -> dict[str, float]:
    """Made kick -> seconds from its touch to the found moment; they are drawn by the touch,
    not by the greatest speed."""
    made = {words: strike(words, fps=120.0) for words in sorted(STRIKES) if words.startswith("kick")}
    made |= {f"standing {words}": volley(words, fps=120.0) for words in ("toss", "pass", "attack")}
    found = {}
    for words, one in made.items():
        hits = analyse(one.motion, "foot", "right")
        found[words] = min((hit.key / 120.0 - one.key for hit in hits.motions), key=abs, default=np.inf)
    return found


def false_in_gaits() -> int:
    """Hit motions found in made walking, jogging and running, where there are none."""
    made = [gait(speed, 6.0, 60.0, seed=seed) for speed in (0.0, 1.0, 1.4, 2.0, 2.8, 4.0, 5.5) for seed in range(3)]
    return sum(len(analyse(motion, "foot", side).motions) for motion in made for side in ("left", "right"))


def match_time() -> tuple[float, int]:
    """Milliseconds to order some 300 hit motions by their likeness to an example, and how many they were."""
    library = build(DATA / "mocap" / "cmu10", unit=0.05644)
    hits = HitLibrary.of(library).hits
    many = HitLibrary("foot", (hits * (_MANY // len(hits) + 1))[:_MANY])
    many.match(hits[0].hit)

    def often():
        for _ in range(100):
            many.match(hits[0].hit)

    return effort.seconds(often)[0] * 10.0, len(many)


def section() -> list[str]:
    """Lines for results.md."""
    lines = head(("recordings", "labelled kicks", "nearest hit within 3 frames at 120", "strongest hit of the clip",
                  "median off, ms", "other hits in these clips"))  # fmt: skip
    for folder in FOLDERS:
        found = kicks(folder)
        near, strong = (np.array([getattr(one, what) for one in found]) for what in ("nearest", "strongest"))
        cells = (folder, len(found), f"{np.sum(near <= NEAR + 1e-9)}", f"{np.sum(strong <= NEAR + 1e-9)}",
                 f"{1000 * np.median(near):.0f}", sum(one.others for one in found))  # fmt: skip
        lines.append(row(str(cell) for cell in cells))
    off = planted()
    took, count = match_time()
    return [
        *lines, "", f"- planted swings of foot and hand ({len(off)}, 24 to 120 frames/s): {np.sum(off <= 1.0)} found "
        f"within 1 frame of where they are fastest, at most {off.max():.1f} off (target 1)",
        "- made kicks, from the touch that was drawn to the found moment: "
        + ", ".join(f"{words} {1000 * late:+.0f} ms" for words, late in made_kicks().items()),
        f"- hit motions found in made standing, walking and running, where there are none: {false_in_gaits()}",
        f"- one example among {count} hit motions: {took:.2f} ms (target 1)",
    ]  # fmt: skip
