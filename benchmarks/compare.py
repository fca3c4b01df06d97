"""What was compared once, so that it need not be argued again: each section measures two ways and says which is
kept."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from unittest.mock import patch

import numpy as np

from beyond_mocap.evaluation import evaluate, feet, library_reference, played_from_take, realism, root
from beyond_mocap.evaluation.view import View
from beyond_mocap.library.library import Library
from beyond_mocap.library.build import build
from beyond_mocap.motion.gait_tables import at_speed
from beyond_mocap.plan import Plan
from beyond_mocap.synthesis import blocks, locomotion
from beyond_mocap.synthesis.annotation_cost import AnnotationCost, _running_sum
from beyond_mocap.synthesis.transition_cost import distances, windows
from beyond_mocap.synthesize import synthesize

from . import markdown
from .effort import seconds
from .misses import KINDS, kinds
from .places import DATA, LIBRARIES, library_folder, linked, scenario

SPEEDS = (0.0, 3.0, 4.5, 6.0, np.inf)
FAST_RECORDINGS = ("runs15", "sprinter")
DOWN = 0.03
WORDS_COLUMNS = (
    "library, method", "cost", "similarity, all / keys", "eq. 18, all / keys", "seams", "seam jerk, median",
    "off the track, m", "s",
)
TABLE_COLUMNS = (
    "library", "blocks", "table, GiB", "build, s", "pairs needed a run (distance)", "worked out, s", "looked up, s",
)
RUNNING_COLUMNS = (
    "library", "m/s", "s", "way", "cadence", "flight", "skate, cm/s", "stances over 21 mm", "foot correction p95, cm",
    "legs short", "unreal", "off real running, cm",
)


def all_of(scenarios: list[int], names: list[str]) -> list[str]:
    """Every comparison, as lines of Markdown."""
    with tempfile.TemporaryDirectory() as place:
        libraries = {}
        for name in names:
            folder = library_folder(name, Path(place) / name)
            libraries[name] = build(folder, unit=LIBRARIES[name], cache_dir=Path(place) / f"cache-{name}")
        lines = annotation_costs(libraries, scenarios) + continuity(libraries, scenarios)
        return lines + made_running(libraries, scenarios, Path(place))


def _plan(library: Library, number: int, **options) -> Plan:
    track, timeline = scenario(number)
    return Plan(track=track, timeline=timeline, library=library.folder, nearest=True, **options)


class SquaredDifference(AnnotationCost):
    """Faustino §3.2.2's alternative: the squared difference of the vectors of +1 and -1, that is four times the number
    of words that only one of the two has. Scaled by the mean number of words of a recorded frame, so that -1 is all
    alike and 1 is what other words in the usual number cost, as with eq. 18; but it has no end above."""

    def of_blocks(self, start, asked):
        """(M,) the cost of blocks that start at frames `start` (M,), for the asked words of each of their frames."""
        words = self.frames.words.sum(axis=1)
        usual, present = float(words[words > 0].mean()), _running_sum(words)
        different, counted = np.zeros(len(start)), 0
        for offset, wanted in enumerate(asked):
            if wanted is None:
                continue
            a, b = self._clamped(start + offset), self._clamped(start + offset + 1)
            shared = self._shared(wanted)[b] - self._shared(wanted)[a]
            different += (present[b] - present[a]) + len(wanted) - 2 * shared
            counted += 1
        return different / (counted * usual) - 1.0 if counted else different


def annotation_costs(libraries: dict[str, Library], scenarios: list[int]) -> list[str]:
    """Eq. 18 against the squared difference in the block search."""
    lines = [
        "### Words: eq. 18 or the squared difference (Faustino §3.2.2)", "",
        "Means over the scenarios; similarity over asked words and as printed, -1 is all.", "",
        *markdown.head(WORDS_COLUMNS),
    ]
    for name, library in libraries.items():
        for method in ("blocks", "distance"):
            for told, cost in (("eq. 18", AnnotationCost), ("squared", SquaredDifference)):
                with patch.object(blocks, "AnnotationCost", cost):
                    rows = [_words_row(library, number, method) for number in scenarios]
                cells = np.nanmean(np.array(rows, dtype=float), axis=0)
                similarity, printed = (" / ".join(f"{v:.2f}" for v in cells[i : i + 2]) for i in (0, 2))
                seams, hard, off, took = cells[4:]
                rest = [f"{seams:.0f}", f"{hard:.2f}", f"{off:.2f}", f"{took:.2f}"]
                lines.append(markdown.row([f"{name}, {method}", told, similarity, printed, *rest]))
    decision = (
        "Kept: eq. 18. The squared difference counts every further word of a clip against it, meets fewer of the asked "
        "words with both methods, and takes twice as long; it cuts more smoothly only where it gives the words up "
        "(`blocks`)."
    )
    return [*lines, "", decision, ""]


def _words_row(library: Library, number: int, method: str) -> list:
    plan = _plan(library, number, method=method)
    took, take = seconds(lambda: synthesize(library, plan), 1)
    report = evaluate(take, plan.track, library)
    words = report["annotation_similarity"]
    return [
        words["all"], words["keys"], words["eq18_all"], words["eq18_keys"], report["seams"],
        report["seam_jerk_ratio"]["median"], report["pelvis_error_m"]["mean"], took,
    ]


class _Timed:
    """`distances`, with its seconds and the number of pairs added up."""

    def __init__(self):
        self.seconds, self.pairs = 0.0, 0

    def __call__(self, a, b):
        begun = time.process_time()
        out = distances(a, b)
        self.seconds += time.process_time() - begun
        self.pairs += out.size
        return out


def continuity(libraries: dict[str, Library], scenarios: list[int], rows: int = 400) -> list[str]:
    """Distances between blocks worked out when they are needed, against a table of all of them (§4.3)."""
    lines = [
        "### Continuity between blocks: worked out when needed, or kept in a table (Faustino §4.3)", "",
        "The table holds the continuity cost of every 8-frame block before every other, float32. Building and looking "
        "up are",
        f"measured on {rows} of its rows and scaled.", "",
        *markdown.head(TABLE_COLUMNS),
    ]
    for name, library in libraries.items():
        timed = _Timed()
        with patch.object(blocks, "distances", timed), patch.object(locomotion, "distances", timed):
            for number in scenarios:
                synthesize(library, _plan(library, number, method="distance"))
        pairs, took = timed.pairs / len(scenarios), timed.seconds / len(scenarios)
        count, build_seconds, per_pair = _table(library, rows)
        size, needed = f"{4.0 * count**2 / 2**30:.1f}", f"{pairs / 1e6:.1f} million"
        cells = [name, str(count), size, f"{build_seconds:.1f}", needed, f"{took:.3f}", f"{pairs * per_pair:.3f}"]
        lines.append(markdown.row(cells))
    decision = (
        "Kept: worked out when needed. A library that covers running needs a table larger than most machines' memory, "
        "and looking distances up there is no faster than working them out; a small library saves some hundredths of a "
        "second."
    )
    return [*lines, "", decision, ""]


def _table(library: Library, rows: int) -> tuple[int, float, float]:
    """Number of blocks, seconds to build their table, seconds to look up one pair in it."""
    start = library.clusters[blocks.FINEST].start
    clip, size = library.frames.clip[start], blocks.FINEST // 2
    before = windows(library.frames, clip, start, size)
    some = np.linspace(0, len(start) - 1, min(rows, len(start))).astype(int)
    after = windows(library.frames, clip[some], start[some] + blocks.FINEST, size)
    built, table = seconds(lambda: distances(after, before).astype(np.float32), 2)
    random = np.random.default_rng(0)
    pick = random.integers(0, len(some), 300), random.integers(0, len(start), 500)
    looked, found = seconds(lambda: table[np.ix_(*pick)], 5)
    return len(start), built * len(start) / len(some), looked / found.size


def made_running(libraries: dict[str, Library], scenarios: list[int], place: Path) -> list[str]:
    """Made running against the fastest recording, played faster with longer strides (`Plan.made`)."""
    lines = [
        "### Faster than any recording: made running, or recordings stretched", "",
        "`path` with and without `--no-made`, by the speed asked, without key moments. Cadence: steps a second, "
        "flight: share of frames with",
        "neither foot within 3 cm of where it stands; both beside published ones (Dorn 2012 and others,",
        "`motion/gait_tables`) at the same speeds. Unreal: share of poses farther from the library's own than these "
        "are from",
        f"each other. Off real running: the median distance from the nearest pose of {', '.join(FAST_RECORDINGS)}",
        "on the same skeleton, which reach 8.9 m/s.", "",
        *markdown.head(RUNNING_COLUMNS),
    ]
    for name, library in libraries.items():
        if library.extended is library or not any(_outrun(library, number) for number in scenarios):
            told = f"never made: recordings reach {library.fastest:.1f} m/s"
            lines.append(markdown.row([name, "-", "0", told, *[""] * (len(RUNNING_COLUMNS) - 4)]))
            continue
        referee = _referee(library, place)
        samples = {
            told: [_running(library, number, made, referee) for number in scenarios]
            for told, made in (("made", True), ("stretched", False))
        }
        for low, high in zip(SPEEDS, SPEEDS[1:]):
            for told, of in samples.items():
                speeds = f"{low:g}-{high:g}" if np.isfinite(high) else f"above {low:g}"
                lines.append(markdown.row([name, speeds, *_class_row(of, low, high, told)]))
    decision = (
        "Kept: made running. It is nearer to real running wherever it steps in, its cadence is within 7 % of the "
        "published one where stretched strides are a fifth too slow, and its feet stand: away from key moments it "
        "skates 2 to 4 cm/s, "
        "stretched recordings 10 below 6 m/s and 80 above. Seen side by side, stretched strides keep a jogger's "
        "upright trunk and folded arms at 8 m/s."
    )
    return [*lines, "", decision, ""]


def _outrun(library: Library, number: int) -> bool:
    track = scenario(number)[0]
    take = synthesize(library, Plan(track=track, library=library.folder))
    return any("made-gait" in path for path in take.clips)


def _referee(library: Library, place: Path):
    """Real running on the library's skeleton, None where the library is not of one of its kinds."""
    clips = sorted((DATA / "mocap" / "cmu10").glob("*.bvh"))
    folder = linked(FAST_RECORDINGS, place / "referee")
    built = build(folder, skeleton=clips[0], cache_dir=place / "cache-referee")
    return library_reference(built, 30.0) if built.skeleton.same_bones(library.skeleton, 5e-3) else None


