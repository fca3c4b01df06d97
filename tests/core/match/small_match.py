"""A stretch of the small match (sample_blend/match/small), and what of its folder has to be the same bits always."""

import json
from pathlib import Path

TOP = Path(__file__).resolve().parents[3]
SMALL = TOP / "sample_blend" / "match" / "small"
LIBRARY = TOP / "sample_blend" / "library"
PLAYERS = ("home_7", "home_10", "away_6")
SECONDS = (3.0, 11.0)


def read_reproducible_files(folder: Path) -> dict[str, bytes]:
    """What has to be the same bits however the match is made: all but how long that took."""
    out = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.is_file() and not name.startswith(".work") and name not in ("match.json", "report.html"):
            content = path.read_bytes()
            if name.endswith("report.json"):
                report = json.loads(content)
                report["seconds"] = None
                content = json.dumps(report).encode()
            out[name] = content
    return out
