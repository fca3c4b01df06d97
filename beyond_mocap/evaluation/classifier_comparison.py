"""Whether a classifier can distinguish synthesized motion from a library's own recordings, and by which features.

A classifier two-sample test (Lopez-Paz and Oquab 2017, "Revisiting classifier two-sample tests"). Windows of 1 s of
takes and of unmirrored recordings are matched by speed: at each speed there are as many of one as of the other. Two
classifiers learn which is which, and answer for windows that they have not seen: for each answer all windows of the
same recording are left out on both sides, because a take shows recordings that could have been learned, and all windows
of the same take. The area under the curve is 0.5 for a guess and 1 for certainty.

Frames that are not locomotion are left out: on both sides those whose source has the label of an action or of the ball,
and of recordings those whose postures do not belong to normal locomotion (`Library.strangeness`), which a take should
not show. Track and plan ask for other speeds, turns and directions of head and shoulders than recordings have, where
there was no ball to look at; so there is a second area without the features that they decide, for the body alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ..annotation import LOCOMOTION
from ..annotation.vocabulary import DIRECTIONS
from ..base.errors import InputError, format_count
from ..base.optional_packages import import_optional
from ..library.clip import LANDING_FOLDER
from ..library.library import Library
from ..motion.motion import Motion, resample, sample_frames
from ..synthesis.quality.playback import Playback, find_transitions
from ..synthesis.synthesize import estimate_look
from .view import compute_scale
from .window_features import SECONDS, Feature, WindowFeatures, list_window_frames, measure_windows

SPEED_EDGES = (1.0, 2.0, 4.5)  # m/s between the classes that have figures of their own
FEWEST = 40  # windows of each side with which a figure says anything
FOLDS = 4  # parts into which recordings, and takes, are divided for the cross-validation
LISTED = 15  # features in the text
_MATCHED = np.concatenate([np.arange(0.25, 2.0, 0.25), np.arange(2.0, 12.0, 0.5)])  # m/s between matched speeds
_LABELS = frozenset((*LOCOMOTION, *DIRECTIONS, "turning"))  # of locomotion without a ball

Sides = tuple[np.ndarray, np.ndarray]
"""Flags of windows: (A,) of takes, (B,) of recordings."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Windows:
    """Windows of takes or of recordings, W of them.

    Attributes:
        values: (W, F) of `window_features`.
        speed: (W,) m/s.
        recording: (W,) path of the recording that most of the window shows.
        source: (W,) name of the take, or of the recording.
        has_cut: (W,) whether the clip changes within the window.
    """

    values: np.ndarray
    speed: np.ndarray
    recording: np.ndarray
    source: np.ndarray
    has_cut: np.ndarray

    def __len__(self) -> int:
        return len(self.speed)

    def select(self, rows: np.ndarray) -> Windows:
        """Select windows by number or flag."""
        return Windows(**{name: values[rows] for name, values in vars(self).items()})

    def select_features(self, columns: np.ndarray) -> Windows:
        """Select columns of `values` by number or flag."""
        return replace(self, values=self.values[:, columns])


def compare_with_recordings(takes: Mapping[str, Playback], library: Library) -> dict:
    """Compare takes with a library's recordings by classifiers.

    Args:
        takes: name -> a take with its sources, on the library's skeleton or the same at another stature.
        library: the library.
    Returns:
        The report, NaN for figures with too few windows; the same input gives the same bits.
    Raises:
        InputError: without takes, their sources, recordings, or windows enough, or without scikit-learn.
    """
    from threadpoolctl import threadpool_limits

    import_optional("sklearn", "comparison with recordings")
    all_recorded = collect_recorded_windows(library)
    all_synthesized, features = collect_take_windows(takes, library)
    synthesized, recorded = match_windows(all_synthesized, all_recorded)
    if len(synthesized) < FEWEST:
        found = (f"{len(synthesized)} windows of {SECONDS:g} s that match by speed, of {len(all_synthesized)} in takes "
                 f"and {len(all_recorded)} in {library.folder}")
        raise InputError("takes", found, f"{FEWEST} or more", "add takes, or recordings of their speeds")
    is_body = np.array([not feature.is_planned for feature in features])
    with threadpool_limits(limits=1):  # with more threads, sums have another order and other bits
        areas, losses = cross_validate(synthesized, recorded)
        body_areas, _ = cross_validate(synthesized.select_features(is_body), recorded.select_features(is_body),
                                       with_losses=False)
    subsets = list_subsets(synthesized, recorded)
    return {
        "library": library.folder, "takes": list(takes), "fps": library.fps,
        "groups": {"takes": len(set(synthesized.source)), "clips_shown": len(set(synthesized.recording)),
                   "recordings": len(set(recorded.recording))},
        "unmatched": {"takes": len(all_synthesized) - len(synthesized),
                      "recordings": len(all_recorded) - len(recorded)},
        "subsets": {
            name: {"windows": [int(flags.sum()) for flags in sides], "auc": areas[name], "auc_body": body_areas[name],
                   "features": _describe_features(features, synthesized.select(sides[0]), recorded.select(sides[1]),
                                                  losses[name])}
            for name, sides in subsets.items()
        },
    }  # fmt: skip


