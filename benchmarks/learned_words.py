"""Label ten, get the rest, on recordings with labels: what a classifier that saw ten clips finds in those of others.

    python -m benchmarks.learned_words [--seeds 3]

A moment counts as found within 0.1 s of the labelled key frame, and is proposed from a confidence of 0.5 on. "rules"
are those of `library.proposals` alone, "learned" the classifier that hears nothing of them, "both" what users get. Ten
clips are drawn by seed from one player's (or five and five from two players'), kicks and others as they come; all
figures are of players that were kept back.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from beyond_mocap.annotation import read_annotation_csv  # noqa: E402
from beyond_mocap.files import bvh  # noqa: E402
from beyond_mocap.library.classify.details import value_of  # noqa: E402
from beyond_mocap.library.classify.examples import Example  # noqa: E402
from beyond_mocap.library.classify.train import trained  # noqa: E402
from beyond_mocap.library.proposal import Proposal  # noqa: E402
from beyond_mocap.motion.motion import Motion  # noqa: E402

from benchmarks.places import DATA  # noqa: E402

FOLDERS = ("lmd/", "cmu10/", "cmu_jumps/", "keeper/", "runs15/")
PLAYERS = ("Player1", "Player2", "Player4", "Player6")
WITHOUT_KICKS = ("runs15/", "keeper/", "cmu_jumps/")
WORDS = {"side": ("left", "right"), "low or high": ("low", "high"), "inside or top": ("inside", "top"),
         "standing or running": ("standing", "running")}
NEAR, SURE = 0.1, 0.5
Clips = dict[str, tuple[Motion, Example]]
Proposer = Callable[[Motion, Example], Sequence[Proposal]]


@dataclass
class Counted:
    """What was found of one act: pairs of label and proposal with the clip's rate, false ones, and those missed; of all
    candidates the confidence and whether it was right."""

    pairs: list = field(default_factory=list)
    false: int = 0
    missed: int = 0
    sure: list = field(default_factory=list)
    right: list = field(default_factory=list)

    @property
    def f1(self) -> float:
        """Of 1."""
        return 2.0 * len(self.pairs) / max(2 * len(self.pairs) + self.false + self.missed, 1)

    def frames_off(self) -> np.ndarray:
        """Frames of 120 a second between proposed and labelled keys."""
        return np.array([abs(found.annotation.key - row.key) * 120.0 / fps for row, found, fps in self.pairs])

    def right_words(self, group: Sequence[str]) -> float:
        """Share of the found whose word of a group is the label's."""
        same = [value_of(row.words, group) == value_of(found.annotation.words, group) for row, found, _ in self.pairs]
        return float(np.mean(same)) if same else float("nan")


def count(clips: Clips, names: Iterable[str], act: str, proposer: Proposer) -> Counted:
    """Proposals of an act against the labels."""
    out = Counted()
    for name in names:
        motion, example = clips[name]
        found = [one for one in proposer(motion, example)
                 if one.annotation.key is not None and one.annotation.words[0] == act]
        rows, taken = example.rows_of(act, True), set()
        for row in rows:
            near = [k for k, one in enumerate(found) if k not in taken and one.confidence >= SURE
                    and abs(one.annotation.key - row.key) <= NEAR * motion.fps]
            if near:
                best = min(near, key=lambda k: abs(found[k].annotation.key - row.key))
                taken.add(best)
                out.pairs.append((row, found[best], motion.fps))
            else:
                out.missed += 1
        out.false += sum(one.confidence >= SURE for k, one in enumerate(found) if k not in taken)
        for one in found:
            out.sure.append(one.confidence)
            out.right.append(any(abs(one.annotation.key - row.key) <= NEAR * motion.fps for row in rows))
    return out


def proposers(clips: Clips, taught: Sequence[str]) -> dict[str, Proposer]:
    """The three ways to propose."""
    examples = [clips[name][1] for name in taught]
    both, alone = trained(examples), trained([replace(one, ruled=()) for one in examples])
    return {
        "rules": lambda motion, example: example.ruled,
        "learned": lambda motion, example: alone.propose(motion, ()),
        "both": lambda motion, example: both.propose(motion, example.ruled),
    }


def read() -> Clips:
    """All recordings with labels, with what the rules say."""
    table = read_annotation_csv(DATA / "mocap" / "annotations.csv")
    names = [name for name in sorted(table) if name.startswith(FOLDERS)]
    motions = {name: bvh.read(DATA / "mocap" / name).motion for name in names}
    return {name: (motion, Example.of(name, motion, table[name])) for name, motion in motions.items()}


def drawn(clips: Clips, folders: Sequence[str], number: int, seed: int) -> list[str]:
    """So many clips of each folder, by seed."""
    rng = np.random.default_rng(seed)
    each = [sorted(rng.choice([n for n in clips if n.startswith(folder)], number, replace=False)) for folder in folders]
    return [name for part in each for name in part]


