"""Positional tracking in: the contract's own CSV by itself, providers' files through kloppy, converted to arrays once.

Inside: metres from the pitch's centre, x along its length, y to the left of +x, seconds.
"""

from __future__ import annotations

import hashlib
import importlib
import io
import os
import re
import warnings
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..motion.skeleton import frozen_array
from ..motion.track import Track
from .tables import number, read_rows
from .whole import atomic_write

PROVIDERS = ("tracab", "metrica", "skillcorner", "sportec", "secondspectrum", "statsperform")

RATES = (5.0, 100.0)
"""Samples per second that a track may have."""

_BALL = ("ball_x_m", "ball_y_m", "ball_z_m")
_CACHE_VERSION = 1
_USUAL_PITCH = (105.0, 68.0)
_PERIOD_BREAK = 10.0  # seconds put between the periods of a match
_META_NAMES = ("{}_meta.xml", "{}_meta.json", "{}_metadata.xml", "{}_metadata.json", "{}.xml", "{}.json")


def read_track_csv(path: str | os.PathLike) -> Track:
    """One player and the ball from `time_s,x_m,y_m[,ball_x_m,ball_y_m,ball_z_m]`, other columns ignored, as the file
    has it.

    Empty cells (or nan) are unknown. Rows stay in the file's order, repeated times and gaps included:
    `motion.track.clean` puts that right and tells. InputError, with the line, for missing columns, cells that are no
    number or beyond 10 km, fewer than two samples with a position, and rates outside 5 to 100 Hz.
    """
    rows = list(read_rows(path, ("time_s", "x_m", "y_m")))
    names = rows[0][1] if rows else {}
    player = _cells(rows, ("time_s", "x_m", "y_m"))
    ball = np.full((len(rows), 3), np.nan)
    if "ball_x_m" in names and "ball_y_m" in names:
        ball = _cells(rows, [name for name in _BALL if name in names])
        ball = np.pad(ball, ((0, 0), (0, 3 - ball.shape[1])), constant_values=np.nan)
    track = Track(player[:, 0], player[:, 1:], ball, name=Path(path).name)
    _check_rate(track, path)
    return track


def _cells(rows, names) -> np.ndarray:
    """(N, k) numbers of some columns, NaN for blank cells."""
    cells = [[number(row[name], name, place, blank=True) for name in names] for place, row in rows]
    return np.array(cells, dtype=float).reshape(len(rows), len(names))


def _check_rate(track: Track, path) -> None:
    known = np.isfinite(track.times) & track.measured
    if len(np.unique(track.times[known])) < 2:
        found = f"{np.count_nonzero(known)} samples with a time of their own and a position"
        raise InputError(path, found, "at least two", "export it again")
    rate = 1.0 / track.interval
    if not RATES[0] - 0.01 <= rate <= RATES[1] + 0.5:
        raise InputError(path, f"{rate:.3g} samples per second", "5 to 100", "check that time_s is in seconds")


@dataclass(frozen=True)
class MatchPlayer:
    """A player: id as the feed spells it, team ("home", "away"), name, shirt number (-1 where the feed has none)."""

    id: str
    team: str
    name: str
    number: int


@dataclass(frozen=True, eq=False)
class Match:
    """Everybody's samples, N times and P players, as the feed has them (not cleaned).

    times: (N,) seconds from the first frame of the first period; each later period starts ten seconds after the one
    before. players: P of them. positions: (P, N, 2) metres, NaN where a player is not there. ball: (N, 3) metres, NaN
    where unknown. length, width: of the pitch, metres. fps: the feed's rate. provider: whose form it was. periods:
    (start, end) seconds. notes: what was guessed, for people. Arrays are read-only.
    """

    times: np.ndarray
    players: tuple[MatchPlayer, ...]
    positions: np.ndarray
    ball: np.ndarray
    length: float
    width: float
    fps: float
    provider: str
    periods: tuple[tuple[float, float], ...]
    notes: tuple[str, ...] = ()

    def track(self, player_id: str, start: float | None = None, end: float | None = None) -> Track:
        """One player and the ball between two times (seconds, whole match by default), from when he is first there.

        InputError for an unknown player, or one with fewer than two samples in that time.
        """
        ids = [player.id for player in self.players]
        if player_id not in ids:
            raise InputError("player", f"{player_id!r}", f"one of {', '.join(ids)}")
        path = self.positions[ids.index(player_id)]
        low = -np.inf if start is None else start - 1e-9
        high = np.inf if end is None else end + 1e-9
        there = np.flatnonzero(np.isfinite(path).all(axis=1) & (self.times >= low) & (self.times <= high))
        if len(there) < 2:
            found = f"{player_id!r} has {len(there)} samples from {start} to {end} s"
            raise InputError("player", found, "at least two")
        part = slice(there[0], there[-1] + 1)
        return Track(self.times[part], path[part], self.ball[part], name=player_id)