def collect_take_windows(takes: Mapping[str, Playback], library: Library) -> tuple[Windows, tuple[Feature, ...]]:
    """Collect the windows of takes that show locomotion, and their features.

    Args:
        takes: name -> a take.
        library: its recordings.
    Raises:
        InputError: without takes, or for one without sources, with clips that the library does not have, on another
            skeleton or too short.
    """
    parts = [_measure_take(name, played, library) for name, played in takes.items()]
    if not parts:
        raise InputError("takes", "none", "one take or more")
    return _join_windows([windows for windows, _ in parts]), parts[0][1]


def _measure_take(name: str, played: Playback, library: Library) -> tuple[Windows, tuple[Feature, ...]]:
    """Measure the windows of one take."""
    if played.words is None:
        raise InputError(name, "the clips that it shows are not known", "its table of sources", "add --provenance")
    if unknown := played.list_unknown_clips(library):
        # of these it is not known which recordings the folds have to leave out with them
        raise InputError(name, f"shows {format_count(len(unknown), 'clip')} that {library.folder} does not have, such "
                         f"as {unknown[0]}", "a take synthesized from this library", "compare it with its own library")
    motion = _fit_to_library(name, played.motion, library)
    measured = _measure_motion(name, motion, library)
    stride = played.compute_stride(library)
    starts_piece = np.zeros(len(played.clip), bool)
    starts_piece[find_transitions(played.clip, played.mirrored, played.clip_frame, stride)] = True
    is_locomotion = np.array([set(words) <= _LABELS for words in played.words])
    shown = np.rint(np.arange(len(motion)) * (played.motion.fps / motion.fps)).astype(int)
    shown = shown.clip(0, len(played.clip) - 1)[measured.frames]
    clip = [np.bincount(row).argmax() for row in played.clip[shown]]
    windows = Windows(
        values=measured.values, speed=measured.speed, source=np.full(len(clip), name),
        recording=np.array([path.removeprefix(LANDING_FOLDER) for path in played.clips])[clip],
        has_cut=starts_piece[shown[:, 1:]].any(axis=1),
    )
    return windows.select(is_locomotion[shown].all(axis=1)), measured.features


def _fit_to_library(name: str, motion: Motion, library: Library) -> Motion:
    """Bring a take to the library's stature and rate; InputError for another skeleton."""
    try:
        size = compute_scale(motion.skeleton, library.skeleton)
    except InputError as error:
        raise InputError(name, str(error)) from None
    return resample(Motion(library.skeleton, motion.root_positions / size, motion.rotations, motion.fps), library.fps)


def _measure_motion(name: str, motion: Motion, library: Library) -> WindowFeatures:
    """Measure the windows of a motion; InputError where it is too short for one."""
    if not len(list_window_frames(len(motion), motion.fps)):
        raise InputError(name, f"lasts {motion.duration:.1f} s", f"{2 * SECONDS:g} s or more")
    return measure_windows(motion, estimate_look(library))


