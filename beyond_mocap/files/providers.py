"""Whose form a tracking file has, which files belong to it, and kloppy's reader for it."""

from __future__ import annotations

import importlib
import logging
import os
import re
import warnings
from dataclasses import dataclass
from pathlib import Path

from ..errors import InputError

PROVIDERS = (
    "tracab", "metrica", "skillcorner", "sportec", "secondspectrum", "statsperform", "pff", "signality", "hawkeye",
)  # fmt: skip

_META_NAMES = ("{}_meta.xml", "{}_meta.json", "{}_metadata.xml", "{}_metadata.json", "{}.xml", "{}.json")
_TEAMS = (("Home", "Away"), ("home", "away"), ("Away", "Home"), ("away", "home"))
_BY_LINES = {".dat", ".csv", ".txt", ".jsonl"}  # endings of files that are read line by line

_FORMS = (
    ("tracab", re.compile(rb"\s*\d+:-?\d+,-?\d+,-?\d+,-?\d+,-?\d+,")),
    ("tracab", re.compile(rb'\s*\{[^{]{0,200}"FrameData"')),
    ("metrica", re.compile(rb"\s*,,,(Home|Away|[^,\r\n]*),", re.IGNORECASE)),
    ("metrica", re.compile(rb"\s*\d+:(-?\d*\.\d+|NaN),(-?\d*\.\d+|NaN)", re.IGNORECASE)),
    ("statsperform", re.compile(rb"\s*\d{10,};\d")),
    ("signality", re.compile(rb'(?s)\s*\[\s*\{.{0,400}"utc_time"')),
    ("hawkeye", re.compile(rb'(?s)\s*\{\s*"details"\s*:.{0,4000}"heId"')),
    ("pff", re.compile(rb'(?s)\s*\{.{0,400}"gameRefId"')),
    ("secondspectrum", re.compile(rb'(?s)\s*\{.{0,4000}"homePlayers"')),
    ("skillcorner", re.compile(rb'(?s)\s*[\[{].{0,4000}("trackable_object"|"image_corners_projection"|"player_data")')),
    ("sportec", re.compile(rb"(?s)\s*<.{0,4000}<Positions\b")),
)


@dataclass(frozen=True)
class Feed:
    """The files of one match. tracking: in the order of time; for Metrica's CSV the home and the away team's. meta:
    the metadata first, None where the provider needs none, then what else belongs to it."""

    provider: str
    tracking: tuple[Path, ...]
    meta: tuple[Path, ...] = ()

    @property
    def path(self) -> Path:
        """The first tracking file."""
        return self.tracking[0]

    @property
    def by_lines(self) -> bool:
        """Whether a tracking file that ends too early still has whole lines."""
        return self.path.suffix.lower() in _BY_LINES


def feed_of(path: str | os.PathLike, meta: str | os.PathLike | None, provider: str | None) -> tuple[Feed, list[str]]:
    """The files that belong together, and what was guessed of them; arguments and errors as for `read_match`."""
    path = _existing(path)
    provider, notes = (provider.lower(), []) if provider else _guessed_provider(path)
    if provider not in PROVIDERS:
        raise InputError("provider", f"{provider!r}", f"one of {', '.join(PROVIDERS)}")
    if provider == "hawkeye":
        return _hawkeye_feed(path, meta, notes), notes
    meta = _existing(meta) if meta else _meta_beside(path, provider, notes)
    tracking, more = (path,), ()
    if provider == "metrica" and path.suffix.lower() == ".csv":
        tracking, meta = ((meta, path) if "away" in path.name.lower() else (path, meta)), None
    elif provider == "signality":
        tracking, more = _phases(path, notes), (_beside(meta, "venue", path, notes),)
    elif provider == "pff":
        more = (_beside(meta, "roster", path, notes),)
    elif provider == "secondspectrum" and meta.suffix.lower() == ".xml":
        names = meta.with_suffix(".json")
        more = (names,) if names.is_file() else ()
        notes += [f"{names.name} taken for the names of the players"] * bool(more)
    return Feed(provider, tracking, (*((meta,) if meta else ()), *more)), notes


def _existing(path: str | os.PathLike) -> Path:
    if not Path(path).is_file():
        found = "is a folder" if Path(path).is_dir() else "no such file"
        raise InputError(path, found, "a tracking file", "check the path")
    return Path(path)


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