def kicks(clips: Clips, seeds: int) -> None:
    """Ten clips of one player, and of two; the rest of the players, and recordings of other kinds."""
    sets = [((p,), 10) for p in PLAYERS] + [((p, q), 5) for p, q in zip(PLAYERS, PLAYERS[1:])]
    for size in (1, 2):
        found: dict[str, list[Counted]] = {}
        elsewhere: dict[str, list[tuple[int, int]]] = {}
        for players, number in sets:
            for seed in range(seeds) if len(players) == size else ():
                taught = drawn(clips, [f"lmd/{p}/" for p in players], number, seed)
                own = tuple(f"lmd/{p}/" for p in players)
                kept = [n for n in clips if n.startswith("lmd/") and not n.startswith(own)]
                for way, proposer in proposers(clips, taught).items():
                    found.setdefault(way, []).append(count(clips, kept, "kick", proposer))
                    others = count(clips, [n for n in clips if n.startswith(WITHOUT_KICKS)], "kick", proposer)
                    optical = count(clips, [n for n in clips if n.startswith("cmu10/")], "kick", proposer)
                    elsewhere.setdefault(way, []).append((others.false, optical))
        told(f"kicks, ten clips of {size} player{'s' * (size > 1)}", found)
        for way, figures in elsewhere.items():
            false, optical = [a for a, _ in figures], [b for _, b in figures]
            print(f"  {way}: false in {sum(n.startswith(WITHOUT_KICKS) for n in clips)} clips without kicks: mean "
                  f"{np.mean(false):.1f}, most {max(false)}; cmu10: F1 {np.mean([o.f1 for o in optical]):.3f}")


def told(title: str, found: dict[str, list[Counted]]) -> None:
    """The lines of one table."""
    print(f"\n{title}")
    for way, runs in found.items():
        f1 = np.array([one.f1 for one in runs])
        off = np.concatenate([one.frames_off() for one in runs]) if any(one.pairs for one in runs) else np.zeros(0)
        words = ", ".join(f"{name} {np.nanmean([one.right_words(group) for one in runs]):.0%}"
                          for name, group in WORDS.items())
        print(f"  {way}: F1 mean {f1.mean():.3f}, least {f1.min():.3f} ({len(runs)} runs, "
              f"{len(runs[0].pairs) + runs[0].missed} labelled); within 3 frames {np.mean(off <= 3.0):.0%}; {words}")
        sure, right = (np.concatenate([getattr(one, name) for one in runs]) for name in ("sure", "right"))
        bins = [(low, (sure >= low) & (sure < low + 0.2 + (low > 0.75))) for low in (0.2, 0.4, 0.6, 0.8)]
        print("    sure -> right: " + ", ".join(
            f"{sure[part].mean():.2f} -> {right[part].mean():.2f} ({part.sum()})" for _, part in bins if part.any()))


def jumps(clips: Clips) -> None:
    """Five jumps and five dives of one keeper; the other keeper's dives and the other jumps."""
    taught = drawn(clips, ["cmu_jumps/", "keeper/GK01"], 5, 0)
    kept = [n for n in clips if n.startswith(("cmu_jumps/", "keeper/GK")) and not n.startswith("keeper/GK01")
            and n not in taught]
    for way, proposer in proposers(clips, taught).items():
        found = count(clips, kept, "jump", proposer)
        dives = [("dive" in row.words) == ("dive" in one.annotation.words) for row, one, _ in found.pairs]
        sided = [(row, one) for row, one, _ in found.pairs if "dive" in row.words]
        side = [value_of(row.words, ("left", "right")) == value_of(one.annotation.words, ("left", "right"))
                for row, one in sided]
        print(f"  {way}: F1 {found.f1:.3f} ({len(found.pairs)} found, {found.false} false, {found.missed} missed), "
              f"dive or not {np.mean(dives or [0]):.0%}, side of {len(side)} dives {np.mean(side or [0]):.0%}, "
              f"key off by {np.median(found.frames_off() if found.pairs else [0]):.0f} frames in the median")


def stretches(clips: Clips, seeds: int) -> None:
    """Turns and dribbling, by frames, ten clips of one player."""
    for act in ("turning", "dribble"):
        for way in ("rules", "learned", "both"):
            hit = said = meant = 0
            for player in PLAYERS:
                for seed in range(seeds):
                    proposer = proposers(clips, drawn(clips, [f"lmd/{player}/"], 10, seed))[way]
                    for name in clips:
                        if name.startswith("lmd/") and not name.startswith(f"lmd/{player}/"):
                            motion, example = clips[name]
                            ours = _covered([one.annotation for one in proposer(motion, example)], act, len(motion))
                            labels = _covered(example.rows, act, len(motion))
                            hit, said, meant = hit + (ours & labels).sum(), said + ours.sum(), meant + labels.sum()
            print(f"  {act}, {way}: F1 of frames {2 * hit / max(said + meant, 1):.3f} "
                  f"(precision {hit / max(said, 1):.2f}, recall {hit / max(meant, 1):.2f})")


def _covered(rows, act: str, frames: int) -> np.ndarray:
    out = np.zeros(frames, bool)
    for row in rows:
        if row.key is None and act in row.words:
            out[row.start : row.end + 1] = True
    return out


def costs(clips: Clips) -> None:
    """Seconds of one core."""
    taught = [clips[name][1] for name in drawn(clips, ["lmd/Player1/"], 10, 0)]
    begun = time.process_time()
    known = trained(taught)
    learned = time.process_time()
    names = [name for name in clips if name.startswith("lmd/Player4/")]
    for name in names:
        known.propose(*((clips[name][0], clips[name][1].ruled)))
    length = sum(clips[name][0].duration for name in names)
    each = (time.process_time() - learned) / length
    print(f"\nlearning from ten clips: {learned - begun:.2f} s; proposing: {1000 * each:.1f} ms for a second of motion")


def main() -> None:
    """Print all tables."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--seeds", type=int, default=3, help="draws of ten clips for each player")
    seeds = options.parse_args().seeds
    if not (DATA / "mocap" / "annotations.csv").is_file():
        sys.exit(f"{DATA / 'mocap'}: no recordings to measure on")
    clips = read()
    kicks(clips, seeds)
    print("\njumps and dives, five and five clips")
    jumps(clips)
    print("\nstretches, ten clips of one player")
    stretches(clips, 1)
    costs(clips)


if __name__ == "__main__":
    main()
