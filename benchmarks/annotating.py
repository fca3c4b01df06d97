"""What annotating by keys costs: the five scenarios pressed through the state machine, beside Faustino's Table 3.

    python -m benchmarks.annotating

The model of the user, every part of it a plain assumption:

- He watches the track once at real time, and annotates while it runs a second time at real time.
- He pauses (Space) REACTION seconds behind each thing that he sees, steps back to it by single frames (comma), and goes
  on (Space). Every step back counts as a press, though a held key would repeat.
- A press takes STROKE seconds: 200 strokes a minute, which is 40 words of five letters.
- Before each annotation he thinks for THOUGHT seconds (the M of the keystroke-level model; Card, Moran and Newell
  1983).
- He knows the digits of the tree; who does not, reads the menu, and needs longer.

Nobody was timed. Typing the same text file is counted by the same model: its characters are typed in a text editor
after the same pausing and stepping, with THOUGHT for each line and another for reading its second off the screen.
"""

from __future__ import annotations

import sys
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from beyond_mocap.annotation import KeyMoment, Span, Timeline  # noqa: E402
from beyond_mocap.annotation.annotating import AddMoment, AddSpan, AtPlayhead, Now, State, press  # noqa: E402
from beyond_mocap.annotation.decision import Walk  # noqa: E402

from benchmarks.places import scenario, scenario_files  # noqa: E402

FPS = 25.0
STROKE = 60.0 / 200.0
THOUGHT = 1.35
REACTION = 0.25
FAUSTINO = {1: 137, 2: 258, 3: 136, 4: 138, 5: 144}
"""Seconds a player, typed by hand into a text file (Faustino, Table 3, "Beyond Mocap without annotation tool")."""
OLD_WAY = {1: 437, 2: 436, 3: 377, 4: 460, 5: 230}
"""Seconds with the animation tool of then (his "Current Solution")."""


@dataclass
class Session:
    """A user at the keys. playhead: frame, from 0 at the track's first second. words: what is annotated so far."""

    first: float
    playhead: int = 0
    presses: int = 0
    state: State = field(default_factory=State)
    words: Timeline = field(default_factory=Timeline)

    def seconds(self) -> float:
        """The playhead on the track's clock."""
        return self.first + self.playhead / FPS

    def frame(self, seconds: float) -> int:
        """The whole frame nearest to a second."""
        return round((seconds - self.first) * FPS)

    def key(self, key: str) -> None:
        """Press one key of the state machine, and do what it asks for."""
        self.presses += 1
        ends = [*(span.end for span in self.words.spans), *(moment.time for moment in self.words.keys)]
        before = max((end for end in ends if end < self.seconds() - 0.5 / FPS), default=None)
        self.state, commands = press(self.state, key, Now(self.seconds(), 1.0 / FPS, before))
        for command in commands:
            self.do(command)

    def do(self, command) -> None:
        """Carry a command out on the words and the playhead."""
        spans, keys = self.words.spans, self.words.keys
        if isinstance(command, AddMoment):
            self.words = Timeline(spans, (*keys, KeyMoment(command.time, command.words)))
        elif isinstance(command, AddSpan):
            self.words = Timeline((*spans, Span(command.start, command.end, command.words)), keys)
        elif isinstance(command, AtPlayhead):
            self.step(-1 if command.what == "earlier" else 1)

    def step(self, frames: int) -> None:
        """A frame earlier or later, with the key moment at the playhead where there is one."""
        near = [k for k in self.words.keys if abs(k.time - self.seconds()) < 0.06]
        if near:
            moved = replace(near[0], time=near[0].time + frames / FPS)
            others = tuple(key for key in self.words.keys if key is not near[0])
            self.words = Timeline(self.words.spans, (*others, moved))
        self.playhead += frames

    def pause_at(self, seconds: float) -> int:
        """Space, a little late; returns how many frames too late it was."""
        self.presses += 1
        late = round(REACTION * FPS)
        self.playhead = self.frame(seconds) + late
        return late

    def play(self) -> None:
        """Space: on with the film."""
        self.presses += 1


def digits(kind: str, words: tuple[str, ...]) -> tuple[str, ...]:
    """The fewest keys that choose exactly these words, found by trying all ways of the tree; ValueError where none
    does."""
    wanted = frozenset(words)
    begin = State(trail=(Walk(kind),))
    tried, open_ways = {(begin.walk, 0)}, deque([(begin, ())])
    while open_ways:
        state, keys = open_ways.popleft()
        if frozenset(state.walk.words) == wanted:
            return keys
        for key, after in _steps(state, wanted):
            if (after.walk, after.page) not in tried:
                tried.add((after.walk, after.page))
                open_ways.append((after, (*keys, key)))
    raise ValueError(f"no way to {' '.join(words)}")


