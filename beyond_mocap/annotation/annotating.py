"""Annotating by keys while the match plays: what each key does, without any window (Faustino §6.2).

`press` takes the state, a key and the playhead, and returns the next state with what is to be done. A key moment is at
the time at which the first key of its words was pressed, wherever the playhead has gone meanwhile.

    state = State()
    for key in ("2", "2", "3", "5", "ENTER"):       # kick right low top
        state, commands = press(state, key, Now(9.7))
    commands                                        # (AddMoment(9.7, ("kick", "right", "low", "top")),)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from .decision import Held, Option, Walk, can_skip, choose, options, pages, skip
from .vocabulary import swap_sides

DIGITS = tuple("123456789")

KEYS = {
    "1 to 9": "Choose the word; the first one opens the menu and holds the time",
    "0": "Skip a level of the tree",
    "NEXT_PAGE": "More words",
    "PREVIOUS_PAGE": "Back to the words before",
    "ENTER": "Done: these words",
    "BACK": "Take the last word back",
    "ESC": "Close the menu; then give up the in point; then leave",
    "IN": "A stretch begins here",
    "OUT": "The stretch ends here; its words follow",
    "MIRROR": "Exchange left and right: of the words chosen so far, else of what is at the playhead",
    "REMOVE": "Give up the words chosen so far, else remove what is at the playhead",
    "EARLIER": "A frame earlier: the moment at the playhead with it, else the playhead alone",
    "LATER": "A frame later, likewise",
    "PREVIOUS": "To the moment before",
    "NEXT": "To the moment after",
    "PREVIOUS_PLAYER": "The player above in the list",
    "NEXT_PLAYER": "The player below in the list",
}
"""Every key by the name that `press` knows, and what it does."""


@dataclass(frozen=True)
class AddMoment:
    """A key moment at `time` seconds."""

    time: float
    words: tuple[str, ...]


@dataclass(frozen=True)
class AddSpan:
    """A stretch from `start` to `end` seconds."""

    start: float
    end: float
    words: tuple[str, ...]


@dataclass(frozen=True)
class AtPlayhead:
    """Something for the moment or stretch at the playhead: "mirror", "remove", "earlier" or "later"."""

    what: str


@dataclass(frozen=True)
class Go:
    """To the neighbouring "moment" or "player": `step` -1 or 1."""

    to: str
    step: int


@dataclass(frozen=True)
class Leave:
    """Annotating is over."""


@dataclass(frozen=True)
class Tell:
    """One line for the user."""

    line: str


Command = AddMoment | AddSpan | AtPlayhead | Go | Leave | Tell


@dataclass(frozen=True)
class Now:
    """The playhead. time: seconds on the track's clock. frame: seconds that one frame lasts. before: second at which
    the last moment or stretch before the playhead ends, None where there is none."""

    time: float
    frame: float = 1.0 / 30.0
    before: float | None = None


@dataclass(frozen=True)
class State:
    """Where the user is. held: what the library has, None without one. trail: the walks down the tree so far, the last
    one shown; empty while no menu is open. time: when the open walk began. start: the in point, None while none is
    set. end: the out point of the stretch whose words are being chosen. page: of the menu, from 0."""

    held: Held | None = None
    trail: tuple[Walk, ...] = ()
    time: float = 0.0
    start: float | None = None
    end: float | None = None
    page: int = 0

    @property
    def walk(self) -> Walk:
        """The walk whose options are on the keys; while no menu is open, the beginning of a key moment's."""
        return self.trail[-1] if self.trail else Walk("moment")

    @property
    def shown(self) -> tuple[Option, ...]:
        """The options of the page that is shown."""
        return tuple(option for option in options(self.walk, self.held) if option.page == self.page)

    @property
    def pages(self) -> int:
        """Of the walk's options."""
        return pages(self.walk, self.held)


