"""The providers of tracking data, one record each, and the files of a match that belong together.

Everything specific to a provider is in its record and in the functions that only this record names.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ...base.errors import InputError, build_read_error, format_count
from ..provider_texts import TRACKING
from .feed import MAX_PLAYERS, Feed, Files, TrackingProvider, find_provider, is_track_csv, load_with_kloppy, read_head
from .referees import read_signality_referees, read_sportec_referees, read_tracab_referees

if TYPE_CHECKING:
    from .formats.samples import MatchSamples

_META_ENDS = ("_meta", "_metadata", "")  # of metadata's names behind the tracking file's
_MOST_PERIODS = 20  # in metadata; TRACAB lists five, and kloppy looks for each of them in every frame


def find_feed(path: str | os.PathLike, meta: str | os.PathLike | None, provider: str | None) -> tuple[Feed, list[str]]:
    """Find the files of a match.

    Args:
        path, meta, provider: see `read_match`.
    Returns:
        The files, and notes on what was assumed.
    Raises:
        InputError: see `read_match`.
    """
    path, notes = _check_file(path), []
    if provider and provider.lower() not in PROVIDERS:
        raise InputError("provider", f"{provider.lower()!r}", f"one of {', '.join(PROVIDERS)}",
                         "write others as a Plain CSV (table)")
    record = PROVIDERS[provider.lower()] if provider else _detect_provider(path, notes)
    if meta:
        second = _check_file(meta, "a metadata file")
    else:
        second = _find_metadata(path, record, notes) if record.needs_metadata else None
    return Feed(record, *record.find_files(path, second, notes), is_meta_chosen=bool(meta)), notes


def load_tracking(feed: Feed, pitch: tuple[float, float]):
    """Load tracking data with kloppy, in the provider's own coordinates.

    Args:
        feed: the files.
        pitch: length and width in metres for a feed without them.
    Returns:
        kloppy's dataset.
    Raises:
        InputError: if kloppy is not installed or cannot read the files.
    """
    _check_second_file(feed)
    record, files, half = feed.provider, list(map(str, feed.tracking)), len(feed.tracking) // 2
    meta, more, *_ = [*map(str, feed.meta), None, None]
    values = {"raw": files[0], "all": files, "first": files[:half], "second": files[half:], "meta": meta, "more": more,
              "length": pitch[0], "width": pitch[1]}  # fmt: skip
    arguments = {key: values[name] for key, name in record.arguments.items()}
    if feed.has_team_files:
        arguments = {"home_data": files[0], "away_data": files[1]}
    arguments["coordinates"] = record.coordinates or record.name
    others = f" and its metadata {', '.join(one.name for one in feed.meta) or feed.tracking[-1].name}"
    loader = record.team_loader if feed.has_team_files else record.loader
    return load_with_kloppy(feed.path, record.name, loader, arguments=arguments, expected=f"{record.title} tracking",
                            others=others)


def _check_second_file(feed: Feed) -> None:
    """Check the form of the metadata, or of the two teams' files, so that an error does not blame the tracking file."""
    for path in feed.tracking if feed.has_team_files else ():
        if not any(re.match(form, read_head(path)) for form in feed.provider.patterns):
            raise InputError(path, "not a team's positions", f"the CSV file of a team by {feed.provider.title}",
                             "choose the other team's file")
    for path in feed.meta[:1]:
        if read_head(path).lstrip()[:1] not in (b"<", b"{", b"[", b"\xff", b"\xfe"):  # the last two: UTF-16
            raise InputError(path, "neither XML nor JSON", f"the metadata of {feed.provider.title}",
                             "choose the metadata file")
        if (count := len(re.findall(rb"<period\b", path.read_bytes(), re.I))) > _MOST_PERIODS:
            raise InputError(path, f"{count} periods", "those of one match", "export it again")


def _check_file(path: str | os.PathLike, kind: str = "a tracking file") -> Path:
    if not Path(path).is_file():
        raise build_read_error(path, kind)
    return Path(path)