def _steps(state: State, wanted: frozenset[str]) -> Iterator[tuple[str, State]]:
    useful = [str(option.digit) for option in state.shown if option.word in wanted and not option.chosen]
    for key in (*useful, "0", "NEXT_PAGE"):
        yield key, press(state, key, Now(0.0))[0]


def annotated(timeline: Timeline, first: float) -> Session:
    """A session in which all of `timeline` that has words is annotated, in the order of time."""
    session = Session(first)
    things = [(key.time, key) for key in timeline.keys]
    things += [(span.end, span) for span in timeline.spans if span.words]
    for _, thing in sorted(things, key=lambda one: (one[0], isinstance(one[1], Span))):
        if isinstance(thing, KeyMoment):
            _moment(session, thing)
        else:
            _span(session, thing)
    return session


def _moment(session: Session, key: KeyMoment) -> None:
    late = session.pause_at(key.time)
    for press_key in (*digits("moment", key.words), "ENTER", *["EARLIER"] * late):
        session.key(press_key)
    session.play()


def _span(session: Session, span: Span) -> None:
    """In and out; an end that a key moment stands on needs no stepping, and Out alone goes back to the last thing."""
    ends = [*(moment.time for moment in session.words.keys), *(one.end for one in session.words.spans)]
    if max((end for end in ends if end < span.end - 0.02), default=None) != span.start:
        _at(session, span.start, ends)
        session.key("IN")
        session.play()
    _at(session, span.end, ends)
    for press_key in ("OUT", *digits("span", span.words), "ENTER"):
        session.key(press_key)
    session.play()


def _at(session: Session, seconds: float, ends: list[float]) -> None:
    late = session.pause_at(seconds)
    if any(abs(end - seconds) < 0.02 for end in ends):
        session.key("PREVIOUS")
        session.playhead -= late
        return
    for _ in range(late):
        session.key("EARLIER")


def typed(number: int, timeline: Timeline) -> float:
    """Seconds of typing the same text file, pausing and stepping included, watching not."""
    text = scenario_files(number)[1].read_text()
    ends = {time for span in timeline.spans for time in (span.start, span.end)} | {key.time for key in timeline.keys}
    strokes = len(text) + len(ends) * (2 + round(REACTION * FPS))
    return strokes * STROKE + (len(text.splitlines()) + len(ends)) * THOUGHT


def worst(asked: Timeline, made: Timeline) -> float:
    """Largest distance in seconds of an asked time from the one that was made; ValueError where words differ."""
    wanted = [span for span in asked.spans if span.words]
    if [frozenset(s.words) for s in wanted] != [frozenset(s.words) for s in made.spans] or [
        frozenset(k.words) for k in asked.keys
    ] != [frozenset(k.words) for k in made.keys]:
        raise ValueError(f"other words came out: {made}")
    pairs = [(a.time, b.time) for a, b in zip(asked.keys, made.keys)]
    pairs += [pair for a, b in zip(wanted, made.spans) for pair in ((a.start, b.start), (a.end, b.end))]
    return max(abs(a - b) for a, b in pairs)


def main() -> None:
    """The table."""
    columns = ("scenario", "annotations", "presses", "of them words", "by keys, s", "typed, s", "Faustino typed, s",
               "old tool, s", "off by, s")  # fmt: skip
    head = f"| {' | '.join(columns)} |"
    print(head + "\n|" + "---|" * 9)
    for number in FAUSTINO:
        track, timeline = scenario(number)
        first, length = float(track.times[0]), float(track.times[-1] - track.times[0])
        session = annotated(timeline, first)
        count = len(session.words.keys) + len(session.words.spans)
        named = sum(len(digits("moment", k.words)) + 1 for k in timeline.keys)
        named += sum(len(digits("span", s.words)) + 1 for s in timeline.spans if s.words)
        took = 2 * length + session.presses * STROKE + count * THOUGHT
        cells = [number, count, session.presses, named, round(took), round(2 * length + typed(number, timeline)),
                 FAUSTINO[number], OLD_WAY[number], f"{worst(timeline, session.words):.3f}"]
        print("| " + " | ".join(map(str, cells)) + " |")


if __name__ == "__main__":
    main()
