"""Valid files to damage: small ones made from the sample, and those of ../shared where they are."""

import json
import re
import shutil
from importlib.util import find_spec
from pathlib import Path

import numpy as np

TOP = Path(__file__).resolve().parents[2]
SAMPLE, SHARED = TOP / "sample_blend", TOP.parent / "shared" / "data"

TEXTS = {
    "words.txt": "# a comment\n0 6 walking\n1.5 2.5 dribble right\n3 kick right low\n7 8 standing\n",
    "annotations.csv": "file,start_frame,end_frame,key_frame,labels\nwalk.bvh,0,20,,walking\n"
    "walk.bvh,3,9,6,kick right\n",
    "pins.csv": "time_s,part,x_m,y_m,z_m,hold_s\n2,gaze,30,0,1.5,0.5\n2.5,left_hand,0,0,1,\n3,ball,1,1,0.2,\n",
    "headings.csv": "time_s,heading_deg,hold_s,x_m,y_m\n2,120,1,,\n3,,0.5,10,4\n",
    "ball.csv": "time_s,x_m,y_m,z_m,measured\n" + "".join(f"{t / 10},{t / 9:.3f},0,0.11,1\n" for t in range(40)),
    "curve.csv": "x_m,y_m\n" + "".join(f"{0.4 * t},{np.sin(t / 4):.3f}\n" for t in range(24)),
    "provenance.csv": "frame,time_s,clip,clip_frame,mirrored,labels,contact_left,contact_right\n"
    + "".join(f"{f},{f / 30:.4f},walk.bvh,{f},0,walking,1,0\n" for f in range(24)),
    "map.json": json.dumps({"Hips": "Hips", "LeftUpLeg": "LeftUpLeg", "Head": "Head"}),
}
"""Name -> content of the seeds that are written here."""

SHARED_GROUPS = {
    "tracab": ("tracab_raw.dat", "tracab_meta.xml"),
    "tracab_json": ("tracab_raw.json", "tracab_meta.json"),
    "metrica": ("epts_metrica_tracking.txt", "epts_metrica_metadata.xml"),
    "sportec": ("sportec_positional_w_referee.xml", "sportec_meta.xml"),
    "secondspectrum": ("secondspectrum_tracking_anon.jsonl", "secondspectrum_meta_anon.json"),
    "statsperform": ("statsperform_tracking_ma25.txt", "statsperform_tracking_ma1.json"),
    "pff": ("pff_3812.jsonl", "pff_metadata_3812.json", "pff_rosters_3812.json"),
    "signality": (
        "signality_p1_raw_data_subset.json",
        "signality_meta_data.json",
        "signality_venue_information.json",
        "signality_p2_raw_data_subset.json",
    ),
}
"""Provider -> its files in ../shared/data/tracking/other, the tracking file first, then the metadata."""
KLOPPY_GROUPS = {
    "match_skillcorner": ("skillcorner_v3_raw_data.jsonl", "skillcorner_meta_data.json"),
    "hawkeye": ("hawkeye_2_46.football.samples.centroids", "hawkeye_2_46.football.samples.ball"),
    "events_opta": ("opta_f24.xml", "opta_f7.xml"),
    "events_sportec": ("sportec_events.xml", "sportec_meta.xml"),
    "events_statsbomb": ("statsbomb_event.json", "statsbomb_lineup.json"),
    "events_metrica": ("metrica_events.json", "epts_metrica_metadata.xml"),
    "events_wyscout2": ("wyscout_events_v2.json",),
    "events_wyscout3": ("wyscout_events_v3.json",),
    "events_datafactory": ("datafactory_events.json",),
    "events_statsperform": ("statsperform_event_ma3.json", "statsperform_event_ma1.json"),
    "events_impect": ("impect_events.json", "impect_lineups.json"),
}
"""Seed -> its files among kloppy's own test files: tracking or events first, then the second file."""
_LINES = 120  # of large line-based files that are kept
_LARGE = 200_000  # bytes from which on JSON is shortened
_PERIOD = re.compile("Half Start|Half End|KICK_OFF|FINAL_WHISTLE")
_ENTRIES = 60  # of long lists in JSON that are kept


