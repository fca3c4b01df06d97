"""What the experiments with throws found, as tables: his 8.1 to 8.8 with ours, and all variants side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from beyond_mocap.evaluation.throws import fredriksson
from beyond_mocap.evaluation.throws.subjects import EFFECTOR_NAMES, Subjects, gathered, lost_ones
from beyond_mocap.evaluation.throws.tables import figure_table, test_table, verdicts

from benchmarks import markdown
from benchmarks.throw_runs import Scale, variants

WORDS = {"planted": "Planted throws", "lmd": "Recorded kicks"}
"""Data -> heading."""
PAIRS = (
    ("Tables 8.1 to 8.4: one network or six, nothing corrected", "hierarchy-raw", "single-raw", "first"),
    ("The same with frames fed back in training: one network or six", "hierarchy-fed-raw", "single-fed-raw", ""),
    ("One network with its frames fed back in training, or not", "single-fed-raw", "single-raw", ""),
    ("Six networks with their frames fed back in training, or not", "hierarchy-fed-raw", "hierarchy-raw", ""),
    ("Six linear maps or one, nothing corrected", "linear-phased-raw", "linear-single-raw", ""),
    ("Tables 8.5 to 8.8: phase-functioned or feed-forward, all corrected", "hierarchy", "feed-forward", "second"),
    ("As many parameters: phase-functioned or feed-forward", "hierarchy", "feed-forward-equal", ""),
    ("Linear maps with phases or without", "linear-phased", "linear", ""),
    ("The same, nothing corrected", "linear-phased-raw", "linear-raw", ""),
    ("His question of §9.2: one network with the end-effector loss against the same without", "single-effectors",
     "single-raw", ""),
    ("The same with frames fed back in training", "single-effectors-fed", "single-fed-raw", ""),
    ("Six networks, or one with the end-effector loss, both fed back", "hierarchy-fed-raw", "single-effectors-fed", ""),
    ("Limbs told how inverse kinematics would reach, or not", "linear-guided", "linear-phased", ""),
    ("The same, nothing corrected", "linear-guided-raw", "linear-phased-raw", ""),
    ("Started as the shipped weights are, or trained from chance as he did", "start", "hierarchy", ""),
    ("The same, nothing corrected", "start-raw", "hierarchy-raw", ""),
    ("Trained in order and fed back (§9.4) or each alone", "ours", "hierarchy", ""),
    ("The shipped weights' start, trained on in order and fed back, or as it is", "ours", "start", ""),
    ("Inverse kinematics inside the loss or after the fact", "ours-ik", "ours", ""),
    ("Phases warped in time (§9.3) or by travelled distance", "start-warped", "start", ""),
    ("The same, trained on", "ours-warped", "ours", ""),
)
"""Heading, the new way, the old way, and which of his experiments it repeats."""
_HIS = {"first": (fredriksson.HIERARCHY_RAW, fredriksson.SINGLE, fredriksson.FIRST),
        "second": (fredriksson.HIERARCHY, fredriksson.FEED_FORWARD, fredriksson.SECOND), "": (None, None, None)}

Found = Mapping[tuple[str, str, str], Mapping]
"""(data, variant, subject) -> what its run found."""


def document(found: Found, scale: Scale) -> list[str]:
    """All tables of what is done."""
    lines = [f"Scale {scale.name}: tested on {'all' if scale.motions is None else scale.motions} motions of each other "
             "subject; sizes and steps of Adam of each model stand in the next tables."]
    lines += ["", "### How all of them did", ""]
    for data, heading in WORDS.items():
        if any(key[0] == data for key in found):
            lines += [f"**{heading}**", "", *overview(found, data, scale), ""]
    for title, new, old, his in PAIRS:
        part = [line for data in WORDS for line in pair(found, data, new, old, _HIS[his])]
        if part:
            lines += [f"### {title}", "", *part]
    lines += everyone(found)
    return [*lines, "### Where his printed differences are not those of his figures", "",
            *(f"- {line}" for line in fredriksson.disagreements()), ""]


def of_variant(found: Found, data: str, variant: str) -> dict[str, Mapping]:
    """Subject -> what was found, of one variant."""
    return {subject: one for (kind, name, subject), one in sorted(found.items()) if (kind, name) == (data, variant)}


def subjects(found: Found, data: str, variant: str) -> Subjects | None:
    """The figures of one variant; None where nothing is done."""
    rows = [(subject, deviations(one), np.array([np.nan if each["impact"] is None else each["impact"]
                                                 for each in one["each"]] + [np.nan] * one["broken"]))
            for subject, one in of_variant(found, data, variant).items()]
    return gathered(variant, rows) if rows else None


def deviations(one: Mapping) -> np.ndarray:
    """(N, 4) m of all motions of a run, infinite where networks lost the body so far that no motion came out."""
    return np.array([each["deviation"] for each in one["each"]] + [[np.inf] * 4] * one["broken"]).reshape(-1, 4)


def pair(found: Found, data: str, new: str, old: str, his) -> list[str]:
    """One experiment with one kind of data; nothing where one of the two is missing."""
    ours, against = subjects(found, data, new), subjects(found, data, old)
    if ours is None or against is None or len(set(ours.subjects) & set(against.subjects)) < 2:
        return []
    his_new, his_old, printed = his if data == "planted" else (None, None, None)
    lines = [f"**{WORDS[data]}**", ""]
    if his[0] is not None:
        lines += [f"`{old}`:", "", *figure_table(against, his_old), "", f"`{new}`:", "", *figure_table(ours, his_new),
                  ""]
    return [*lines, f"`{new}` - `{old}`:", "", *test_table(ours, against, printed), "",
            *(f"{line}." for line in verdicts(ours, against)), ""]


def overview(found: Found, data: str, scale: Scale) -> list[str]:
    """One row per variant: means over its models."""
    lines = markdown.head([
        "variant", *(f"{name}, cm" for name in EFFECTOR_NAMES), "networks alone, cm", "as a body, cm", "bodies lost",
        "impact, m", "head, °", "head turns",
        "jerk", "beyond limits", "parameters", "units x layers", "steps of frames", "models",
    ])  # fmt: skip
    for variant in variants(scale):
        done = list(of_variant(found, data, variant.name).values())
        if done:
            lines.append(markdown.row([f"`{variant.name}`: {variant.words}", *_figures(done)]))
    return lines


def _figures(done: Sequence[Mapping]) -> list[str]:
    """Means over all motions of all models, without those that lost their body."""
    lost = lost_ones(np.concatenate([deviations(one) for one in done]))
    every = [each for one in done for each, gone in zip(one["each"], lost_ones(deviations(one))) if not gone]
    deviation, alone, body = (100.0 * np.array([each[key] for each in every]).reshape(-1, 4)
                              for key in ("deviation", "network", "body"))
    return [
        *(_mean(column, ".1f") for column in deviation.T), _mean(alone, ".1f"), _mean(body, ".1f"),
        f"{int(lost.sum())} of {len(lost)}", _mean([one["impact"] for one in every], ".2f"),
        *(_mean([each[key] for each in every], form) for key, form in (
            ("head", ".1f"), ("head_share", ".2f"), ("jerk", ".2f"), ("beyond", ".3f"))),
        f"{int(np.mean([one['parameters'] for one in done])):,}", *_trained(done), str(len(done)),
    ]  # fmt: skip


def _trained(done: Sequence[Mapping]) -> tuple[str, str]:
    """Sizes of the networks, and how many steps of how many frames they were trained; maps are not."""
    told = done[0]["training"]
    steps = sorted({one["training"]["steps"] for one in done})
    size = f"{told['units']} x {told['layers']}" if told["steps"] else "-"
    least_and_most = " to ".join(f"{count:,}" for count in dict.fromkeys((steps[0], steps[-1])))
    return size, f"{least_and_most} of {told['batch']}" if steps[-1] else "none"


def _mean(values, form: str) -> str:
    known = np.array([np.nan if value is None else value for value in np.ravel(values)], float)
    known = known[np.isfinite(known)]
    return format(float(known.mean()), form) if len(known) else "-"


def everyone(found: Found) -> list[str]:
    """Networks of one subject against networks of all others retargeted (§10.2), by the subject that is tested."""
    lines = []
    for data, heading in WORDS.items():
        for all_, one in (("start-everyone", "start"), ("ours-everyone", "ours")):
            mine = subjects(found, data, all_)
            if mine is None or not of_variant(found, data, one):
                continue
            other = by_tested(found, data, one, mine.subjects)
            lines += [f"**{heading}**, `{all_}` - `{one}`, by the subject that is tested:", "",
                      *test_table(mine, other), "",
                      *(f"{line}." for line in verdicts(mine, other)), ""]
    return ["### One network from all others (§10.2) or from one of them", "", *lines] if lines else []


def by_tested(found: Found, data: str, variant: str, tested: Sequence[str]) -> Subjects:
    """The figures of a variant's models by the subject that was tested, whoever they were trained on."""
    rows = []
    for name in tested:
        each = [e for one in of_variant(found, data, variant).values() for e in one["each"] if e["subject"] == name]
        if each:
            rows.append((name, np.array([e["deviation"] for e in each]),
                         np.array([np.nan if e["impact"] is None else e["impact"] for e in each])))
    return gathered(variant, rows)