def read_match(
    path: str | os.PathLike,
    meta: str | os.PathLike | None = None,
    provider: str | None = None,
    cache_dir: str | os.PathLike | None = None,
    pitch: tuple[float, float] | None = None,
) -> Match:
    """A provider's tracking file as arrays; the second time from a cache of them.

    meta: the provider's metadata, for Metrica's CSV the other team's file; where None, a file beside `path` whose name
    fits is taken. provider: one of PROVIDERS; where None, guessed from the content. cache_dir: where arrays are kept,
    keyed by the content of both files; by default the user's cache folder. pitch: length and width in metres for feeds
    that have none (Metrica's CSV, Stats Perform), by default 105 x 68. What was guessed is in the match's notes.
    InputError where files are missing or not of that form, and where kloppy is not installed.
    """
    path = _existing(path)
    provider, notes = (provider.lower(), []) if provider else _guessed_provider(path)
    if provider not in PROVIDERS:
        raise InputError("provider", f"{provider!r}", f"one of {', '.join(PROVIDERS)}")
    meta = _existing(meta) if meta else _meta_beside(path, provider, notes)
    cache = _cache_folder(cache_dir) / f"{_key(path, meta, f'{provider} {pitch}')}.npz"
    arrays = _cached(cache)
    if arrays is None:
        arrays = _arrays(_load(path, meta, provider, pitch or _USUAL_PITCH), path, pitch)
        _keep(cache, arrays, notes)
    return _match(arrays, provider, notes)


def _existing(path: str | os.PathLike) -> Path:
    if not Path(path).is_file():
        found = "is a folder" if Path(path).is_dir() else "no such file"
        raise InputError(path, found, "a tracking file", "check the path")
    return Path(path)


_FORMS = (
    ("tracab", re.compile(rb"\s*\d+:-?\d+,-?\d+,-?\d+,-?\d+,-?\d+,")),
    ("tracab", re.compile(rb'\s*\{[^{]{0,200}"FrameData"')),
    ("metrica", re.compile(rb"\s*,,,(Home|Away|[^,\r\n]*),", re.IGNORECASE)),
    ("metrica", re.compile(rb"\s*\d+:(-?\d*\.\d+|NaN),(-?\d*\.\d+|NaN)", re.IGNORECASE)),
    ("statsperform", re.compile(rb"\s*\d{10,};\d")),
    ("secondspectrum", re.compile(rb'(?s)\s*\{.{0,4000}"homePlayers"')),
    ("skillcorner", re.compile(rb'(?s)\s*[\[{].{0,4000}("trackable_object"|"image_corners_projection"|"player_data")')),
    ("sportec", re.compile(rb"(?s)\s*<.{0,4000}<Positions\b")),
)


def _guessed_provider(path: Path) -> tuple[str, list[str]]:
    with open(path, "rb") as file:
        head = file.read(8192).removeprefix(b"\xef\xbb\xbf")
    for provider, form in _FORMS:
        if form.match(head):
            return provider, [f"{path.name} read as {provider}"]
    if not head.strip():
        raise InputError(path, "an empty file", "positions", "export it again")
    expected = f"a CSV file with time_s,x_m,y_m, or one of {', '.join(PROVIDERS)}"
    raise InputError(path, "a form that is not known", expected, "name the columns so, or the provider")


def _meta_beside(path: Path, provider: str, notes: list[str]) -> Path:
    """The metadata file that the tracking file's name leads to."""
    names = [form.format(path.stem) for form in _META_NAMES]
    if provider == "metrica":
        names = [path.name.replace(a, b) for a, b in _TEAMS if a in path.name] + names
    for name in names:
        beside = path.with_name(name)
        if beside.is_file() and beside != path:
            notes.append(f"{name} taken as its {'second' if beside.suffix == path.suffix else 'metadata'} file")
            return beside
    raise InputError(
        path, f"no metadata file beside it for {provider}", names[0],
        "put it there, or name it (--meta, in Blender Metadata)",
    )


_TEAMS = (("Home", "Away"), ("home", "away"), ("Away", "Home"), ("away", "home"))


