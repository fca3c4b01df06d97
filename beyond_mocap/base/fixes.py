"""Ways out of an error that an interface can offer as a button: what to do and with what, without any wording.

The core knows which step would help; what its button says and does is the interface's own.
"""

from __future__ import annotations

from dataclasses import dataclass

KINDS = frozenset({
    "use_nearest",  # continue with the nearest labels that the library has
    "show_clips",  # value: a label that clips of the library have
    "show_label",  # value: seconds on the track's clock
    "choose_library",  # choose the library's folder
    "relink_library",  # find or choose the library's folder, which is not where it was
    "choose_labels",  # choose a file with a player's labels
    "use_labels",  # value: a file that may have a player's labels
    "add_track",  # import tracking
    "use_all_players",  # select every player of the list
    "use_unit",  # value: metres per unit of the file, 0 to take the file's own
    "press",  # value: name of the operator to press first
})


@dataclass(frozen=True)
class Fix:
    """A step that repairs what an error describes.

    Attributes:
        kind: one of KINDS.
        value: what the step needs, as text; "" for nothing.
    """

    kind: str
    value: str = ""

    def __post_init__(self):
        if self.kind not in KINDS:
            raise ValueError(f"no fix {self.kind!r}; one of {', '.join(sorted(KINDS))}")
