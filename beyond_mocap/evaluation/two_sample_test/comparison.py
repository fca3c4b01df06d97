"""Whether a classifier can distinguish synthesized motion from a library's own recordings, and by which features.

A classifier two-sample test (Lopez-Paz and Oquab 2017, "Revisiting classifier two-sample tests"). Windows of 1 s of
takes and of unmirrored recordings are matched by speed (`windows`): at each speed there are as many of one as of the
other. Two classifiers learn which is which, and answer for windows that they have not seen (`cross_validation`). The
area under the curve is 0.5 for a guess and 1 for certainty.

Track and plan ask for other speeds, turns and directions of head and shoulders than recordings have, where there was no
ball to look at; so there is a second area without the features that they decide, for the body alone.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...base.errors import InputError, format_count
from ...base.optional_packages import import_optional
from ...library.library import Library
from ...synthesis.quality.playback import Playback
from .cross_validation import CLASSIFIERS, FEWEST, cross_validate, measure_areas
from .window_features import SECONDS, Feature
from .windows import Windows, collect_recorded_windows, collect_take_windows, list_subsets, match_windows

LISTED = 15  # features in the text


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
    """Format a comparison as Markdown.

    Args:
        report: of `compare_with_recordings`.
    Returns:
        The text.
    """
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
