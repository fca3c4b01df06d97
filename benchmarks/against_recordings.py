"""Whether classifiers can distinguish takes of match players from the recordings of their library, and by what.

For each library TAKES players of a recorded half, each over another window of SECONDS, without labels.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from benchmarks.places import DATA, LIBRARIES, library_folder
from beyond_mocap.evaluation.two_sample_test.comparison import compare_with_recordings, format_comparison
from beyond_mocap.files.tracking.tracking import Match, read_match
from beyond_mocap.library.build import build_library
from beyond_mocap.library.library import Library
from beyond_mocap.motion.track import clean_track
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.quality.playback import Playback, playback_from_take
from beyond_mocap.synthesis.synthesize import synthesize

TAKES, SECONDS = 8, 40.0
FIRST, EVERY = 120.0, 300.0  # s of the half at which the first window begins, and from one to the next


def synthesize_players(library: Library, match: Match) -> dict[str, Playback]:
    """Synthesize the takes: name -> take with its sources."""
    players = match.players[:: max(len(match.players) // TAKES, 1)][:TAKES]
    takes = {}
    for number, player in enumerate(players):
        start = FIRST + EVERY * number
        track, _ = clean_track(match.track(player.id, start, start + SECONDS))
        takes[f"{player.id} {start:g} s"] = playback_from_take(synthesize(library, Plan(track=track, nearest=True)))
    return takes


def section() -> list[str]:
    """Build the lines for results.md."""
    recording = DATA / "tracking" / "match" / "nl2019_half1.dat"
    if not recording.is_file():
        return [f"{recording} is missing; skipped"]
    lines = []
    with tempfile.TemporaryDirectory() as place:
        match = read_match(recording, cache_dir=place)
        for name, unit in LIBRARIES.items():
            folder = library_folder(name, Path(place))
            library = build_library(folder, unit=unit, cache_dir=Path(place) / f"cache_{name}")
            report = compare_with_recordings(synthesize_players(library, match), library)
            lines += [f"### Library {name}", "", *format_comparison(report).splitlines(), ""]
    return lines
