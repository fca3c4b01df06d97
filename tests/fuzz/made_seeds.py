"""Valid files to damage that the program itself writes: tables, pieces, models, a player, joints, motion of SMPL,
matches."""

import json
import shutil
from pathlib import Path

import numpy as np
from seeds import SAMPLE, copy_group

from beyond_mocap.annotation import event_labels
from beyond_mocap.cli.main import main
from beyond_mocap.files.piece_file import write_piece_file
from beyond_mocap.files.smpl.smpl import write_smpl
from beyond_mocap.markers.files.marker_set_text import SHIPPED
from beyond_mocap.markers.files.model_json import write_model
from beyond_mocap.match.player_file import write_player
from tests.core.files.test_formats import WRITERS
from tests.core.files.test_smpl import build_walk
from tests.core.joint_feeds import sample_joints, write_cdf, write_fifa, write_hawkeye, write_table
from tests.core.markers.files.small_model import small_model
from tests.core.match.made_player import made_player

_LEARNED = ("kick_low_inside", "kick_low_top", "jogging_2_9")  # clips of the sample from which the classifier learns


def build_made_seeds(folder: Path) -> dict[str, Path]:
    """Write the seeds into a folder; name -> file."""
    names = ("piece.npz", "match.json", "mesh.obj", "clips.csv", "model.json", "player.npz")
    seeds = {name: folder / name for name in names}
    write_piece_file(seeds["piece.npz"], {"number": 1}, {"clip": np.arange(4), "rate": np.ones(4)})
    state = {"version": 1, "digest": "0" * 16, "players": [{"id": "home_7", "status": "done"}], "notes": []}
    seeds["match.json"].write_text(json.dumps(state, indent=1))
    seeds["mesh.obj"].write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\n")
    seeds["clips.csv"].write_text("file,system,scenario\na.mp4,ours,1\nb.mp4,theirs,1\n")
    write_model(small_model(), seeds["model.json"])
    write_player(seeds["player.npz"], made_player())
    seeds["set.txt"] = sorted(SHIPPED.glob("*.txt"))[0]
    seeds["event_labels.csv"] = Path(event_labels.__file__).parent / "event_words.csv"
    seeds.update(_write_bodies(folder))
    seeds.update(_write_matches(folder))
    return {**seeds, "classifier.npz": _learn(folder / "learned", folder / "classifier.npz")}


def _write_bodies(folder: Path) -> dict[str, Path]:
    """Write a player's joints in four forms, and a walk of SMPL."""
    people = {"7": sample_joints(fps=25.0)[:40]}
    walk = folder / "walk_smpl.npz"
    write_smpl(walk, build_walk(60))
    return {
        "joints.csv": write_table(folder / "joints.csv", people, 25.0),
        "joints.jsonl": write_cdf(folder / "joints.jsonl", people, 25.0),
        "joints.npz": write_fifa(folder / "joints.npz", people),
        "hawkeye.joints": write_hawkeye(folder, people, 25.0),
        "walk_smpl.npz": walk,
    }


def _write_matches(folder: Path) -> dict[str, Path]:
    """Write a match in each form of tracking that the program itself reads: tracking file, metadata, other files."""
    seeds = {}
    for form, write in WRITERS.items():
        written = folder / f"written_{form}"
        written.mkdir()
        tracking = write(written)
        beside = (path for path in written.iterdir() if path != tracking)
        others = sorted(beside, key=lambda path: ("corners" not in path.name, path.name))
        seeds[f"match_{form}"] = copy_group(folder / f"match_{form}", [tracking, *others])
    return seeds


def _learn(clips: Path, out: Path) -> Path:
    """Learn a classifier from clips of the sample; SystemExit where that fails."""
    clips.mkdir()
    for name in _LEARNED:
        for ending in (".bvh", ".txt"):
            shutil.copy(SAMPLE / "library" / (name + ending), clips)
    if main(["library", str(clips), "--cache", str(clips), "--learn", str(out)]):
        raise SystemExit("fuzz: no classifier can be learned, so that a seed is missing")
    return out