def _running(library: Library, number: int, made: bool, referee) -> dict[str, np.ndarray]:
    """What one take shows frame by frame: speed asked, steps, flight, skate and the rest, each (T,)."""
    plan = _plan(library, number, made=made)
    take = synthesize(library, plan)
    view = View(played_from_take(take), plan.track, take.timeline, library)
    played, fps, count = view.played, view.fps, view.count
    lower = np.minimum(played.feet[..., 1, 2], played.feet[..., 0, 2] - view.reference.heel_rest)
    down = lower < DOWN
    steps = (down[1:] & ~down[:-1]).sum(axis=1)
    spans = feet.stances(played.contacts)
    travel = feet.stance_travel(played.feet[:, :, 1], spans)
    slid = np.full(count, np.nan)
    slid[spans[:, 0]] = travel > feet.NOTICED_SLIDE
    features = realism.pose_features(played.motion.skeleton, played.positions, fps, played.body.hips)

    near = realism.nearest_distance(features, view.reference.poses)
    moved = np.where(played.contacts, played.correction, np.nan)
    return {
        "speed": root.travel_speed(view.wanted, fps),
        "kind": kinds(view),
        "steps": np.append(0, steps) * fps,
        "flight": (~down.any(axis=1)).astype(float),
        "skate": np.append(_mean_of(feet.contact_speeds(played.feet, played.contacts, fps)), np.nan),
        "slid": slid,
        "moved": np.nan_to_num(moved, nan=-1.0).max(axis=1),
        "short": (take.ik_miss > 0.005).any(axis=1).astype(float),
        "unreal": realism.unreal(near, view.speed, view.reference.pose_p95).astype(float),
        "off": realism.nearest_distance(features, referee.poses) if referee is not None else np.full(count, np.nan),
    }


