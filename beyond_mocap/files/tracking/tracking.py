"""Read positional tracking data: the project's own CSV, and providers' files through kloppy, converted to arrays once.

In the core: metres from the pitch's centre, x along its length, y to the left of +x, seconds.
"""

from __future__ import annotations

import contextlib
import gc
import hashlib
import io
import os
import re
from array import array
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...base.content import open_file
from ...base.errors import InputError, format_count
from ...base.user_folders import find_user_cache
from ...motion.skeleton import freeze_array
from ...motion.track import Track
from ...motion.track.match_data import REFEREE, Match, MatchPlayer, Team, describe_presence
from ..atomic import atomic_write, remove_abandoned
from ..plain_npz import read_own_arrays
from ..tables import parse_number, read_rows
from . import match_arrays
from .body_angles import find_headings
from .feed import Feed, refuse_damage
from .formats.samples import MatchSamples
from .match_repairs import (
    check_periods,
    check_players,
    check_rows,
    check_same_match,
    check_side_names,
    cut_to_whole_lines,
    repair_ball,
    repair_players,
    repair_sides,
)
from .providers import find_feed, load_tracking
from .referees import describe_referee, read_referee_samples, read_team_colours

RATES = (5.0, 100.0)
"""Smallest and largest sampling rate of a track, samples per second."""

_PLAYER = ("time_s", "x_m", "y_m")
_BALL = ("ball_x_m", "ball_y_m", "ball_z_m")
_CACHE_VERSION = 5
_CACHE_BYTES = 4_000_000_000  # of all matches in the cache, some 40
_CACHE_NAME = re.compile(r"[0-9a-f]{40}\.npz")
_ARRAY_NAMES = ("times", "positions", "ball", "players", "pitch", "periods", "teams", "lines", "headings")


def read_track_csv(path: str | os.PathLike) -> Track:
    """Read a player and the ball from `time_s,x_m,y_m[,ball_x_m,ball_y_m,ball_z_m]`, unchanged; other columns are
    ignored.

    Empty cells (or nan) are unknown. Rows keep the file's order, with repeated times and gaps:
    `motion.track.clean_track` repairs them and reports it.

    Args:
        path: the file.
    Returns:
        The track.
    Raises:
        InputError: with the line, for missing columns (also one of the ball's two on the ground), cells that are
            not numbers or beyond 10 km, fewer than two samples with a position, and rates outside 5 to 100 Hz.
    """
    cells, names = array("d"), ()
    for place, row in read_rows(path, _PLAYER):  # no rows are kept: a dict of one takes as much as a hundred numbers
        if not names:
            names = _PLAYER + _find_ball_columns(row, path)
        cells.extend(parse_number(row[name], name, place, blank=True) for name in names)
    names = names or _PLAYER
    values = np.array(cells).reshape(-1, len(names))
    player, ball = values[:, :3], np.full((len(values), 3), np.nan)
    ball[:, : len(names) - 3] = values[:, 3:]
    track = Track(player[:, 0], player[:, 1:], ball, name=Path(path).name)
    _check_rate(track, path)
    return track


def _find_ball_columns(names, path) -> tuple[str, ...]:
    """Find the ball's columns: none, or both on the ground and perhaps its height; InputError for one of both."""
    found = tuple(name for name in _BALL if name in names)
    lacking = [name for name in _BALL[:2] if name not in found]
    if len(lacking) == 1:
        raise InputError(path, f"no column {lacking[0]!r}", "both of 'ball_x_m' and 'ball_y_m', or neither",
                         f"add {lacking[0]!r}, or rename the other")
    return () if lacking else found


def _check_rate(track: Track, path) -> None:
    known = np.isfinite(track.times) & track.is_measured
    distinct = len(np.unique(track.times[known]))
    if distinct < 2:
        found = f"{format_count(distinct, 'sample')} with a distinct time and a position"
        raise InputError(path, found, "at least two", "export it again")
    rate = 1.0 / track.interval
    if not RATES[0] - 0.01 <= rate <= RATES[1] + 0.5:
        raise InputError(path, f"{rate:.3g} samples per second", "5 to 100", "check that time_s is in seconds")


