"""Marker sets as short texts (docs/reference/marker-files.md), including the shipped ones."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

from ...base.content import read_utf8
from ...base.errors import InputError
from ..model.marker_set import MarkerSet
from ..model.template import JOINTS, LANDMARKS

SHIPPED = Path(__file__).resolve().parents[2] / "markers" / "sets"
MAX_BYTES = 1_000_000  # bytes; a larger file is not a marker set
_FORM = "see docs/reference/marker-files.md"
_LISTS = ("static", "optional", "ball", "other")
_KEYWORDS = "marker set, about, segment JOINT, landmark NAME, also LABEL, static, optional, ball, other"


def read_shipped_sets() -> tuple[MarkerSet, ...]:
    """Read the marker sets that come with Beyond Mocap, sorted by name."""
    return tuple(sorted((read_marker_set(path) for path in SHIPPED.glob("*.txt")), key=lambda one: one.name))


def choose_set(name: str) -> MarkerSet:
    """Choose a marker set by name or path.

    Args:
        name: the name of a shipped set, else the path of a file.
    Returns:
        The set.
    Raises:
        InputError: if there is neither.
    """
    shipped = {one.name: one for one in read_shipped_sets()}
    if name.strip().lower() in shipped:
        return shipped[name.strip().lower()]
    if not os.path.exists(name):  # an empty name is no file, but a `Path` of it is the current folder
        found = f"no marker set {name[:60]!r}"
        raise InputError("marker set", found, f"one of {', '.join(shipped)}, or a file", "check the name")
    return read_marker_set(name)


def read_marker_set(path: str | os.PathLike) -> MarkerSet:
    """Read the marker set in a file.

    Raises:
        InputError: if anything is wrong, with the line.
    """
    return parse_marker_set(read_utf8(path, "a marker set", MAX_BYTES), str(path))


def parse_marker_set(text: str, name: str = "marker set") -> MarkerSet:
    """Parse a marker set.

    Args:
        text: the text.
        name: of the file, for messages.
    Returns:
        The set.
    Raises:
        InputError: if anything is wrong, with name and line.
    """
    parser = _MarkerSetParser()
    for number, line in enumerate(re.split(r"\r\n|\n|\r", text), 1):
        line = re.sub(r"(^|\s)#.*", "", line).strip()
        if line:
            parser.parse_line(line, f"{name}:{number}")
    if not parser.name:
        raise InputError(name, "no line `marker set: NAME`", "the name of the set", _FORM)
    if not parser.segments:
        raise InputError(name, "no segment", "a line such as `segment Hips: LASI, RASI, SACR`", _FORM)
    lists: dict[str, Any] = {key: tuple(labels) for key, labels in parser.lists.items()}
    try:
        return MarkerSet(parser.name, parser.segments, parser.landmarks, parser.aliases, about=parser.about, **lists)
    except InputError as error:
        raise InputError(name, str(error)) from None


class _MarkerSetParser:
    """The part of a marker set that has been parsed. Lines on one segment or landmark add up."""

    def __init__(self):
        self.name = self.about = ""
        self.segments: dict[str, tuple[str, ...]] = {}
        self.landmarks: dict[str, tuple[str, ...]] = {}
        self.aliases: dict[str, str] = {}
        self.lists: dict[str, tuple[str, ...]] = {}

    def parse_line(self, line: str, place: str) -> None:
        """Parse one line."""
        head, colon, value = (part.strip() for part in line.partition(":"))
        if not colon:
            raise InputError(place, f"{line[:40]!r}", "`what: labels`", _FORM)
        word, _, rest = head.partition(" ")
        whole, word, rest = " ".join(head.lower().split()), word.lower(), rest.strip()
        add = {"segment": self._add_segment, "landmark": self._add_landmark, "also": self._add_aliases}
        if whole == "marker set":
            self._set_name(value, place)
        elif whole == "about":
            self.about = value
        elif whole in _LISTS:
            self.lists[whole] = (*self.lists.get(whole, ()), *_parse_labels(value, place))
        elif word in add and rest:
            add[word](rest, _parse_labels(value, place), place)
        else:
            raise InputError(place, f"{head[:40]!r}", f"one of {_KEYWORDS}", _FORM)

    def _set_name(self, value: str, place: str) -> None:
        if self.name:
            raise InputError(place, "a second `marker set`", "one set per file", "move it to a second file")
        if not re.fullmatch(r"[\w\-.]{1,60}", value):
            raise InputError(place, f"name {value[:40]!r}", "one word of letters, digits, `_`, `-` and `.`", _FORM)
        self.name = value

    def _add_segment(self, joint: str, labels: tuple[str, ...], place: str) -> None:
        if joint not in JOINTS:
            raise InputError(place, f"no segment {joint[:40]!r}", f"one of {', '.join(JOINTS)}", "check the spelling")
        self.segments[joint] = (*self.segments.get(joint, ()), *labels)

    def _add_landmark(self, name: str, labels: tuple[str, ...], place: str) -> None:
        if name not in LANDMARKS:
            expected = f"one of {', '.join(sorted(LANDMARKS))}"
            raise InputError(place, f"no landmark {name[:40]!r}", expected, "check the spelling")
        self.landmarks[name] = (*self.landmarks.get(name, ()), *labels)

    def _add_aliases(self, own: str, others: tuple[str, ...], place: str) -> None:
        for other in others:
            if self.aliases.setdefault(other, own) != own:
                found = f"{other[:40]!r} for {self.aliases[other]!r} and {own!r}"
                raise InputError(place, found, "one marker for each other label", "remove one")


def _parse_labels(text: str, place: str) -> tuple[str, ...]:
    """Parse labels separated by commas; raise InputError for an empty label or one with a colon."""
    labels = tuple(" ".join(label.split()) for label in text.split(","))
    if not all(labels):
        raise InputError(place, "an empty label" if text else "no labels", "labels, separated by commas", _FORM)
    if wrong := next((label for label in labels if ":" in label), None):
        raise InputError(place, f"label {wrong[:40]!r}", "labels without a colon", "leave out the subject")
    return labels


def format_marker_set(marker_set: MarkerSet) -> str:
    """Format a marker set as `read_marker_set` reads it.

    Raises:
        InputError: if a label contains a comma, a colon or ` #`.
    """
    lines = [f"marker set: {marker_set.name}"]
    lines += [f"about: {' '.join(marker_set.about.split())}"] if marker_set.about else []
    lines += ["", *(f"segment {joint}: {_format_labels(labels)}" for joint, labels in marker_set.segments.items()
                    if labels)]
    lines += ["", *(f"landmark {name}: {_format_labels(labels)}" for name, labels in marker_set.landmarks.items()
                    if labels)]
    lists = {key: getattr(marker_set, key) for key in _LISTS}
    lines += ["", *(f"{key}: {_format_labels(_sort_labels(labels))}" for key, labels in lists.items() if labels)]
    others: dict[str, list[str]] = {}
    for other, own in marker_set.aliases.items():
        others.setdefault(own, []).append(other)
    lines += [f"also {_format_label(own)}: {_format_labels(labels)}" for own, labels in others.items()]
    return "\n".join(lines) + "\n"


def _sort_labels(labels) -> list[str]:
    """Sort sets, which have no order; keep the order of tuples."""
    return sorted(labels) if isinstance(labels, frozenset) else list(labels)


def _format_labels(labels) -> str:
    return ", ".join(_format_label(label) for label in labels)


def _format_label(label: str) -> str:
    """Return the label; raise InputError where the text form cannot contain it."""
    if label != " ".join(label.split()) or not label or re.search(r"[,:]|(^|\s)#", label):
        raise InputError("marker set", f"label {label[:40]!r}", "a label without comma, colon and ` #`", "rename it")
    return label