def _mean_of(values: np.ndarray) -> np.ndarray:
    """Mean of the finite values of each row of (T, 2), NaN where there is none."""
    known = np.isfinite(values)
    return np.where(known.any(axis=1), np.nansum(values, axis=1) / np.maximum(known.sum(axis=1), 1), np.nan)


def _class_row(takes: list[dict[str, np.ndarray]], low: float, high: float, told: str) -> list[str]:
    of = {name: np.concatenate([take[name] for take in takes]) for name in takes[0]}
    mine = (of["speed"] >= low) & (of["speed"] < high) & (of["kind"] != KINDS.index("key moments"))
    if not np.any(mine):
        return ["0", told, *[""] * (len(RUNNING_COLUMNS) - 4)]
    of = {name: values[mine] for name, values in of.items()}
    moved = of["moved"][of["moved"] >= 0.0]
    cadence = 2.0 * at_speed("frequency", of["speed"]).mean()
    flight = np.maximum(0.0, 1.0 - 2.0 * at_speed("duty", of["speed"])).mean()
    return [
        f"{mine.sum() / 30.0:.0f}",
        told,
        f"{of['steps'].mean():.2f} (real {cadence:.2f})",
        f"{of['flight'].mean():.0%} (real {flight:.0%})",
        f"{100 * np.nanmean(of['skate']):.1f}",
        f"{np.nanmean(of['slid']):.0%}",
        f"{100 * np.percentile(moved, 95):.0f}" if len(moved) else "-",
        f"{of['short'].mean():.1%}",
        f"{of['unreal'].mean():.0%}",
        f"{100 * np.median(of['off']):.1f}",
    ]
