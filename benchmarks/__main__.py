"""`make bench`: time and quality on recordings, section by section, each in a process of its own on one core.

    python -m benchmarks [SECTION ...] [--seconds N] [--out FILE]

A section that takes longer than N seconds is ended. Results go to benchmarks/results.md, where sections that were not
measured stay as they are, and so does one that fails or takes too long, with a line that says so; one that is measured
without the recordings has the shipped sample's tables alone. What was observed by hand stands in notes.md beside it and
is appended to its section. Seconds in tables are processor time.
"""

from __future__ import annotations

import argparse
import importlib
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks import effort  # noqa: E402
from benchmarks.places import DATA, ROOT  # noqa: E402
from beyond_mocap import __version__  # noqa: E402

SECTIONS = {  # name -> heading, (subheading, module, function) of each part
    "methods": ("Methods compared", (("", "methods", "section"),)),
    "alpha": ("Weight of labels for blocks and distance", (("", "label_weight", "section"),)),
    "scenarios": ("Synthesis", (("", "scenarios", "section"),)),
    "against": ("Takes against recordings", (("", "against_recordings", "section"),)),
    "match": ("Players of a match", (("", "match", "speed_section"),)),
    "stages": ("Stages of a match", (("", "match", "stages_section"),)),
    "crowd": ("All players of a match", (("", "match", "crowd_section"),)),
    "paths": ("Path editing", (("", "path_editing", "section"),)),
    "experiments": ("Experiments of the thesis on path editing", (("", "path_experiments", "section"),)),
    "ball": ("The tracked ball", (("", "ball_touches", "section"),)),
    "passes": ("Passes and solved touches", (("", "ball_contact", "section"),)),
    "live": ("Play Live", (("", "live", "section"),)),
    "markers": ("Markers", (("Synthetic markers on known motions", "markers_planted", "truth_table"),
                            ("Synthetic markers on bone", "markers_planted", "bone_table"),
                            ("Filters on synthetic markers", "markers_planted", "filter_table"),
                            ("Gaps, swaps, jumps and lost labels", "markers_planted", "fault_table"),
                            ("Frames per second", "markers_planted", "speed_table"),
                            ("Real trials", "markers_real", "trial_table"),
                            ("Releases of synthetic throws", "markers_real", "planted_table"),
                            ("Margins of releases", "release_margins", "margin_table"),
                            ("Recordings that show no throw", "release_margins", "refusal_table"),
                            ("Pitches against the radar", "markers_real", "radar_table"))),
    "joints": ("Bodies from joints", (("Gaps", "joint_gaps", "section"),
                                        ("Feet without toes", "joint_feet", "section"))),
    "playback": ("Playback in Blender", (("", "playback", "section"),)),
    "scale": ("Large libraries and long tracks", (("", "scale", "section"),)),
    "throws": ("Throws and kicks", (("", "throws", "section"), ("The thrower's body", "pitching", "body_table"))),
}  # fmt: skip
WITHOUT_DATA = ("methods", "experiments", "live", "throws")
"""Sections that measure on the shipped sample too; the others need the recordings."""
LIMIT = 900.0
"""Seconds of clock time that a section may take."""
NOTES = ROOT / "benchmarks" / "notes.md"
_NOTES_HEADING = "### Notes"  # of what comes from NOTES, at the end of a section
_NOT_AGAIN = "Not measured again: "  # begins the line of a section that keeps its earlier figures
_HEAD = "# Results\n\nWritten by `make bench`, with the notes of `notes.md`; seconds are processor time.\n\n"


def measure_section(name: str) -> list[str]:
    """Measure a section in this process.

    Args:
        name: key of SECTIONS.
    Returns:
        Its lines of Markdown.
    """
    effort.bind_to_one_core()
    lines = []
    for title, module, function in SECTIONS[name][1]:
        lines += [f"### {title}", ""] if title else []
        lines += [*getattr(importlib.import_module(f"benchmarks.{module}"), function)(), ""]
    return lines