def collect_recorded_windows(library: Library) -> Windows:
    """Collect the windows of unmirrored recordings that show normal locomotion.

    Args:
        library: the recordings.
    Raises:
        InputError: for fewer than two recordings with such windows.
    """
    numbers = [i for i, clip in enumerate(library.clips) if not (clip.mirrored or clip.is_synthetic)]
    parts = [_measure_recording(library, i) for i in numbers if library.clips[i].recording.duration > 2.1 * SECONDS]
    found = [windows for windows in parts if len(windows)]
    if len(found) < 2:
        raise InputError(
            library.folder, f"{format_count(len(found), 'recording')} with {2 * SECONDS:g} s of locomotion",
            "2 or more", "add recordings, or compare with another library",
        )
    return _join_windows(found)


def _measure_recording(library: Library, number: int) -> Windows:
    """Measure the windows of one recording at the library's rate."""
    clip, frames = library.clips[number], library.frames
    rows = frames.first[number] + np.arange(frames.count[number])
    rows = rows[frames.source[rows] <= len(clip.recording) - 1]
    motion = Motion(library.skeleton, *sample_frames(clip.motion, frames.source[rows]), library.fps)
    measured = _measure_motion(clip.path, motion, library)
    others = [i for i, label in enumerate(frames.vocabulary) if label not in _LABELS]
    is_locomotion = ~frames.words[rows][:, others].any(axis=1)
    belongs = library.strangeness[rows][measured.frames].mean(axis=1) <= 1.0
    paths = np.full(len(belongs), clip.path)
    windows = Windows(values=measured.values, speed=measured.speed, recording=paths, source=paths,
                      has_cut=np.zeros(len(belongs), bool))
    return windows.select(is_locomotion[measured.frames].all(axis=1) & belongs)


def _join_windows(parts: list[Windows]) -> Windows:
    """Join windows in their order."""
    return Windows(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])})


