"""Whose form an events file has, which file goes with it, and kloppy's reader for it."""

from __future__ import annotations

import importlib
import logging
import os
import re
import warnings
from pathlib import Path

from ..errors import InputError

EVENT_PROVIDERS = (
    "opta", "sportec", "statsbomb", "metrica", "wyscout", "datafactory", "statsperform", "impect", "csv",
)  # fmt: skip

_ALONE = {"wyscout", "datafactory", "csv"}  # whose files need no other
_FORMS = (
    ("csv", re.compile(rb"[^\r\n{<\[]{0,400}time_s")),
    ("metrica", re.compile(rb"Team,Type,Subtype,Period")),
    ("opta", re.compile(rb"(?s)\s*(<\?xml[^>]*>\s*)?(<!--.{0,400}?-->\s*)?<Games\b")),
    ("statsperform", re.compile(rb"(?s)\s*(<\?xml[^>]*>\s*)?<matchEvents\b")),
    ("sportec", re.compile(rb"(?s)\s*(<\?xml[^>]*>\s*)?<PutDataRequest\b.{0,2000}<Event\b")),
    ("wyscout", re.compile(rb'(?s)\s*\{.{0,4000}("eventSec"|"matchTimestamp")')),
    ("datafactory", re.compile(rb'(?s)\s*\{\s*"match"\s*:\s*\{.{0,600}"homeTeamId"')),
    ("statsperform", re.compile(rb'(?s)\s*\{\s*"matchInfo"')),
    ("metrica", re.compile(rb'(?s)\s*\{\s*"data"\s*:\s*\[.{0,600}"subtypes"')),
    ("statsbomb", re.compile(rb'(?s)\s*\[\s*\{.{0,600}"possession"')),
    ("impect", re.compile(rb'(?s)\s*\[\s*\{.{0,400}"gameTimeInSec"')),
)
_OTHER = {  # parts of a name -> what the same part is in the name of the other file
    "opta": (("f24", "f7"), ("F24", "F7"), ("f73", "f7")),
    "sportec": (("events", "meta"), ("events_raw", "matchinformation")),
    "statsbomb": (("events", "lineups"), ("event", "lineup")),
    "metrica": (("events", "metadata"), ("events.json", "metadata.xml")),
    "statsperform": (("ma3", "ma1"), ("MA3", "MA1")),
    "impect": (("events", "lineups"), ("event", "lineup")),
}
_SECOND = {  # what the other file begins with, where no name fits
    "opta": rb"(?s)\s*(<\?xml[^>]*>\s*)?<SoccerFeed\b",
    "sportec": rb"(?s)\s*(<\?xml[^>]*>\s*)?<PutDataRequest\b.{0,900}<MatchInf",
    "statsbomb": rb'(?s)\s*\[\s*\{.{0,300}"lineup"',
    "metrica": rb"(?s)\s*(<\?xml[^>]*>\s*)?<main\b.{0,900}<Metadata\b",
    "statsperform": rb'(?s)\s*(<\?xml[^>]*>\s*)?(<match\b|\{.{0,9000}"(lineUp|liveData)")',
    "impect": rb'(?s)\s*\{.{0,900}"squadHome"',
}  # fmt: skip
_HEAD = 8192  # bytes that tell a form


def guessed_event_provider(path: Path) -> str:
    """Whose form a file has; InputError where it is none that is known."""
    head = _head(path)
    for provider, form in _FORMS:
        if form.match(head):
            return provider
    found = "a form that is not known" if head.strip() else "an empty file"
    raise InputError(path, found, f"events of one of {', '.join(EVENT_PROVIDERS)}", "name the provider")


def _head(path: Path) -> bytes:
    """What a file begins with; nothing of a folder."""
    if not path.is_file():
        return b""
    with open(path, "rb") as file:
        return file.read(_HEAD).removeprefix(b"\xef\xbb\xbf")


def other_file(path: Path, provider: str, meta: str | os.PathLike | None) -> Path | None:
    """The lineups or metadata that an events file needs: `meta`, else the one beside it whose name, or else whose
    form fits; None where it needs none. InputError where there is none."""
    if provider in _ALONE or provider == "metrica" and path.suffix.lower() == ".csv":
        return None
    if meta is not None:
        if not Path(meta).is_file():
            raise InputError(meta, "no such file", "lineups or metadata of the events", "check the path")
        return Path(meta)
    names = [re.sub(re.escape(ours), theirs, path.name, flags=re.IGNORECASE) for ours, theirs in _OTHER[provider]]
    folders = [path.parent, path.parent.parent / "lineups"]
    names = [name for one in names for name in (one, str(Path(one).with_suffix(".xml")))] + [path.name]
    for beside in (folder / name for folder in folders for name in names):
        if beside.is_file() and beside != path:
            return beside
    form = re.compile(_SECOND[provider])
    fitting = [one for one in sorted(path.parent.glob("*.[xj]*")) if one != path and form.match(_head(one))]
    if len(fitting) == 1:
        return fitting[0]
    expected = f"one as {names[0]}" if names[0] != path.name else "the provider's lineups or metadata"
    raise InputError(path, f"no second file beside it for {provider}", expected, "put it there, or name it")


def load_events(path: Path, provider: str, meta: Path | None):
    """kloppy's dataset in the provider's own coordinates. InputError where kloppy is not installed or cannot read the
    files."""
    try:
        reader = importlib.import_module(f"kloppy.{provider}")
    except ImportError as error:
        raise InputError(
            path, f"kloppy cannot be imported ({error})", "kloppy 3.19 or newer", "pip install 'beyond-mocap[tracking]'"
        ) from None
    logging.getLogger("kloppy").addHandler(logging.NullHandler())  # what it would print is in our own lines
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return _read_with(reader, provider, str(path), str(meta))
    except Exception as error:  # kloppy raises whatever its parsers meet in a wrong file
        found = f"not readable as events of {provider} ({type(error).__name__}: {str(error)[:120]})"
        expected = f"{provider} events" + (f" and their {meta.name}" if meta else "")
        raise InputError(path, found, expected, "check the files, and the provider") from None


def _read_with(reader, provider: str, events: str, meta: str):
    """One provider's loader; their argument names differ."""
    if provider == "opta":
        return reader.load(f7_data=meta, f24_data=events)
    if provider in ("statsbomb", "impect"):
        return reader.load(event_data=events, lineup_data=meta)
    if provider in ("metrica", "sportec"):
        return reader.load_event(event_data=events, meta_data=meta)
    if provider == "statsperform":
        return reader.load_event(ma1_data=meta, ma3_data=events)
    return reader.load(event_data=events)