def _load(path: Path, meta: Path, provider: str, pitch: tuple[float, float]):
    """kloppy's dataset in the provider's own coordinates; `pitch` in metres for a feed that must be told."""
    try:
        reader = importlib.import_module(f"kloppy.{provider}")
    except ImportError as error:
        raise InputError(
            path, f"kloppy cannot be imported ({error})", "kloppy 3.19 or newer", "pip install 'beyond-mocap[tracking]'"
        ) from None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return _read_with(reader, str(path), str(meta), provider, pitch)
    except Exception as error:  # kloppy raises whatever its parsers meet in a wrong file
        found = f"not readable as {provider} ({type(error).__name__}: {str(error)[:120]})"
        expected = f"a {provider} file and its metadata {meta.name}"
        raise InputError(path, found, expected, "check both, and the provider") from None


def _read_with(reader, path: str, meta: str, provider: str, pitch: tuple[float, float]):
    """One provider's loader; their argument names differ. Metrica has CSV (a file per team) and EPTS (text with
    XML)."""
    if provider == "metrica" and path.lower().endswith(".csv"):
        home, away = (meta, path) if "away" in Path(path).name.lower() else (path, meta)
        return reader.load_tracking_csv(home_data=home, away_data=away, coordinates="metrica")
    if provider == "metrica":
        return reader.load_tracking_epts(meta_data=meta, raw_data=path, coordinates="metrica")
    if provider == "statsperform":
        return reader.load_tracking(
            ma1_data=meta, ma25_data=path, pitch_length=pitch[0], pitch_width=pitch[1], coordinates="sportvu"
        )
    load = reader.load_tracking if provider == "sportec" else reader.load
    return load(meta_data=meta, raw_data=path, coordinates=provider)


def _arrays(dataset, path: Path, pitch: tuple[float, float] | None) -> dict[str, np.ndarray]:
    """The match as named arrays, everything that the cache keeps."""
    records = [frame for frame in dataset.records if frame.players_data or frame.ball_coordinates is not None]
    if len(records) < 2:
        raise InputError(path, f"{len(records)} frames with anybody in them", "a match")
    times, periods = _clock(records)
    players = sorted({player for frame in records for player in frame.players_data}, key=_shirt)
    length, width, guessed = _pitch(dataset, pitch)
    to_metres = _metric(dataset.metadata.coordinate_system, length, width, path.suffix.lower() == ".csv")
    ball = _ball_samples(records)
    return {
        "times": times,
        "positions": to_metres(_player_samples(records, players)),
        "ball": np.concatenate([to_metres(ball[:, :2]), ball[:, 2:] * _unit(dataset)], axis=1),
        "players": np.array([_described(player) for player in players], dtype=str).reshape(len(players), 4),
        "pitch": np.array([length, width, guessed, float(dataset.metadata.frame_rate)]),
        "periods": np.array(periods),
    }


def _player_samples(records, players) -> np.ndarray:
    """(P, N, 2) in the provider's coordinates, NaN where a player is not there."""
    row = {player.player_id: index for index, player in enumerate(players)}
    out = np.full((len(players), len(records), 2), np.nan)
    for index, frame in enumerate(records):
        for player, data in frame.players_data.items():
            if data.coordinates is not None:
                out[row[player.player_id], index] = data.coordinates.x, data.coordinates.y
    return out


def _ball_samples(records) -> np.ndarray:
    """(N, 3) in the provider's coordinates, NaN where unknown; many feeds have no height."""
    out = np.full((len(records), 3), np.nan)
    for index, frame in enumerate(records):
        point = frame.ball_coordinates
        if point is not None:
            height = getattr(point, "z", None)
            out[index] = point.x, point.y, np.nan if height is None else height
    return out


def _clock(records) -> tuple[np.ndarray, list[tuple[float, float]]]:
    """Seconds of every frame (N,) on one clock for all periods, and each period's (start, end) on it."""
    period = np.array([frame.period.id for frame in records])
    clock = np.array([frame.timestamp.total_seconds() for frame in records])
    times, spans = np.empty(len(records)), []
    for number_ in dict.fromkeys(period.tolist()):
        members = period == number_
        begin = spans[-1][1] + _PERIOD_BREAK if spans else 0.0
        times[members] = clock[members] - clock[members].min() + begin
        spans.append((begin, float(times[members].max())))
    return times, spans


def _shirt(player) -> tuple[str, int, str]:
    return str(player.team.ground), int(player.jersey_no or 0), str(player.player_id)