def match_windows(synthesized: Windows, recorded: Windows) -> tuple[Windows, Windows]:
    """Select as many windows of each side as both have at each speed, spread evenly over the side that has more."""
    kinds = [np.digitize(windows.speed, _MATCHED) for windows in (synthesized, recorded)]
    chosen: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
    for kind in range(len(_MATCHED) + 1):
        rows = [np.flatnonzero(own == kind) for own in kinds]
        count = min(len(own) for own in rows)
        for own, out in zip(rows, chosen):
            out.append(own[np.arange(count) * len(own) // max(count, 1)])
    first, second = (np.sort(np.concatenate(out)) for out in chosen)
    return synthesized.select(first), recorded.select(second)


def list_subsets(synthesized: Windows, recorded: Windows) -> dict[str, Sides]:
    """List the windows of both sides that have figures.

    They are all, each class of speed, takes with and without a cut, and of recordings those that the takes show: less
    area there is due to the choice of recordings.
    """
    kinds = [np.digitize(windows.speed, SPEED_EDGES) for windows in (synthesized, recorded)]
    edges = [0.0, *SPEED_EDGES]
    names = [f"{low:g} to {high:g} m/s" for low, high in zip(edges, edges[1:])] + [f"above {edges[-1]:g} m/s"]
    everything = np.ones(len(recorded), bool)
    return {
        "all": (np.ones(len(synthesized), bool), everything),
        **{name: (kinds[0] == kind, kinds[1] == kind) for kind, name in enumerate(names)},
        "with a cut": (synthesized.has_cut, everything), "without a cut": (~synthesized.has_cut, everything),
        "recordings in takes": (np.ones(len(synthesized), bool), np.isin(recorded.recording, synthesized.recording)),
    }  # fmt: skip


def cross_validate(synthesized: Windows, recorded: Windows, with_losses: bool = True) -> tuple[dict, dict]:
    """Train both classifiers on parts of the windows, and measure how well they distinguish the others.

    Areas are measured within each fold, so that classifiers of several folds need not agree on a scale, and averaged
    with the number of pairs as weights.

    Args:
        synthesized, recorded: windows with F features.
        with_losses: also shuffle each feature among the windows of a fold.
    Returns:
        Area under the curve by subset and classifier, NaN for a subset with fewer than FEWEST windows of a side; and by
        the same keys the areas (F,) that are lost when each feature is shuffled.
    Raises:
        InputError: see `list_folds`.
    """
    subsets = list_subsets(synthesized, recorded)
    found: dict[tuple[str, str], list] = {key: [] for key in product(subsets, CLASSIFIERS)}
    for number, (train, test) in enumerate(list_folds(synthesized, recorded)):
        learned = [windows.select(flags) for windows, flags in zip((synthesized, recorded), train)]
        asked = [windows.select(flags) for windows, flags in zip((synthesized, recorded), test)]
        for kind, build_classifier in CLASSIFIERS.items():
            model = build_classifier().fit(*_build_examples(*learned))
            generator = np.random.default_rng(number) if with_losses else None
            scores = np.split(_score_windows(model, _build_examples(*asked)[0], generator), [len(asked[0])])
            for name, sides in subsets.items():
                parts = [own[flags[rows]] for own, flags, rows in zip(scores, sides, test)]
                if all(len(part) for part in parts):
                    found[name, kind].append((len(parts[0]) * len(parts[1]), measure_areas(*parts)))
    areas: dict[str, dict[str, float]] = {name: {} for name in subsets}
    losses: dict[str, dict[str, np.ndarray]] = {name: {} for name in subsets}
    for (name, kind), rows in found.items():
        is_enough = rows and min(flags.sum() for flags in subsets[name]) >= FEWEST
        mean = np.average([area for _, area in rows], axis=0, weights=[weight for weight, _ in rows]) if is_enough \
            else np.full(1 + synthesized.values.shape[1], np.nan)
        areas[name][kind], losses[name][kind] = float(mean[0]), mean[0] - mean[1:]
    return areas, losses


def list_folds(synthesized: Windows, recorded: Windows) -> list[tuple[Sides, Sides]]:
    """List the folds: the windows of both sides from which classifiers learn, and those that they are asked about.

    Neither a recording, on either side, nor a take is among both. A single take is divided into stretches.

    Raises:
        InputError: where no recording can be left out on both sides.
    """
    recordings = assign_folds(np.concatenate([synthesized.recording, recorded.recording]))
    shown, own = recordings[: len(synthesized)], recordings[len(synthesized) :]
    takes = assign_folds(synthesized.source)
    if not takes.any():
        takes = np.arange(len(takes)) * FOLDS // len(takes)
    folds = []
    for part, take in product(range(recordings.max() + 1), range(takes.max() + 1)):
        train = (shown != part) & (takes != take), own != part
        test = (shown == part) & (takes == take), own == part
        if all(flags.any() for flags in (*train, *test)):
            folds.append((train, test))
    if not folds:
        found = f"show {format_count(len(set(synthesized.recording)), 'clip')}, such as {synthesized.recording[0]}"
        raise InputError("takes", found, "several clips, of which each can be left out in turn",
                         "add takes that show others")
    return folds


def assign_folds(groups: np.ndarray) -> np.ndarray:
    """Assign a fold (W,) to each window by its group (W,); all 0 where there is one group."""
    from sklearn.model_selection import GroupKFold

    folds, count = np.zeros(len(groups), int), min(FOLDS, len(np.unique(groups)))
    if count > 1:
        for number, (_, rows) in enumerate(GroupKFold(count).split(groups, groups=groups)):
            folds[rows] = number
    return folds


def _build_examples(synthesized: Windows, recorded: Windows) -> tuple[np.ndarray, np.ndarray]:
    """Build features (N, F), and whether each row is synthesized (N,)."""
    is_synthesized = np.repeat([True, False], [len(synthesized), len(recorded)])
    return np.concatenate([synthesized.values, recorded.values]), is_synthesized


def _build_logistic_regression():
    from sklearn.linear_model import LogisticRegression
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    return make_pipeline(StandardScaler(), LogisticRegression(C=0.1, max_iter=2000))


def _build_gradient_boosting():
    from sklearn.ensemble import GradientBoostingClassifier

    return GradientBoostingClassifier(max_features="sqrt", random_state=0)


CLASSIFIERS = {"logistic_regression": _build_logistic_regression, "gradient_boosting": _build_gradient_boosting}
"""Name -> function that builds an untrained one."""


def _score_windows(model, values: np.ndarray, generator: np.random.Generator | None) -> np.ndarray:
    """Score windows (W, F): (W, 1 + F), as they are and with each feature shuffled; (W, 1) without a generator."""
    copies = [values]
    for column in range(values.shape[1]) if generator is not None else ():
        shuffled = values.copy()
        shuffled[:, column] = generator.permutation(values[:, column])
        copies.append(shuffled)
    return model.decision_function(np.concatenate(copies)).reshape(len(copies), len(values)).T


def measure_areas(synthesized: np.ndarray, recorded: np.ndarray) -> np.ndarray:
    """Measure the area under the receiver operating characteristic of each column.

    It is the share of pairs in which the synthesized one is greater; ties count one half.

    Args:
        synthesized, recorded: (A, K), (B, K).
    Returns:
        (K,).
    """
    from scipy.stats import rankdata

    count = len(synthesized)
    ranks = rankdata(np.concatenate([synthesized, recorded]), axis=0)[:count].sum(axis=0)
    return (ranks / count - 0.5 * (count + 1)) / len(recorded)


def _describe_features(features: tuple[Feature, ...], synthesized: Windows, recorded: Windows,
                       losses: Mapping[str, np.ndarray]) -> list[dict]:
    """Describe each feature: its medians on both sides, its area by itself, and the area that is lost without it."""
    if min(len(synthesized), len(recorded)) < FEWEST:
        return []
    areas = measure_areas(synthesized.values, recorded.values)
    medians = [np.median(windows.values, axis=0) for windows in (synthesized, recorded)]
    return [
        {**feature._asdict(), "takes": float(medians[0][i]), "recordings": float(medians[1][i]), "auc": float(areas[i]),
         "lost_auc": {kind: float(values[i]) for kind, values in losses.items()}}
        for i, feature in enumerate(features)
    ]  # fmt: skip


def list_top_features(subset: Mapping, kind: str, count: int = LISTED) -> list[dict]:
    """List the features of a subset of the report without which a classifier loses most area, the first one most.

    Where several features say the same, none of them is missed; among equals the one with the clearest area by itself
    is first.
    """
    return sorted(subset["features"], key=lambda feature: (-round(feature["lost_auc"][kind], 3),
                                                           -abs(feature["auc"] - 0.5)))[:count]


def format_comparison(report: Mapping) -> str:
    """Format a report of `compare_with_recordings` as Markdown."""
    groups, subsets = report["groups"], report["subsets"]
    lines = [
        f"{format_count(subsets['all']['windows'][0], 'window')} of {SECONDS:g} s of each side: from "
        f"{format_count(groups['takes'], 'take')} with {format_count(groups['clips_shown'], 'clip')}, and from "
        f"{format_count(groups['recordings'], 'recording')}.", "",
        "| area under the curve | windows | logistic regression | gradient boosting | both, body alone |",
        "|---|---|---|---|---|",
    ]
    for name, subset in subsets.items():
        areas, body = ([_format_area(subset[key][kind]) for kind in CLASSIFIERS] for key in ("auc", "auc_body"))
        windows = "+".join(map(str, subset["windows"]))
        lines.append(f"| {name} | {windows} | {areas[0]} | {areas[1]} | {body[0]}, {body[1]} |")
    if any(min(subset["windows"]) < FEWEST for subset in subsets.values()):
        lines += ["", f"Not known: fewer than {FEWEST} windows on a side."]
    for kind in CLASSIFIERS:
        lines += ["", f"| {kind.replace('_', ' ')}: feature | takes | recordings | area by itself | area lost |",
                  "|---|---|---|---|---|"]
        lines += [_format_feature(feature, kind) for feature in list_top_features(subsets["all"], kind)]
    return "\n".join(lines) + "\n"


def _format_area(area: float) -> str:
    return f"{area:.2f}" if np.isfinite(area) else "not known"


def _format_feature(feature: Mapping, kind: str) -> str:
    """Format one row: the medians of both sides, the area by itself, and the area lost without it."""
    takes, recordings = (f"{feature[side]:.3g} {feature['unit']}".strip() for side in ("takes", "recordings"))
    return f"| {feature['name']} | {takes} | {recordings} | {feature['auc']:.2f} | {feature['lost_auc'][kind]:.3f} |"