def _beside(meta: Path, word: str, path: Path, notes: list[str]) -> Path:
    """The one other file that a provider needs, with `word` in its own or its folder's name; of several the one that
    shares the numbers in the metadata's or the tracking file's name."""
    folders = {meta.parent, path.parent, *(one for one in meta.parent.parent.glob("*") if word in one.name.lower())}
    found = sorted(
        one for folder in folders if folder.is_dir() for one in folder.glob("*.json")
        if word in f"{folder.name}/{one.name}".lower() and one != meta
    )  # fmt: skip
    numbers = set(re.findall(r"\d+", f"{meta.stem} {path.stem}"))
    fitting = [one for one in found if numbers & set(re.findall(r"\d+", one.stem))]
    chosen = fitting if len(fitting) == 1 else found
    if len(chosen) != 1:
        raise InputError(
            meta, f"{len(chosen)} files with '{word}' in their names beside it", "one that belongs to this match",
            "put it there, and others away",
        )
    notes.append(f"{chosen[0].name} taken as its {word} file")
    return chosen[0]


def _phases(path: Path, notes: list[str]) -> tuple[Path, ...]:
    """The files of all halves, where this one's name has p1 or p2 in it."""
    names = [re.sub(r"(?i)(?<![a-z0-9])(p)[1-5](?![0-9])", rf"\g<1>{number}", path.name) for number in range(1, 6)]
    found = tuple(dict.fromkeys(path.with_name(name) for name in names if path.with_name(name).is_file()))
    notes += [f"{', '.join(one.name for one in found)} taken as one match"] * (len(found) > 1)
    return found or (path,)


def _hawkeye_feed(path: Path, meta: str | os.PathLike | None, notes: list[str]) -> Feed:
    """All files of a folder, one a minute: the players', then as many of the ball."""
    def minute(file: Path) -> list[int]:
        return [int(number) for number in re.findall(r"\d+", file.name)]

    players = sorted(path.parent.glob("*.samples.centroids"), key=minute)
    balls = sorted(path.parent.glob("*.samples.ball"), key=minute)
    if not players or [minute(file) for file in players] != [minute(file) for file in balls]:
        found = f"{len(players)} files of players and {len(balls)} of the ball"
        raise InputError(path.parent, found, "one .samples.ball for every .samples.centroids", "complete the folder")
    notes.append(f"{len(players)} files of players and of the ball in {path.parent.name or path.parent} taken")
    return Feed("hawkeye", (*players, *balls), (_existing(meta),) if meta else ())


def load(feed: Feed, pitch: tuple[float, float]):
    """kloppy's dataset in the provider's own coordinates; `pitch` in metres for a feed that must be told. InputError
    where kloppy is not installed or cannot read the files."""
    try:
        reader = importlib.import_module(f"kloppy.{feed.provider}")
    except ImportError as error:
        raise InputError(
            feed.path, f"kloppy cannot be imported ({error})", "kloppy 3.19 or newer",
            "pip install 'beyond-mocap[tracking]'",
        ) from None
    logging.getLogger("kloppy").addHandler(logging.NullHandler())  # what it would print is in our own lines
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return _read_with(reader, feed, pitch)
    except Exception as error:  # kloppy raises whatever its parsers meet in a wrong file
        found = f"not readable as {feed.provider} ({type(error).__name__}: {str(error)[:120]})"
        names = ", ".join(one.name for one in feed.meta) or feed.tracking[-1].name
        expected = f"a {feed.provider} file and its metadata {names}"
        raise InputError(feed.path, found, expected, "check both, and the provider") from None


def _read_with(reader, feed: Feed, pitch: tuple[float, float]):
    """One provider's loader; their argument names differ. Metrica has CSV (a file per team) and EPTS (text with
    XML)."""
    raw, provider = str(feed.path), feed.provider
    meta, *more = [*map(str, feed.meta), None]
    if provider == "metrica" and meta is None:
        home, away = map(str, feed.tracking)
        return reader.load_tracking_csv(home_data=home, away_data=away, coordinates="metrica")
    if provider == "metrica":
        return reader.load_tracking_epts(meta_data=meta, raw_data=raw, coordinates="metrica")
    if provider == "statsperform":
        return reader.load_tracking(
            ma1_data=meta, ma25_data=raw, pitch_length=pitch[0], pitch_width=pitch[1], coordinates="sportvu"
        )
    if provider == "pff":
        return reader.load_tracking(meta_data=meta, roster_meta_data=more[0], raw_data=raw, coordinates="pff")
    if provider == "signality":
        feeds = list(map(str, feed.tracking))
        return reader.load(meta_data=meta, raw_data_feeds=feeds, venue_information=more[0], coordinates="signality")
    if provider == "hawkeye":
        half = len(feed.tracking) // 2
        players, balls = list(map(str, feed.tracking[:half])), list(map(str, feed.tracking[half:]))
        return reader.load(
            ball_feeds=balls, player_centroid_feeds=players, meta_data=meta, pitch_length=pitch[0],
            pitch_width=pitch[1], coordinates="hawkeye",
        )
    if provider == "secondspectrum":
        return reader.load(meta_data=meta, raw_data=raw, additional_meta_data=more[0], coordinates=provider)
    read = reader.load_tracking if provider == "sportec" else reader.load
    return read(meta_data=meta, raw_data=raw, coordinates=provider)