def _described(player) -> tuple[str, str, str, str]:
    id_, shirt = str(player.player_id), player.jersey_no
    return id_, str(player.team.ground), player.name or id_, str(-1 if shirt is None else shirt)


def _pitch(dataset, pitch: tuple[float, float] | None) -> tuple[float, float, bool]:
    """Length, width in metres, and whether they are a guess because the feed has none and nobody told."""
    size = dataset.metadata.pitch_dimensions
    length, width = size.pitch_length, size.pitch_width
    kloppys_guess = size.unit.name == "NORMED" and (length, width) == _USUAL_PITCH
    if length and width and not kloppys_guess and dataset.metadata.provider.name not in ("SPORTVU", "STATSPERFORM"):
        return float(length), float(width), False
    return (*(pitch or _USUAL_PITCH), pitch is None)


def _unit(dataset) -> float:
    """Metres per unit of height; feeds that scale the pitch to 0..1 have none, or metres."""
    return 0.01 if dataset.metadata.coordinate_system.pitch_dimensions.unit.name == "CENTIMETERS" else 1.0


def _metric(system, length: float, width: float, upward: bool):
    """The map from a provider's plane coordinates (..., 2) to metres from the pitch's centre, y to the left of +x.

    kloppy's own transformations pass through its standard pitch and bend positions between the lines; this one is
    linear. upward: y grows upward whatever the system says. kloppy turns the y of Metrica's CSV over while reading and
    still calls it downward; Metrica says (and the same match in TRACAB's form agrees) that the file's own y grows
    downward.
    """
    size = system.pitch_dimensions
    x, y = size.x_dim, size.y_dim
    scale = {"METERS": (1.0, 1.0), "CENTIMETERS": (0.01, 0.01)}.get(size.unit.name)
    if scale is None:
        scale = length / (x.max - x.min), width / (y.max - y.min)
    ranges = ((0.0, length), (0.0, width)) if x.max is None or y.max is None else ((x.min, x.max), (y.min, y.max))
    middle = np.mean(ranges, axis=1)
    sign = -1.0 if system.vertical_orientation.name == "TOP_TO_BOTTOM" and not upward else 1.0
    return lambda points: (points - middle) * (scale[0], scale[1] * sign)


def _match(arrays: dict[str, np.ndarray], provider: str, notes: list[str]) -> Match:
    length, width, guessed, fps = arrays["pitch"].tolist()
    notes = [*notes, f"no pitch size in the feed, {length:g} x {width:g} m taken"] if guessed else notes
    return Match(
        times=frozen_array(arrays["times"]),
        players=tuple(MatchPlayer(*who, int(shirt)) for *who, shirt in arrays["players"].tolist()),
        positions=frozen_array(arrays["positions"]),
        ball=frozen_array(arrays["ball"]),
        length=length,
        width=width,
        fps=fps,
        provider=provider,
        periods=tuple(map(tuple, arrays["periods"].tolist())),
        notes=tuple(notes),
    )


def _cache_folder(folder: str | os.PathLike | None) -> Path:
    if folder is not None:
        return Path(folder)
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home) / "beyond_mocap" / "tracking"


def _key(path: Path, meta: Path, provider: str) -> str:
    """Names the arrays of these contents, whatever the files are called."""
    digest = hashlib.sha256(f"{_CACHE_VERSION} {provider}".encode())
    for file in (path, meta):
        with open(file, "rb") as stream:
            digest.update(hashlib.file_digest(stream, "sha256").digest())
    return digest.hexdigest()[:40]


def _cached(cache: Path) -> dict[str, np.ndarray] | None:
    """The kept arrays; None where there are none, or none that can be read whole."""
    try:
        with np.load(cache, allow_pickle=False) as kept:
            arrays = {name: kept[name] for name in ("times", "positions", "ball", "players", "pitch", "periods")}
    except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile):
        return None
    count = len(arrays["times"])
    fits = arrays["positions"].shape == (len(arrays["players"]), count, 2) and arrays["ball"].shape == (count, 3)
    return arrays if fits and arrays["pitch"].shape == (4,) else None


def _keep(cache: Path, arrays: dict[str, np.ndarray], notes: list[str]) -> None:
    """Writes the cache whole; a folder that cannot be written costs the next run its time, and is told."""
    content = io.BytesIO()
    np.savez(content, **arrays)
    try:
        cache.parent.mkdir(parents=True, exist_ok=True)
        atomic_write(cache, content.getvalue())
    except (OSError, InputError):
        notes.append(f"{cache.parent} cannot be written, so nothing is kept for the next time")