def _detect_provider(path: Path, notes: list[str]) -> TrackingProvider:
    from ..joints.joint_readers import is_joint_file  # not needed by a panel that lists the providers

    record = find_provider(path, PROVIDERS)
    if record is not None:
        notes.append(f"{path.name} is read as {record.title}")
        return record
    head, titles = read_head(path), ", ".join(one.title for one in PROVIDERS.values())
    if not head.strip():
        raise InputError(path, "the file is empty", "positions", "export it again")
    if is_track_csv(path):
        expected = f"a match's tracking data from one of {titles}"
        raise InputError(path, "one player's track", expected, "use synthesize for one player")
    if is_joint_file(path):
        raise InputError(path, "skeletal tracking", f"positions of players and ball, from one of {titles}",
                         "use match or bodies for it")
    if b'"freeze_frame"' in head:
        raise InputError(path, "moments of StatsBomb 360", f"a match's tracking data from one of {titles}",
                         "use freeze-frame, whose moment.csv match reads")
    raise InputError(path, "unknown format", f"one of {titles}, or a CSV of one player with time_s,x_m,y_m; "
                     "a Plain CSV has time_s,player,x_m,y_m",
                     "choose the provider, rename the columns, or write a Plain CSV")


def _find_metadata(path: Path, record: TrackingProvider, notes: list[str]) -> Path:
    """Find the metadata file by the tracking file's name."""
    names = [path.name.replace(a, b) for a, b in record.renamed if a in path.name]
    names += [f"{path.stem}{end}{kind}" for end in _META_ENDS for kind in record.metadata_kinds]
    for name in names:
        candidate = path.with_name(name)
        if candidate.is_file() and candidate != path:
            notes.append(f"{name} is used as its {'second' if candidate.suffix == path.suffix else 'metadata'} file")
            return candidate
    raise InputError(
        path, f"the metadata file of {record.title} is missing", f"{names[0]} beside it",
        "add it there, or choose the metadata file",
    )


def _find_companion(meta: Path, word: str, path: Path, notes: list[str]) -> Path:
    """Find the one other file that a provider needs, with `word` in its own or its folder's name.

    Among several, the one that shares a number with the metadata's or the tracking file's name is used.
    """
    folders = {meta.parent, path.parent, *(one for one in meta.parent.parent.glob("*") if word in one.name.lower())}
    found = sorted(
        one for folder in folders if folder.is_dir() for one in folder.glob("*.json")
        if word in f"{folder.name}/{one.name}".lower() and one != meta
    )  # fmt: skip
    numbers = set(re.findall(r"\d+", f"{meta.stem} {path.stem}"))
    matching = [one for one in found if numbers & set(re.findall(r"\d+", one.stem))]
    chosen = matching if len(matching) == 1 else found
    if len(chosen) != 1:
        raise InputError(
            meta, f"{len(chosen)} files with '{word}' in their names beside it", "one that belongs to this match",
            "add it there, and move the others away",
        )
    notes.append(f"{chosen[0].name} is used as its {word} file")
    return chosen[0]


def _find_number(pattern: bytes, content: bytes) -> str | None:
    found = re.search(pattern, content)
    return found[1].decode("utf-8", "replace") if found else None


_find_sportec_number = partial(_find_number, rb'MatchId="([^"]{1,60})"')


def _find_metrica(path: Path, meta: Path, notes: list[str]) -> Files:
    """Find Metrica's files: CSV, one for each team, or EPTS, text with XML."""
    if path.suffix.lower() != ".csv":
        return (path,), (meta,)
    return ((meta, path) if "away" in path.name.lower() else (path, meta)), ()


def _find_secondspectrum(path: Path, meta: Path, notes: list[str]) -> Files:
    """Find Second Spectrum's files; a JSON beside the XML contains names."""
    names = meta.with_suffix(".json")
    if meta.suffix.lower() != ".xml" or not names.is_file():
        return (path,), (meta,)
    notes.append(f"{names.name} is used for the players' names")
    return (path,), (meta, names)


# Readers are imported where a feed is read: a panel that lists the providers needs none.


def _read_cdf(feed: Feed, _pitch: tuple[float, float] | None) -> MatchSamples:
    from .formats.cdf import read_cdf

    return read_cdf(feed)


def _read_respovision(feed: Feed, pitch: tuple[float, float] | None) -> MatchSamples:
    from .formats.respovision import read_respovision

    return read_respovision(feed, pitch)


def _read_soccernet(feed: Feed, _pitch: tuple[float, float] | None) -> MatchSamples:
    from .formats.soccernet import read_soccernet

    return read_soccernet(feed)


def _read_gps(feed: Feed, pitch: tuple[float, float] | None) -> MatchSamples:
    from .formats.gps import read_gps

    return read_gps(feed, pitch)


def _read_table(feed: Feed, pitch: tuple[float, float] | None) -> MatchSamples:
    from .formats.table import read_table

    return read_table(feed, pitch)