def measure_in_subprocess(name: str, limit: float) -> tuple[list[str], str]:
    """Measure a section in a process of its own.

    Args:
        name: key of SECTIONS.
        limit: s of clock time.
    Returns:
        Its lines; and why there are none, "" where it finished.
    """
    command = [sys.executable, "-m", "benchmarks", name, "--here"]
    try:
        process = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, timeout=limit)
    except subprocess.TimeoutExpired:
        return [], f"the section takes longer than {limit:g} s."
    return (process.stdout.splitlines(), "") if process.returncode == 0 else ([], "the section failed.")


def read_sections(path: Path) -> dict[str, list[str]]:
    """Read the sections of earlier results, or of the notes.

    Args:
        path: the file; it may be missing.
    Returns:
        Heading -> lines below it, without notes; what comes before the first heading is left out.
    """
    found: dict[str, list[str]] = {}
    is_note = False
    for line in path.read_text("utf-8").splitlines() if path.is_file() else []:
        if line.startswith("## "):
            found[line], is_note = [], False
        elif found and not (is_note := is_note or line == _NOTES_HEADING):
            list(found.values())[-1].append(line)
    return found


def update_section(before: list[str], lines: list[str], failure: str) -> list[str]:
    """Build the lines of a section that has been measured.

    Args:
        before: its earlier lines, [] for none.
        lines: what was measured now.
        failure: why nothing was; "" where it finished.
    Returns:
        The new lines, or the earlier ones below a line that says why they are earlier.
    """
    with_what = f"Version {__version__}, Python {platform.python_version()}, numpy {np.__version__}, one core."
    if not failure:
        return ["", with_what, "", *lines]
    return ["", f"{_NOT_AGAIN}{failure} {with_what}", *(line for line in before if not line.startswith(_NOT_AGAIN))]


def format_results(parts: dict[str, list[str]], notes: dict[str, list[str]]) -> str:
    """Format the results.

    Args:
        parts: heading of each section -> its lines.
        notes: heading of a section -> its notes.
    Returns:
        The text of the file.
    """
    lines = [*_HEAD.splitlines(), ""]
    for heading, part in parts.items():
        lines += [heading, *part, ""]
        lines += [_NOTES_HEADING, *notes[heading], ""] if heading in notes else []
    return normalize_blank_lines("\n".join(lines))


def main() -> int:
    """Measure the chosen sections and write the results."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("section", nargs="*", metavar="SECTION", help=f"all, or some of {', '.join(SECTIONS)}")
    parser.add_argument("--seconds", type=float, default=LIMIT, help="time limit of a section (default %(default)g)")
    parser.add_argument("--out", type=Path, default=ROOT / "benchmarks" / "results.md")
    parser.add_argument("--here", action="store_true", help="print one section, in this process, and write nothing")
    options = parser.parse_args()
    if unknown := [name for name in options.section if name not in SECTIONS]:
        parser.error(f"no section {unknown[0]!r}: one of {', '.join(SECTIONS)}")
    names = options.section or list(SECTIONS)
    if not (DATA / "mocap").is_dir():
        if skipped := [name for name in names if name not in WITHOUT_DATA]:
            print(f"bench: {DATA} is missing; skipped were the sections that need its recordings: {', '.join(skipped)}")
        names = [name for name in names if name in WITHOUT_DATA]
    if options.here:
        print("\n".join(line for name in names for line in measure_section(name)))
        return 0
    parts, notes, is_whole = read_sections(options.out), read_sections(NOTES), True
    for name in names:
        lines, failure = measure_in_subprocess(name, options.seconds)
        is_whole &= not failure
        heading = f"## {SECTIONS[name][0]}"
        parts[heading] = update_section(parts.get(heading, []), lines, failure)
        print("\n".join([heading, *parts[heading]]), flush=True)
        options.out.write_text(format_results(parts, notes), "utf-8")
    return 0 if is_whole else 1


def normalize_blank_lines(text: str) -> str:
    """Remove repeated blank lines, and end the text with one newline."""
    lines = text.splitlines()
    selected = [line for line, before in zip(lines, ["", *lines]) if line or before]
    return "\n".join(selected).rstrip() + "\n"


if __name__ == "__main__":
    sys.exit(main())
