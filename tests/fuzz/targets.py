"""What is fuzzed: every reader, and the verbs that take each kind of file, all in this process."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from beyond_mocap.annotation import read_annotation_csv, read_clip_annotations, read_timeline
from beyond_mocap.annotation.event_labels import read_event_labels
from beyond_mocap.cli.main import main
from beyond_mocap.files.bvh.bvh import read_bvh
from beyond_mocap.files.events import read_events
from beyond_mocap.files.joints.joint_readers import read_joints
from beyond_mocap.files.obj import read_mesh
from beyond_mocap.files.piece_file import read_piece_file
from beyond_mocap.files.smpl.smpl import read_smpl
from beyond_mocap.files.tables import read_ball
from beyond_mocap.files.tracking.tracking import read_match, read_track_csv
from beyond_mocap.library.classify.classifier import read_classifier
from beyond_mocap.markers.files.marker_files import read_markers
from beyond_mocap.markers.files.marker_set_text import read_marker_set
from beyond_mocap.markers.files.model_json import read_model
from beyond_mocap.match.folder import read_state
from beyond_mocap.match.player_file import read_player
from beyond_mocap.motion.retargeting.joint_pairs import read_bone_map
from beyond_mocap.motion.track import clean_track
from beyond_mocap.passes.scene_json import read_scene
from beyond_mocap.path_editing.path_line import read_curve
from beyond_mocap.study.order import read_clips
from beyond_mocap.synthesis.heading_table import read_heading_keys
from beyond_mocap.synthesis.pin_table import read_pins
from beyond_mocap.synthesis.provenance import read_provenance
from beyond_mocap.throws.network_npz import read_model as read_weights


@dataclass(frozen=True)
class Target:
    """One way to read a damaged file.

    Attributes:
        name: of the target, also in the corpus.
        seeds: names of the seeds; an ending such as "*.bvh" stands for all of them.
        weight: how often it is drawn, beside the others.
        read: (damaged file or folder, empty folder) -> None for a reader, the exit status for a verb.
        seconds: processor time it may take.
    """

    name: str
    seeds: tuple[str, ...]
    weight: int
    read: Callable[[Path, Path], int | None]
    seconds: float = 20.0


def _read(name: str, seeds: str, function: Callable, weight: int = 4) -> Target:
    """A reader of one file."""

    def read(path: Path, out: Path) -> None:
        function(path)

    return Target(name, tuple(seeds.split()), weight, read)


def _verb(
    name: str, seeds: str, command: str, files: dict[str, Path], weight: int = 3, seconds: float = 60.0
) -> Target:
    """A verb; in its command {bad} is the damaged file, {out} the empty folder, other names are valid files."""

    def run(path: Path, out: Path) -> int:
        return main([word.format(bad=path, out=out, **files) for word in command.split()])

    return Target(name, tuple(seeds.split()), weight, run, seconds)


def _read_match_folder(path: Path, out: Path) -> None:
    """Read a match from a folder of its files: the tracking file, then the metadata."""
    tracking, *others = sorted(path.iterdir())
    read_match(tracking, others[0] if others else None, cache_dir=out.parent / "cache")


def _read_hawkeye_folder(path: Path, out: Path) -> None:
    """Read a match of HawkEye, whose second file is found by its name."""
    read_match(min(path.glob("*.centroids")), cache_dir=out.parent / "cache")


def _read_event_folder(path: Path, out: Path) -> None:
    """Read events from a folder of their files: the events, then the second file."""
    events, *others = sorted(path.iterdir())
    read_events(events, others[0] if others else None)


def _build_library(path: Path, out: Path) -> int:
    """Build a library of a valid and a damaged clip, or with a damaged text or table."""
    folder = out.parent / "library"
    folder.mkdir()
    for clip in ("walk", "stand"):
        (folder / f"{clip}.bvh").write_bytes((path.parent.parent / f"long_{clip}.bvh").read_bytes())
        (folder / f"{clip}.txt").write_text(f"0 1.9 {'walking' if clip == 'walk' else 'standing'}\n")
    if path.name == "annotations.csv":
        (folder / "walk.txt").unlink()
    (folder / {".bvh": "bad.bvh", ".txt": "walk.txt"}.get(path.suffix, path.name)).write_bytes(path.read_bytes())
    return main(["library", str(folder), "--cache", str(out.parent / "cache"), "--report", str(out / "r.json")])


def list_targets(files: dict[str, Path]) -> list[Target]:
    """List all targets.

    Args:
        files: valid files and folders by name, for the commands of verbs.
    Returns:
        The targets.
    """
    read = [
        _read("bvh", "*.bvh", read_bvh, 20),
        _read("timeline", "words.txt", read_timeline, 10),
        _read("clip words", "words.txt", lambda path: read_clip_annotations(path, 30.0)),
        _read("table of words", "annotations.csv", read_annotation_csv, 8),
        _read("pins", "pins.csv", read_pins, 8),
        _read("headings", "headings.csv", read_heading_keys, 8),
        _read("ball", "ball.csv", read_ball),
        _read("curve", "curve.csv", read_curve),
        _read("provenance", "provenance.csv", read_provenance),
        _read("track", "track.csv", lambda path: clean_track(read_track_csv(path)), 16),
        _read("scene", "*scene.json", read_scene, 12),
        _read("events", "events.csv", read_events, 8),
        _read("event labels", "event_labels.csv", read_event_labels),
        _read("bone map", "map.json", read_bone_map),
        _read("mesh", "mesh.obj", read_mesh),
        _read("clips of a study", "clips.csv", read_clips),
        _read("trc", "*.trc", read_markers, 16),
        _read("c3d", "*.c3d", read_markers, 10),
        _read("marker set", "set.txt", read_marker_set),
        _read("marker model", "model.json", read_model),
        _read("weights", "weights.npz", read_weights, 6),
        _read("classifier", "classifier.npz", read_classifier),
        _read("edit list", "player.npz", read_player, 8),
        _read("piece", "piece.npz", read_piece_file),
        _read("joints", "joints.* *.joints", read_joints, 12),
        _read("smpl", "walk_smpl.npz", read_smpl, 8),
        _read("state of a match", "match.json", lambda path: read_state(path.parent)),
    ]
    matches = [
        Target("match", ("match_*",), 16, _read_match_folder, 30.0),
        Target("match of hawkeye", ("hawkeye",), 4, _read_hawkeye_folder, 30.0),
        Target("events of providers", ("events_*",), 12, _read_event_folder, 30.0),
    ]
    verbs = [
        _verb("mirror", "*.bvh", "mirror {bad} {out}/o.bvh", files, 10),
        _verb("retarget from", "*.bvh", "retarget {bad} --to {walk} --out {out}/o.bvh", files, 6),
        _verb("retarget to", "*.bvh", "retarget {walk} --to {bad} --out {out}/o.bvh", files, 6),
        _verb("retarget by map", "map.json", "retarget {walk} --to {walk} --map {bad} --out {out}/o.bvh", files, 3),
        _verb("path of", "*.bvh", "path {bad} --path {curve} --out {out}/o.bvh", files, 6),
        _verb("path along", "curve.csv", "path {walk} --path {bad} --out {out}/o.bvh --report {out}/r.json", files, 4),
        _verb("evaluate", "*.bvh", "evaluate {bad} --report {out}/r.json", files, 4),
        _verb("evaluate by track", "track.csv", "evaluate {walk} --track {bad} --report {out}/r.json", files, 2),
        _verb(
            "evaluate by tables", "provenance.csv", "evaluate {walk} --provenance {bad} --report {out}/r.json", files, 3
        ),
        _verb("touches", "track.csv", "touches {bad} --out {out}/t.csv --report {out}/r.json", files, 4),
        _verb(
            "synthesize",
            "track.csv",
            "synthesize --library {library} --cache {cache} --track {bad} "
            "--out {out}/o.bvh "
            "--ball {out}/b.csv --report {out}/r.json --nearest",
            files,
            3,
            120.0,
        ),
        _verb(
            "synthesize words",
            "words.txt",
            "synthesize --library {library} --cache {cache} --track {track} "
            "--annotations {bad} --out {out}/o.bvh --nearest",
            files,
            3,
            120.0,
        ),
        _verb(
            "synthesize pins",
            "pins.csv",
            "synthesize --library {library} --cache {cache} --track {track} --pins {bad} --out {out}/o.bvh",
            files,
            3,
            120.0,
        ),
        _verb(
            "synthesize headings",
            "headings.csv",
            "synthesize --library {library} --cache {cache} --track {track} --headings {bad} --out {out}/o.bvh",
            files,
            3,
            120.0,
        ),
        _verb(
            "throw", "weights.npz", "throw synthesize --model {bad} --target 8,1,1 --out {out}/o.bvh", files, 2, 120.0
        ),
        _verb("reconstruct", "walk.trc", "reconstruct {bad} --out {out}/o.bvh --report {out}/r.json", files, 3, 120.0),
        _verb(
            "passes",
            "*scene.json",
            "passes {bad} --library {strikes} --cache {strikes_cache} --out {out}/f",
            files,
            3,
            120.0,
        ),
        _verb("bodies", "joints.*", "bodies --joints {bad} --out {out}/bodies", files, 2, 60.0),
        _verb("retarget smpl", "walk_smpl.npz", "retarget {bad} --to {walk} --out {out}/o.bvh", files, 2, 60.0),
        _verb("reconstruct by model", "model.json", "reconstruct {trc} --model {bad} --out {out}/o.bvh", files),
        _verb(
            "propose",
            "classifier.npz",
            "library {library} --cache {cache} --learned {bad} --propose {out}/w.csv",
            files,
            2,
            60.0,
        ),
        Target("library", ("*.bvh", "words.txt", "annotations.csv"), 3, _build_library, 60.0),
    ]
    return [*read, *matches, *verbs]
