"""Labels of markers as files have them: whose they are, what is no marker, and what comes twice."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from ...base.errors import InputError

FEWEST_OF_A_BODY = 10
"""Markers below which a subject of a file is taken for an object."""

_COMPUTED = re.compile(
    r"(Angles?V?|Force|Moment|Power|GRF|CentreOfMass(Floor)?|CenterOfMass(Floor)?|^CoM(Floor)?|GroundReaction\w*"
    r"|NormalisedGRF)$", re.I)  # fmt: skip
_FRAME_OF = re.compile(r"(.+)([OALP])")


def split(label: str, prefixes: Iterable[str] = ()) -> tuple[str, str]:
    """(subject, label) of a label as files write it: "Derrick:C7", or by the prefixes that the file names."""
    for prefix in sorted((one for one in prefixes if one.strip()), key=len, reverse=True):
        if label.startswith(prefix) and len(label) > len(prefix):
            return prefix.strip().rstrip(":_").strip(), label[len(prefix) :].strip()
    subject, colon, rest = label.rpartition(":")
    return (subject.strip(), rest.strip()) if colon and rest.strip() else ("", label.strip())


def computed(labels: Sequence[str], listed: Iterable[str] = ()) -> set[str]:
    """Which of these are no markers: `listed` by the file as angles, forces and the like, named as such, or the four
    points (O, A, L, P) of a segment's frame that Plug-in Gait works out."""
    stems: dict[str, set[str]] = {}
    for label in labels:
        if frame := _FRAME_OF.fullmatch(label):
            stems.setdefault(frame[1], set()).add(frame[2])
    frames = {stem + letter for stem, letters in stems.items() if letters == set("OALP") for letter in letters}
    there = set(labels)
    return {label for label in labels if _COMPUTED.search(label)} | (frames & there) | (set(listed) & there)


def chosen_subject(path, counts: dict[str, int], wanted: str | None) -> str:
    """Whose markers are meant. counts: {subject: its markers}; wanted: by the user, None for the only body.

    InputError, which lists them, where there are several bodies or not the one wanted.
    """
    named = ", ".join(f"{name!r} ({count} markers)" for name, count in counts.items() if name)
    if wanted is not None and wanted.strip():
        if not named:
            found = f"no subject {wanted.strip()[:60]!r}"
            raise InputError(path, found, "no choice, since its labels name nobody", "leave out --subject")
        for name in counts:
            if name.lower() == wanted.strip().lower():
                return name
        raise InputError(path, f"no subject {wanted.strip()[:60]!r}", f"one of {named}", "choose one with --subject")
    bodies = [name for name, count in counts.items() if count >= FEWEST_OF_A_BODY]
    named_bodies = [name for name in bodies if name]
    bodies = named_bodies or bodies
    if len(bodies) > 1:
        raise InputError(path, f"{len(bodies)} subjects: {named}", "one", "choose one with --subject")
    return bodies[0] if bodies else max(counts, key=counts.__getitem__)


def unique(labels: Sequence[str]) -> tuple[list[str], list[str]]:
    """The labels without repetition, and those that came twice: the second "LASI" is called "LASI (2)". A marker
    without a label becomes "*1", "*2" ..., as trackers call the unlabeled."""
    out: list[str] = []
    taken, twice, unnamed = {label for label in labels if label}, [], 0
    met: set[str] = set()
    for label in labels:
        while not label or label in met:
            if label:
                twice.append(label)
                label = _numbered(label, taken | met)
            else:
                unnamed += 1
                label = f"*{unnamed}" if f"*{unnamed}" not in taken else ""
        met.add(label)
        out.append(label)
    return out, list(dict.fromkeys(twice))


def _numbered(label: str, taken: set[str]) -> str:
    number = 2
    while f"{label} ({number})" in taken:
        number += 1
    return f"{label} ({number})"