def press(state: State, key: str, now: Now) -> tuple[State, tuple[Command, ...]]:
    """The state after a key (of KEYS, or a digit) at the playhead `now`, and what is to be done."""
    if key in DIGITS:
        found = next((option for option in state.shown if option.digit == int(key)), None)
        return (state, ()) if found is None else pick(state, found.word, now)
    if key == "0":
        return (_walked(state, skip(state.walk), now), ()) if can_skip(state.walk) else (state, ())
    if key in ("NEXT_PAGE", "PREVIOUS_PAGE"):
        return _turned(state, 1 if key == "NEXT_PAGE" else -1, now), ()
    if state.trail:
        return _in_the_menu(state, key, now)
    return _outside(state, key, now)


def pick(state: State, word: str, now: Now) -> tuple[State, tuple[Command, ...]]:
    """The state after a word was chosen, by its digit or by the mouse."""
    return _walked(state, choose(state.walk, word), now), ()


def _in_the_menu(state: State, key: str, now: Now) -> tuple[State, tuple[Command, ...]]:
    if key == "ENTER":
        return _accepted(state)
    if key == "BACK":
        return (replace(state, trail=state.trail[:-1], page=0) if len(state.trail) > 1 else _closed(state)), ()
    if key in ("ESC", "REMOVE"):
        return _closed(state), ()
    if key == "MIRROR":
        return replace(state, trail=(*state.trail, _mirrored(state.walk))), ()
    if key in ("EARLIER", "LATER"):
        return replace(state, time=state.time + (now.frame if key == "LATER" else -now.frame)), ()
    state, done = _accepted(state)
    state, more = _outside(state, key, now)
    return state, (*done, *more)


def _outside(state: State, key: str, now: Now) -> tuple[State, tuple[Command, ...]]:
    if key == "ESC":
        return (state, (Leave(),)) if state.start is None else (replace(state, start=None), ())
    if key == "IN":
        return replace(state, start=now.time), ()
    if key == "OUT":
        return _out(state, now)
    if key in ("PREVIOUS", "NEXT"):
        return state, (Go("moment", 1 if key == "NEXT" else -1),)
    if key in ("PREVIOUS_PLAYER", "NEXT_PLAYER"):
        return replace(state, start=None), (Go("player", 1 if key == "NEXT_PLAYER" else -1),)
    if key in ("MIRROR", "REMOVE", "EARLIER", "LATER"):
        return state, (AtPlayhead(key.lower()),)
    return state, ()


def _out(state: State, now: Now) -> tuple[State, tuple[Command, ...]]:
    """The words of the stretch that ends here; without an in point it begins where the last thing before it ends."""
    start = now.before if state.start is None else state.start
    if start is None or abs(start - now.time) < 0.5 * now.frame:
        return state, (Tell("a stretch needs an in point (I) before its out point (O)"),)
    start, end = sorted((start, now.time))
    return replace(state, trail=(Walk("span"),), time=start, start=start, end=end, page=0), ()


def _accepted(state: State) -> tuple[State, tuple[Command, ...]]:
    """What was chosen, done; nothing where no word was."""
    walk = state.walk
    if not walk.words:
        return _closed(state), ()
    done = AddMoment(state.time, walk.words) if walk.kind == "moment" else AddSpan(state.time, state.end, walk.words)
    start = state.start if walk.kind == "moment" else None
    return replace(_closed(state), start=start), (done,)


def _closed(state: State) -> State:
    return replace(state, trail=(), end=None, page=0)


def _walked(state: State, walk: Walk, now: Now) -> State:
    opened = _opened(state, now)
    return replace(opened, trail=(*opened.trail, walk), page=0)


def _turned(state: State, step: int, now: Now) -> State:
    page = (state.page + step) % state.pages
    return state if page == state.page else replace(_opened(state, now), page=page)


def _opened(state: State, now: Now) -> State:
    """The state with a menu, opened at the playhead where none is."""
    return state if state.trail else replace(state, trail=(state.walk,), time=now.time)


def _mirrored(walk: Walk) -> Walk:
    steps = tuple(step and swap_sides((step,))[0] for step in walk.steps)
    return replace(walk, steps=steps, beside=swap_sides(walk.beside))