def _find_gps(path: Path, meta: Path | None, notes: list[str]) -> Files:
    """Find the files of all players and of the pitch's corners beside a receiver's file."""
    beside = sorted(one for one in path.parent.glob(f"*{path.suffix}") if one != path and _is_gps_file(one))
    corners = meta or next((one for one in sorted(path.parent.glob("*.csv")) if "corners" in one.name.lower()), None)
    players = [one for one in beside if one != corners]
    if len(players) >= MAX_PLAYERS:
        raise InputError(path.parent, f"{len(players) + 1} files of players", f"at most {MAX_PLAYERS} of one match",
                         "move the others away")
    return (path, *players), (corners,) if corners else ()


_GPS_PATTERNS = (
    rb"(?i)[^\n]{0,400}\blat(itude)?\b[^\n]{0,80}\b(lon|long|lng|longitude)\b",
    rb"(?i)[^\n]{0,400}\b(lon|long|lng|longitude)\b[^\n]{0,80}\blat(itude)?\b",
    rb"(?is)\s*(<\?xml[^>]*>\s*)?(<!--.{0,2000}?-->\s*)*<gpx\b",
)  # fmt: skip


def _is_gps_file(path: Path) -> bool:
    """Return whether a file has positions of a receiver with times."""
    head = read_head(path)
    return any(re.match(form, head) for form in _GPS_PATTERNS) and (
        b"<trkpt" in head or "corners" not in path.name.lower() and path.suffix.lower() != ".gpx")


def _find_alone(path: Path, meta: Path | None, notes: list[str]) -> Files:
    """Find the files of a feed that is one file."""
    if meta:
        notes.append(f"{meta.name} is not used: this form has no metadata")
    return (path,), ()


def _find_pff(path: Path, meta: Path, notes: list[str]) -> Files:
    return (path,), (meta, _find_companion(meta, "roster", path, notes))


def _find_pff_number(metadata: bytes) -> str | None:
    with contextlib.suppress(ValueError, TypeError, KeyError, IndexError):
        value = json.loads(metadata)
        return str((value[0] if isinstance(value, list) else value)["id"])
    return None


def _find_signality(path: Path, meta: Path, notes: list[str]) -> Files:
    """Find Signality's files: one for each half, with p1 or p2 in the name, and the venue."""
    names = [re.sub(r"(?i)(?<![a-z0-9])(p)[1-5](?![0-9])", rf"\g<1>{number}", path.name) for number in range(1, 6)]
    found = tuple(dict.fromkeys(path.with_name(name) for name in names if path.with_name(name).is_file()))
    notes += [f"{', '.join(one.name for one in found)} are used as one match"] * (len(found) > 1)
    return found or (path,), (meta, _find_companion(meta, "venue", path, notes))


def _find_hawkeye(path: Path, meta: Path | None, notes: list[str]) -> Files:
    """Find all of HawkEye's files in a folder, one per minute: the players', then the same number of the ball."""
    def compute_minute(file: Path) -> list[int]:
        return [int(number) for number in re.findall(r"\d+", file.name)]

    players = sorted(path.parent.glob("*.samples.centroids"), key=compute_minute)
    balls = sorted(path.parent.glob("*.samples.ball"), key=compute_minute)
    if not players or [compute_minute(file) for file in players] != [compute_minute(file) for file in balls]:
        found = f"{format_count(len(players), 'file')} of players and {len(balls)} of the ball"
        raise InputError(path.parent, found, "one .samples.ball for every .samples.centroids", "complete the folder")
    notes.append(f"{len(players)} files of players and of the ball in {path.parent.name or path.parent} are used")
    return (*players, *balls), (meta,) if meta else ()


