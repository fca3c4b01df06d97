"""What the clean-up of a trial did, marker by marker, and in lines for people."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field

from ...base.errors import TimedLine

# where more markers than this have something to tell, one line tells it for all
_MOST_LINES = 6


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """Something that was found between two moments.

    labels: the markers concerned. start, end: seconds on the trial's clock, the first frame and the last. frames: how
    many. how: what was done, in a word; "" where nothing could be. off: m, how far off its place it was.
    """

    labels: tuple[str, ...]
    start: float
    end: float
    frames: int
    how: str = ""
    off: float = 0.0

    def when(self) -> str:
        """`at 1.234 s` or `1.234 to 1.300 s`."""
        return f"at {self.start:.3f} s" if self.frames == 1 else f"{self.start:.3f} to {self.end:.3f} s"


@dataclass(frozen=True, kw_only=True)
class CleanReport:
    """What was found and done.

    seen: label -> share of the frames in which the recording sees it. gaps: what was filled; how is "cluster", "soft"
    or "spline". left: gaps that stay. swaps: how is "mended" or ""; the labels stand in pairs. jumps: samples taken out
    (filled again where a gap is). assigned: (unlabeled marker, label). strayed: markers that stay far from where their
    cluster says. unnamed: unlabeled markers that remain, with the share of frames.
    """

    seen: Mapping[str, float] = field(default_factory=dict)
    gaps: tuple[Stretch, ...] = ()
    left: tuple[Stretch, ...] = ()
    swaps: tuple[Stretch, ...] = ()
    jumps: tuple[Stretch, ...] = ()
    assigned: tuple[Stretch, ...] = ()
    strayed: tuple[Stretch, ...] = ()
    unnamed: Mapping[str, float] = field(default_factory=dict)

    @property
    def lines(self) -> tuple[str, ...]:
        """What people should know, the gravest first; each line knows its seconds (`errors.spans_of`)."""
        return (
            *(_swapped(swap) for swap in self.swaps),
            *(_timed(f"{one.labels[0]} taken for {one.labels[1]} {one.when()}", [one]) for one in self.assigned),
            *_by_label(self.jumps, "jumping frames taken out"),
            *_by_label(self.strayed, "frames far from where the markers around it say"),
            *_by_label(self.left, "frames not seen and left open"),
            *_summed(self.gaps, "frames not seen and filled"),
        )

    def as_dict(self) -> dict:
        """The report as plain values, for JSON."""
        return asdict(self) | {"lines": list(self.lines)}


def _swapped(swap):
    pairs = ", ".join(f"{a} and {b}" for a, b in zip(swap.labels[::2], swap.labels[1::2]))
    done = "exchanged, mended" if swap.how else "seem exchanged, not mended: nothing around them tells"
    return _timed(f"{pairs} {done} {swap.when()}", [swap])


def _by_label(stretches, what):
    """One line for each label, and one for all that share all their stretches; one in all where these are many."""
    own: dict[str, list] = {}
    for stretch in stretches:
        own.setdefault(stretch.labels[0], []).append(stretch)
    alike: dict[tuple, list[str]] = {}
    for label, ones in own.items():
        alike.setdefault(tuple((one.start, one.frames) for one in ones), []).append(label)
    if len(alike) > _MOST_LINES:
        yield from _summed(stretches, what)
        return
    for labels in alike.values():
        ones = own[labels[0]]
        count = sum(one.frames for one in ones)
        counted = what if count != 1 else what.replace("frames", "frame")
        shown = ", ".join(one.when() for one in ones[:3]) + (f" and {len(ones) - 3} more" if len(ones) > 3 else "")
        yield _timed(f"{_named(labels)}: {count} {counted}: {shown}", ones)


def _summed(stretches, what):
    """One line for all of them: how many frames, of which markers most."""
    count: dict[str, int] = {}
    for stretch in stretches:
        count[stretch.labels[0]] = count.get(stretch.labels[0], 0) + stretch.frames
    most = sorted(count, key=lambda label: -count[label])
    shown = ", ".join(f"{label} {count[label]}" for label in most[:5]) + (", ..." if len(most) > 5 else "")
    if count:
        yield _timed(f"{sum(count.values())} {what}: {shown}", stretches)


def _named(labels):
    """`LKNE`, `LKNE and LANK`, or `46 markers (LFHD, RFHD, LBHD, ...)`."""
    if len(labels) > 4:
        return f"{len(labels)} markers ({', '.join(labels[:3])}, ...)"
    return " and ".join([", ".join(labels[:-1]), labels[-1]] if len(labels) > 1 else labels)


def _timed(text, stretches):
    return TimedLine(text, *((stretch.start, stretch.end) for stretch in stretches))