def build_seeds(folder: Path) -> dict[str, Path]:
    """Write the seeds into a folder.

    Args:
        folder: an empty folder.
    Returns:
        Name -> file, or folder of the files of one match, whose first name is the tracking file.
    """
    seeds = {}
    for name, text in TEXTS.items():
        (folder / name).write_text(text)
        seeds[name] = folder / name
    for number, path in enumerate(sorted((SAMPLE / "passes").glob("*.json"))):
        seeds[f"{number}_scene.json"] = path
    seeds["events.csv"] = SAMPLE / "match" / "small" / "small_events.csv"
    seeds["track.csv"] = _cut(SAMPLE / "match" / "player1.csv", folder / "track.csv", 120)
    seeds["walk.trc"] = _cut(SAMPLE / "markers" / "walk.trc", folder / "walk.trc", 60)
    seeds["throw.c3d"] = SAMPLE / "markers" / "throw.c3d"
    seeds["weights.npz"] = TOP / "beyond_mocap" / "throws" / "networks" / "weights" / "throw.npz"
    seeds["walk.bvh"] = shorten_bvh(SAMPLE / "library" / "walking_1_2.bvh", folder / "walk.bvh", 24)
    small = SAMPLE / "match" / "small"
    seeds["match_small"] = copy_group(folder / "match_small", [small / "small.dat", small / "small_meta.xml"])
    return {**seeds, **_build_shared_seeds(folder), **_build_kloppy_seeds(folder)}


def _build_shared_seeds(folder: Path) -> dict[str, Path]:
    """Write the seeds from ../shared; a line says what is missing."""
    other, seeds = SHARED / "tracking" / "other", {}
    for name, files in SHARED_GROUPS.items():
        if all((other / file).is_file() for file in files):
            seeds[f"match_{name}"] = copy_group(folder / f"match_{name}", [other / file for file in files])
    for path in (
        SHARED / "mocap" / "getup" / "humanoid3d_run.bvh",
        SHARED / "mocap" / "bandai" / "dataset-1_run_normal_001.bvh",
        SHARED / "mocap" / "cmu10" / "10_01.bvh",
    ):
        if path.is_file():
            seeds[path.name] = shorten_bvh(path, folder / path.name, 24)
    if len(seeds) < len(SHARED_GROUPS) + 3:
        print(f"fuzz: {len(seeds)} of {len(SHARED_GROUPS) + 3} seeds of {SHARED} are there; the others are skipped")
    return seeds


def _build_kloppy_seeds(folder: Path) -> dict[str, Path]:
    """Write the seeds from kloppy's own test files; a line says where it comes without them."""
    source = Path(find_spec("kloppy").submodule_search_locations[0]) / "tests" / "files"
    if not source.is_dir():
        print("fuzz: this kloppy comes without its own test files; events of providers and HawkEye are skipped")
        return {}
    return {
        name: copy_group(folder / name, [source / file for file in files], has_numbers=name != "hawkeye")
        for name, files in KLOPPY_GROUPS.items()
    }


def copy_group(folder: Path, files: list[Path], has_numbers: bool = True) -> Path:
    """Copy the files of one match, with numbers before their names to keep the order; long ones are cut.

    Args:
        folder: the new folder.
        files: in their order.
        has_numbers: False where a reader knows their names.
    Returns:
        The folder.
    """
    folder.mkdir()
    for number, path in enumerate(files):
        target = folder / (f"{number}_{path.name}" if has_numbers else path.name)
        if path.suffix in (".dat", ".txt", ".jsonl") and number == 0:
            _cut(path, target, _LINES)
        elif path.suffix in (".json", ".centroids", ".ball") and path.stat().st_size > _LARGE:
            target.write_text(json.dumps(_shorten(json.loads(path.read_text())), indent=1))
        else:
            shutil.copy(path, target)
    return folder


def _shorten(value):
    """Shorten the lists in a JSON value; the periods' first and last events stay."""
    if isinstance(value, dict):
        return {name: _shorten(one) for name, one in value.items()}
    if not isinstance(value, list):
        return value
    rows = [one for number, one in enumerate(value) if number < _ENTRIES or _PERIOD.search(json.dumps(one)[:2000])]
    return [_shorten(one) for one in rows]


def _cut(path: Path, target: Path, lines: int) -> Path:
    target.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:lines]))
    return target


def shorten_bvh(path: Path, target: Path, frames: int) -> Path:
    """Write the first frames of a BVH file."""
    lines = path.read_text().splitlines()
    at = next(number for number, line in enumerate(lines) if line.strip().startswith("Frames:"))
    lines[at] = f"Frames: {frames}"
    target.write_text("\n".join(lines[: at + 2 + frames]) + "\n")
    return target