PROVIDERS: dict[str, TrackingProvider] = {record.name: record for record in (
    TrackingProvider(
        **TRACKING["tracab"], patterns=(rb"\s*\d+:-?\d+,-?\d+,-?\d+,-?\d+,-?\d+,", rb'\s*\{[^{]{0,200}"FrameData"'),
        read_referees=read_tracab_referees,
    ),
    TrackingProvider(
        **TRACKING["metrica"],
        patterns=(rb"(?i)\s*,,,(Home|Away|[^,\r\n]*),", rb"(?i)\s*\d+:(-?\d*\.\d+|NaN),(-?\d*\.\d+|NaN)"),
        renamed=(("Home", "Away"), ("home", "away"), ("Away", "Home"), ("away", "home")),
        find_files=_find_metrica, loader="load_tracking_epts", team_loader="load_tracking_csv",
    ),
    TrackingProvider(
        **TRACKING["skillcorner"],
        renamed=(("tracking_extrapolated.jsonl", "match.json"), ("tracking.jsonl", "match.json"),
                 ("structured_data", "match_data")), metadata_kinds=(".json",),
        patterns=(rb'(?s)\s*[\[{].{0,4000}("trackable_object"|"image_corners_projection"|"player_data")',),
    ),
    TrackingProvider(
        **TRACKING["sportec"], patterns=(rb"(?s)\s*<.{0,4000}<Positions\b",), loader="load_tracking",
        number_in_tracking=_find_sportec_number, number_in_metadata=_find_sportec_number,
        read_referees=read_sportec_referees,
    ),
    TrackingProvider(
        **TRACKING["secondspectrum"],
        patterns=(rb'(?s)\s*\{(?!.{0,400}"gameRefId").{0,4000}"homePlayers"',), find_files=_find_secondspectrum,
        arguments={"meta_data": "meta", "raw_data": "raw", "additional_meta_data": "more"}, has_own_roster=True,
    ),
    TrackingProvider(
        **TRACKING["statsperform"], patterns=(rb"\s*\d{10,};\d",),
        loader="load_tracking", coordinates="sportvu", has_pitch_size=False,
        arguments={"ma1_data": "meta", "ma25_data": "raw", "pitch_length": "length", "pitch_width": "width"},
    ),
    TrackingProvider(
        **TRACKING["pff"], patterns=(rb'(?s)\s*\{.{0,400}"gameRefId"',), find_files=_find_pff, loader="load_tracking",
        metadata_kinds=(".json",),
        arguments={"meta_data": "meta", "raw_data": "raw", "roster_meta_data": "more"},
        number_in_tracking=partial(_find_number, rb'"gameRefId"\s*:\s*"?(\d+)'), number_in_metadata=_find_pff_number,
    ),
    TrackingProvider(
        **TRACKING["signality"],
        patterns=(rb'(?s)\s*\[\s*\{.{0,400}"utc_time"',), find_files=_find_signality, metadata_kinds=(".json",),
        arguments={"meta_data": "meta", "raw_data_feeds": "all", "venue_information": "more"},
        read_referees=read_signality_referees,
    ),
    TrackingProvider(
        **TRACKING["hawkeye"],
        patterns=(rb'(?s)\s*\{\s*"details"\s*:.{0,4000}"heId"',), find_files=_find_hawkeye, needs_metadata=False,
        arguments={"player_centroid_feeds": "first", "ball_feeds": "second", "meta_data": "meta",
                   "pitch_length": "length", "pitch_width": "width"},
    ),
    TrackingProvider(
        **TRACKING["cdf"],
        patterns=(rb'(?s)\s*\{\s*"frame_id"(?!.{0,2000}"landmarks").{0,600}"teams"\s*:\s*\{\s*"(home|away)"',),
        renamed=(("tracking.jsonl", "meta.json"), ("tracking.jsonl", "metadata.json")), metadata_kinds=(".json",),
        read_samples=_read_cdf,
    ),
    TrackingProvider(
        **TRACKING["respovision"], needs_metadata=False, has_pitch_size=False,
        patterns=(rb'(?s)\s*\{.{0,300}"pitch_side"\s*:',), find_files=_find_alone, read_samples=_read_respovision,
    ),
    TrackingProvider(
        **TRACKING["soccernet"],
        patterns=(rb'(?s)\s*\{.{0,4000}"bbox_pitch"', rb'(?s)\s*\{\s*"info"\s*:.{0,4000}"(im_dir|im_ext|seq_length)"'),
        needs_metadata=False, find_files=_find_alone, read_samples=_read_soccernet,
    ),
    TrackingProvider(
        **TRACKING["gps"], patterns=_GPS_PATTERNS, needs_metadata=False, find_files=_find_gps, read_samples=_read_gps,
    ),
    TrackingProvider(
        **TRACKING["table"],
        patterns=(rb"(?i)(?=[^\n]{0,400}\btime)(?=[^\n]{0,400}\b(player(_id)?|track_id|id)\b)(?=[^\n]{0,400}\bx(_m)?\b)"
                  rb"(?![^\n]{0,400}\b(lat|latitude|joint|landmark|type)\b)",),
        needs_metadata=False, has_pitch_size=False, find_files=_find_alone, read_samples=_read_table,
    ),
)}  # fmt: skip