def read_match(
    path: str | os.PathLike, meta: str | os.PathLike | None = None, provider: str | None = None,
    cache_dir: str | os.PathLike | None = None, pitch: tuple[float, float] | None = None,
) -> Match:
    """Read a provider's tracking data as arrays; a second time from a cache.

    Args:
        path: the tracking file.
        meta: the provider's metadata, for Metrica's CSV the other team's file; None searches beside `path`, also for
            further files that a provider has (rosters, other halves).
        provider: key of `providers.PROVIDERS`; None detects it from the content.
        cache_dir: folder of the cache, keyed by the content of all files; None for the user's cache folder.
        pitch: length and width in metres for feeds without them (Metrica's CSV, Stats Perform); None for 105 x 68.
    Returns:
        The match; its notes list what was assumed, its report all repairs.
    Raises:
        InputError: if files are missing, invalid or not of one match, or without kloppy.
    """
    feed, notes = find_feed(path, meta, provider)
    folder = Path(cache_dir) if cache_dir is not None else _find_cache_folder()
    cache = folder / f"{_compute_key(feed, pitch)}.npz" if folder else None
    arrays = _load_cache(cache) if cache else None
    if arrays is None:
        arrays = _read_arrays(feed, pitch)
        if cache:
            _save_cache(cache, arrays, notes)
    return _build_match(arrays, feed, notes)


def _read_arrays(feed: Feed, pitch: tuple[float, float] | None) -> dict[str, np.ndarray]:
    """Read the match's arrays from its files; a file that ends within a line is read up to that line."""
    check_same_match(feed)
    try:
        return _build_arrays(_read_samples(feed, pitch), pitch)
    except InputError:
        if not feed.is_line_based or all(path.read_bytes()[-1:] == b"\n" for path in feed.tracking):
            raise
        with cut_to_whole_lines(feed) as whole_feed:
            try:
                samples = _read_samples(whole_feed, pitch, feed)
            except InputError:
                samples = None
        if samples is None:
            raise
    samples.lines.insert(0, "the file ends within a line: it is read up to that line")
    return _build_arrays(samples, pitch)


def _read_samples(feed: Feed, pitch: tuple[float, float] | None, whose: Feed | None = None) -> MatchSamples:
    """Read the samples of a match; with copies of files, `whose` are the user's."""
    with refuse_damage(feed.path, f"{feed.provider.title} tracking", feed.meta):
        if feed.provider.read_samples is not None:
            return feed.provider.read_samples(feed, pitch)
        samples = _convert_dataset(load_tracking(feed, pitch or match_arrays.USUAL_PITCH), whose or feed, pitch)
        gc.collect()  # kloppy's frames refer to each other in circles: 1.3 GB of a match
        return samples


def _convert_dataset(dataset, feed: Feed, pitch: tuple[float, float] | None) -> MatchSamples:
    """Convert kloppy's dataset, with the referees that it ignores."""
    records = match_arrays.list_records(dataset)
    lines = [*check_rows(feed), *check_periods(records, dataset, feed)]
    players = match_arrays.list_players(records)
    lines += check_players(players, dataset, feed)
    times, periods = match_arrays.build_clock(records)
    match_arrays.check_clock(feed.path, times)
    length, width, is_default = match_arrays.find_pitch_size(dataset, pitch, feed.provider.has_pitch_size)
    match_arrays.check_size(feed.path, (length, width))
    to_metres = match_arrays.build_metre_map(dataset.metadata.coordinate_system, length, width,
                                             upward=feed.has_team_files)
    ball = match_arrays.build_ball_samples(records)
    ball = np.concatenate([to_metres(ball[:, :2]), ball[:, 2:] * match_arrays.find_height_unit(dataset)], axis=1)
    referees, places, referee_lines = read_referee_samples(feed, np.array([frame.frame_id for frame in records]))
    people = [*map(match_arrays.describe_player, players), *map(describe_referee, referees)]
    positions = to_metres(np.concatenate([match_arrays.build_player_samples(records, players), places]))
    return MatchSamples(times=times, periods=periods, people=people, positions=positions, ball=ball,
                        fps=float(dataset.metadata.frame_rate), size=None if is_default else (length, width),
                        teams=_list_teams(dataset, feed), lines=[*lines, *referee_lines])


def _build_arrays(match: MatchSamples, pitch: tuple[float, float] | None) -> dict[str, np.ndarray]:
    """Build the named arrays of a match, which the cache stores."""
    times, people, periods = match.times, match.people, match.periods
    length, width = match.size or pitch or match_arrays.USUAL_PITCH
    positions, player_lines = repair_players(times, match.positions, length, width, [one[0] for one in people])
    ball, ball_lines = repair_ball(match.ball, length, width)
    spans, teams = [one[:2] for one in periods], [one[1] for one in people]
    positions, ball, side_messages = repair_sides(times, positions, ball, spans, teams)
    headings, heading_lines = np.zeros((0, 0)), []
    if match.angles is not None:
        headings, heading_lines = find_headings(times, positions, match.angles, periods)
    side_messages += check_side_names(times, positions, spans, teams, [one[4] for one in people])
    return {
        "times": times, "positions": positions, "ball": ball,
        "players": np.array(people, dtype=str).reshape(len(people), 5),
        "pitch": np.array([length, width, match.size is None and pitch is None, match.fps]),
        "periods": np.array(periods), "teams": np.array(match.teams, dtype=str).reshape(-1, 3),
        "lines": np.array([*match.lines, *side_messages, *heading_lines, *ball_lines, *player_lines], dtype=str),
        "headings": headings,
    }


