"""Annotating by keys while the match plays: what each key does, without any window (Faustino §6.2).

`handle_key` takes the state, a key and the playhead, and returns the next state and the commands to run. A key moment
is at the time at which the first key of its labels was pressed, wherever the playhead is afterwards.

    state = AnnotationState()
    for key in ("2", "2", "3", "5", "ENTER"):       # kick right low top
        state, commands = handle_key(state, key, Playhead(9.7))
    commands                                        # (AddMoment(9.7, ("kick", "right", "low", "top")),)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from .decision import (
    LibraryCombinations,
    Option,
    TreeChoices,
    can_skip,
    choose_label,
    count_pages,
    list_options,
    skip_level,
)
from .vocabulary import swap_sides

DIGITS = tuple("123456789")

KEYS = {
    "1 to 9": "Choose a label; the first one opens the menu and stores the time",
    "0": "Skip a level of the tree",
    "NEXT_PAGE": "Show more labels",
    "PREVIOUS_PAGE": "Show the previous labels",
    "ENTER": "Add the chosen labels",
    "BACK": "Remove the last label",
    "ESC": "Close the menu; then clear the in point; then stop annotating",
    "IN": "Start a span here",
    "OUT": "End the span here and choose its labels",
    "MIRROR": "Exchange left and right of the chosen labels, or of the annotation at the playhead",
    "REMOVE": "Clear the chosen labels, or remove the annotation at the playhead",
    "EARLIER": "Move the moment at the playhead one frame earlier, or only the playhead",
    "LATER": "Move the moment at the playhead one frame later, or only the playhead",
    "PREVIOUS": "Go to the previous moment",
    "NEXT": "Go to the next moment",
    "PREVIOUS_PLAYER": "Select the player above in the list",
    "NEXT_PLAYER": "Select the player below in the list",
}
"""Every key by its name for `handle_key`, and what it does."""


@dataclass(frozen=True)
class AddMoment:
    """Add a key moment.

    Attributes:
        time: seconds on the track's clock.
        words: its labels.
    """

    time: float
    words: tuple[str, ...]


@dataclass(frozen=True)
class AddSpan:
    """Add a span.

    Attributes:
        start, end: seconds on the track's clock.
        words: its labels.
    """

    start: float
    end: float
    words: tuple[str, ...]


@dataclass(frozen=True)
class ChangeAtPlayhead:
    """Change the moment or span at the playhead.

    Attributes:
        what: "mirror", "remove", "earlier" or "later".
    """

    what: str


@dataclass(frozen=True)
class GoToNeighbour:
    """Go to a neighbour.

    Attributes:
        to: "moment" or "player".
        step: -1 or 1.
    """

    to: str
    step: int


@dataclass(frozen=True)
class StopAnnotating:
    """Stop annotating."""


@dataclass(frozen=True)
class ShowMessage:
    """Show a message to the user.

    Attributes:
        line: one line.
    """

    line: str


Command = AddMoment | AddSpan | ChangeAtPlayhead | GoToNeighbour | StopAnnotating | ShowMessage


@dataclass(frozen=True)
class Playhead:
    """The playhead.

    Attributes:
        time: seconds on the track's clock.
        frame_duration: seconds of one frame.
        previous_end: second at which the last moment or span before the playhead ends, None without one.
    """

    time: float
    frame_duration: float = 1.0 / 30.0
    previous_end: float | None = None


@dataclass(frozen=True)
class AnnotationState:
    """The state of annotating.

    Attributes:
        available: the library's label combinations, None without a library.
        trail: the choices so far, one per step, the last one displayed; empty while no menu is open.
        time: when the open menu was opened, seconds on the track's clock.
        start: the in point in seconds, None while none is set.
        end: the out point in seconds of the span whose labels are being chosen.
        page: page of the menu, from 0.
    """

    available: LibraryCombinations | None = None
    trail: tuple[TreeChoices, ...] = ()
    time: float = 0.0
    start: float | None = None
    end: float | None = None
    page: int = 0

    @property
    def walk(self) -> TreeChoices:
        """The choices whose options are on the keys; without an open menu, the start of a key moment."""
        return self.trail[-1] if self.trail else TreeChoices("moment")

    @property
    def page_options(self) -> tuple[Option, ...]:
        """The options of the displayed page."""
        return tuple(option for option in list_options(self.walk, self.available) if option.page == self.page)

    @property
    def page_count(self) -> int:
        """The number of pages of options."""
        return count_pages(self.walk, self.available)


def handle_key(state: AnnotationState, key: str, now: Playhead) -> tuple[AnnotationState, tuple[Command, ...]]:
    """Handle one key.

    Args:
        state: the state before.
        key: a key of `KEYS` or a digit.
        now: the playhead.
    Returns:
        The state after the key, and the commands to run.
    """
    if key in DIGITS:
        chosen = next((option for option in state.page_options if option.digit == int(key)), None)
        return (state, ()) if chosen is None else select_label(state, chosen.word, now)
    if key == "0":
        return (_push_choices(state, skip_level(state.walk), now), ()) if can_skip(state.walk) else (state, ())
    if key in ("NEXT_PAGE", "PREVIOUS_PAGE"):
        return _turn_page(state, 1 if key == "NEXT_PAGE" else -1, now), ()
    if state.trail:
        return _handle_menu_key(state, key, now)
    return _handle_timeline_key(state, key, now)


def select_label(state: AnnotationState, label: str, now: Playhead) -> tuple[AnnotationState, tuple[Command, ...]]:
    """Choose a label, by its digit or by the mouse.

    Args:
        state: the state before.
        label: the label.
        now: the playhead.
    Returns:
        The state after the choice, and no commands.
    """
    return _push_choices(state, choose_label(state.walk, label), now), ()


def _handle_menu_key(state: AnnotationState, key: str, now: Playhead) -> tuple[AnnotationState, tuple[Command, ...]]:
    """Handle a key while the menu is open; other keys add the chosen labels first."""
    if key == "ENTER":
        return _accept_labels(state)
    if key == "BACK":
        return (replace(state, trail=state.trail[:-1], page=0) if len(state.trail) > 1 else _close_menu(state)), ()
    if key in ("ESC", "REMOVE"):
        return _close_menu(state), ()
    if key == "MIRROR":
        return replace(state, trail=(*state.trail, _mirror_choices(state.walk))), ()
    if key in ("EARLIER", "LATER"):
        return replace(state, time=state.time + (now.frame_duration if key == "LATER" else -now.frame_duration)), ()
    state, commands = _accept_labels(state)
    state, more_commands = _handle_timeline_key(state, key, now)
    return state, (*commands, *more_commands)


def _handle_timeline_key(state: AnnotationState, key: str, now: Playhead) -> tuple[AnnotationState,
                                                                                   tuple[Command, ...]]:
    """Handle a key while no menu is open."""
    if key == "ESC":
        return (state, (StopAnnotating(),)) if state.start is None else (replace(state, start=None), ())
    if key == "IN":
        return replace(state, start=now.time), ()
    if key == "OUT":
        return _end_span(state, now)
    if key in ("PREVIOUS", "NEXT"):
        return state, (GoToNeighbour("moment", 1 if key == "NEXT" else -1),)
    if key in ("PREVIOUS_PLAYER", "NEXT_PLAYER"):
        return replace(state, start=None), (GoToNeighbour("player", 1 if key == "NEXT_PLAYER" else -1),)
    if key in ("MIRROR", "REMOVE", "EARLIER", "LATER"):
        return state, (ChangeAtPlayhead(key.lower()),)
    return state, ()


def _end_span(state: AnnotationState, now: Playhead) -> tuple[AnnotationState, tuple[Command, ...]]:
    """End a span and open the menu for its labels.

    Without an in point the span starts where the last annotation before it ends.
    """
    start = now.previous_end if state.start is None else state.start
    if start is None or abs(start - now.time) < 0.5 * now.frame_duration:
        return state, (ShowMessage("Set an in point (I) before the out point (O)"),)
    start, end = sorted((start, now.time))
    return replace(state, trail=(TreeChoices("span"),), time=start, start=start, end=end, page=0), ()


def _accept_labels(state: AnnotationState) -> tuple[AnnotationState, tuple[Command, ...]]:
    """Add the moment or span with the chosen labels; without labels only close the menu."""
    walk = state.walk
    if not walk.words:
        return _close_menu(state), ()
    command = AddMoment(state.time, walk.words) if walk.kind == "moment" else AddSpan(state.time, state.end, walk.words)
    start = state.start if walk.kind == "moment" else None
    return replace(_close_menu(state), start=start), (command,)


def _close_menu(state: AnnotationState) -> AnnotationState:
    return replace(state, trail=(), end=None, page=0)


def _push_choices(state: AnnotationState, walk: TreeChoices, now: Playhead) -> AnnotationState:
    opened = _open_menu(state, now)
    return replace(opened, trail=(*opened.trail, walk), page=0)


def _turn_page(state: AnnotationState, step: int, now: Playhead) -> AnnotationState:
    page = (state.page + step) % state.page_count
    return state if page == state.page else replace(_open_menu(state, now), page=page)


def _open_menu(state: AnnotationState, now: Playhead) -> AnnotationState:
    """Open the menu at the playhead unless it is open."""
    return state if state.trail else replace(state, trail=(state.walk,), time=now.time)


def _mirror_choices(walk: TreeChoices) -> TreeChoices:
    steps = tuple(step and swap_sides((step,))[0] for step in walk.steps)
    return replace(walk, steps=steps, modifiers=swap_sides(walk.modifiers))