def _list_teams(dataset, feed: Feed) -> list[tuple[str, str, str]]:
    """List ground, name and colour of the home and the away team."""
    colours = read_team_colours(feed)
    names = {str(team.ground): str(team.name or "") for team in dataset.metadata.teams}
    return [(ground, names.get(ground, ""), colours[ground]) for ground in ("home", "away")]


def _build_match(arrays: dict[str, np.ndarray], feed: Feed, notes: list[str]) -> Match:
    length, width, is_default, fps = arrays["pitch"].tolist()
    notes = [*notes, f"no pitch size in the feed, {length:g} x {width:g} m assumed"] if is_default else notes
    players = tuple(
        MatchPlayer(id_, team, name, int(shirt), position)
        for id_, team, name, shirt, position in arrays["players"].tolist()
    )
    referees = (Team(REFEREE, "referees"),) if any(player.team == REFEREE for player in players) else ()
    match = Match(
        times=freeze_array(arrays["times"]), players=players, positions=freeze_array(arrays["positions"]),
        ball=freeze_array(arrays["ball"]), length=length, width=width, fps=fps, provider=feed.provider.name,
        periods=tuple((start, end) for start, end, _, _ in arrays["periods"].tolist()), notes=tuple(notes),
        teams=(*(Team(*team) for team in arrays["teams"].tolist()), *referees),
        elapsed=tuple((int(number), before) for _, _, number, before in arrays["periods"].tolist()),
        headings=freeze_array(arrays["headings"]) if arrays["headings"].size else None,
    )
    return replace(match, report=(*notes, *arrays["lines"].tolist(), *describe_presence(match)))


def _find_cache_folder() -> Path | None:
    """Find the user's cache of tracking data; None for a user without a home."""
    base = find_user_cache()
    return base and base / "tracking"


def _compute_key(feed: Feed, pitch: tuple[float, float] | None) -> str:
    """Compute a key from the files' contents, independent of their names."""
    digest = hashlib.sha256(f"{_CACHE_VERSION} {feed.provider.name} {pitch} {feed.is_meta_chosen}".encode())
    for file in (*feed.tracking, *feed.meta):
        with open_file(file, f"a file of {feed.provider.title}") as stream:
            digest.update(hashlib.file_digest(stream, "sha256").digest())  # type: ignore[arg-type]  # has readinto
    return digest.hexdigest()[:40]


def _load_cache(cache: Path) -> dict[str, np.ndarray] | None:
    """Load the arrays from the cache; None if they are missing or damaged."""
    try:
        arrays = read_own_arrays(cache, "a match in the cache")
        with contextlib.suppress(OSError):
            os.utime(cache)  # matches in use stay the longest
    except InputError:
        return None
    if not arrays.keys() >= {*_ARRAY_NAMES}:
        return None
    count, player_count = arrays["times"].size, arrays["players"].size // 5
    shapes = {"times": (count,), "positions": (player_count, count, 2), "ball": (count, 3), "pitch": (4,),
              "players": (player_count, 5)}
    fits = all(arrays[name].shape == shape for name, shape in shapes.items())
    fits = fits and arrays["headings"].shape in ((0, 0), (player_count, count))
    return arrays if fits and arrays["periods"].shape[1:] == (4,) and arrays["teams"].shape[1:] == (3,) else None


def _save_cache(cache: Path, arrays: dict[str, np.ndarray], notes: list[str]) -> None:
    """Save the arrays to the cache; if the folder is not writable, add a note."""
    content = io.BytesIO()
    np.savez(content, **arrays)
    try:
        cache.parent.mkdir(parents=True, exist_ok=True)
        atomic_write(cache, content.getvalue())
        _prune_cache(cache)
        remove_abandoned(cache.parent)
    except (OSError, InputError):
        notes.append(f"{cache.parent} is not writable, so nothing is cached for the next time")


def _prune_cache(newest: Path) -> None:
    """Remove the matches that were not read for the longest time, until the others have _CACHE_BYTES at most."""
    found = [(path.stat(), path) for path in newest.parent.iterdir() if _CACHE_NAME.fullmatch(path.name)]
    size = 0
    for status, path in sorted(found, key=lambda one: (one[1] != newest, -one[0].st_mtime_ns, one[1].name)):
        size += status.st_size
        if size > _CACHE_BYTES and path != newest:
            path.unlink(missing_ok=True)
