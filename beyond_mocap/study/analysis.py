"""Whether one system's motions look more natural than another's: one-sided tests and effect sizes (Faustino §5.1.2).

He tests all ratings as if each came from another person. They do not: one rater gives many. So the test that counts
here takes each rater's mean difference as one value, scenario against scenario; his is told beside it (`pooled_p`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base.errors import InputError
from ..evaluation.paired_tests import judged
from .answers import Answers
from .form import SAME, SCALE
from .order import Study

ALPHA = 0.05


@dataclass(frozen=True, eq=False)
class Shares:
    """How a group of answers is spread: counts (5,) of the ratings 1 to 5, mean and standard deviation (n - 1)."""

    name: str
    counts: np.ndarray
    mean: float
    sd: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Finding:
    """Whether `new` looks more natural than `old`.

    differences (N,): each rater's mean of new - old over the scenarios in which he answered to both: points of the
    scale, or, of pairs, 1 where he chose new, -1 old, 0 neither. mean, low, high: of them, with its 95 % interval
    (Student). t, degrees: the paired statistic. p: its one-sided p that new is no better; holm_p: raised for the number
    of findings (Holm 1979). wilcoxon_p: by signed ranks. normal_p: Shapiro and Wilk's of the differences. pooled_p: of
    all answers as if each had a rater of its own, by Welch's t, of pairs by the binomial distribution of choices. d:
    Cohen's d of the differences; delta: Cliff's, the share of pairs of ratings in which new is higher less that in
    which it is lower. NaN where there are too few."""

    new: str
    old: str
    differences: np.ndarray
    mean: float
    low: float
    high: float
    t: float
    degrees: int
    p: float
    wilcoxon_p: float
    normal_p: float
    pooled_p: float
    d: float
    delta: float
    holm_p: float = np.nan

    @property
    def better(self) -> bool:
        """Whether "no better" is rejected at ALPHA, for all findings together."""
        return bool(self.holm_p < ALPHA)


@dataclass(frozen=True, eq=False, kw_only=True)
class Analysis:
    """All that is found: by_system and by_scenario (title and its rows) of ratings, empty in a study of pairs;
    findings; notes: what to know of the raters."""

    study: Study
    answers: Answers
    by_system: tuple[Shares, ...]
    by_scenario: tuple[tuple[str, tuple[Shares, ...]], ...]
    findings: tuple[Finding, ...]
    notes: tuple[str, ...]


def analysed(study: Study, answers: Answers, better: Sequence[tuple[str, str]] = ()) -> Analysis:
    """The analysis. better: (new, old) systems of each hypothesis that new looks more natural; without any, the first
    system of the table against each other one; one that is named twice counts once. InputError for a system that the
    study has not."""
    hypotheses = list(dict.fromkeys(better)) or [(study.systems[0], other) for other in study.systems[1:]]
    for system in [name for pair in hypotheses for name in pair]:
        if system not in study.systems:
            raise InputError("--better", system, f"one of {', '.join(study.systems)}", "correct the name")
    if same := next((new for new, old in hypotheses if new == old), None):
        raise InputError("--better", f"{same} against itself", "two systems", "name another one")
    find = _of_pairs if study.pairs else _of_ratings
    findings = [find(study, answers, new, old) for new, old in hypotheses]
    raised = holm([finding.p for finding in findings])
    findings = [Finding(**{**vars(finding), "holm_p": p}) for finding, p in zip(findings, raised)]
    scenarios = () if study.pairs else study.scenarios
    return Analysis(study=study, answers=answers, by_system=() if study.pairs else _by_system(study, answers),
                    by_scenario=tuple((scenario, _by_system(study, answers, scenario)) for scenario in scenarios),
                    findings=tuple(findings), notes=tuple(_notes(study, answers)))  # fmt: skip


def holm(p: Sequence[float]) -> list[float]:
    """p values raised so that all together err as rarely as one (Holm 1979), in their order; NaN stays."""
    known = sorted((place for place, value in enumerate(p) if np.isfinite(value)), key=lambda place: p[place])
    out, least = [float("nan")] * len(p), 0.0
    for order, place in enumerate(known):
        least = max(least, min(1.0, (len(known) - order) * p[place]))
        out[place] = least
    return out


def cliffs_delta(new: np.ndarray, old: np.ndarray) -> float:
    """(share of pairs with new above old) - (share below), of values (N,) and (M,): -1 to 1, 0 where nothing tells them
    apart (Cliff 1993)."""
    if not len(new) or not len(old):
        return float("nan")
    return float(np.sign(np.subtract.outer(np.asarray(new, float), np.asarray(old, float))).mean())


def welch(new: np.ndarray, old: np.ndarray) -> float:
    """One-sided p that the mean of `new` (N,) is no larger than that of `old` (M,), which may scatter otherwise (Welch
    1947); NaN where one has fewer than two values or neither scatters."""
    from scipy.stats import t as student

    if min(len(new), len(old)) < 2 or max(np.ptp(new), np.ptp(old)) <= 0.0:
        return float("nan")
    parts = np.array([new.var(ddof=1) / len(new), old.var(ddof=1) / len(old)])
    degrees = parts.sum() ** 2 / np.sum(parts**2 / [len(new) - 1, len(old) - 1])
    return float(student.sf((new.mean() - old.mean()) / np.sqrt(parts.sum()), degrees))


def _of_ratings(study: Study, answers: Answers, new: str, old: str) -> Finding:
    table = {clip.name: clip for clip in study.clips}
    each, every = [], {new: [], old: []}
    for rater in answers.raters:
        given = {(table[name].system, table[name].scenario): value for name, value in answers.ratings[rater].items()}
        off = [given[new, s] - given[old, s] for s in study.scenarios if (new, s) in given and (old, s) in given]
        if off:
            each.append(np.mean(off))
        for system, values in every.items():
            values += [value for (own, _), value in given.items() if own == system]
    a, b = (np.array(every[system], float) for system in (new, old))
    return _finding(new, old, np.array(each, float), welch(a, b), cliffs_delta(a, b))


def _of_pairs(study: Study, answers: Answers, new: str, old: str) -> Finding:
    from scipy.stats import binomtest

    table = {clip.name: clip for clip in study.clips}
    each, votes = [], []
    for rater in answers.raters:
        own = []
        for shown, chosen in answers.choices[rater].items():
            if {table[name].system for name in shown} == {new, old}:
                own.append(0.0 if chosen == SAME else 1.0 if table[chosen].system == new else -1.0)
        if own:
            each.append(np.mean(own))
        votes += [vote for vote in own if vote]
    won = votes.count(1.0)
    pooled = float(binomtest(won, len(votes), 0.5, "greater").pvalue) if votes else np.nan
    delta = (2 * won - len(votes)) / len(votes) if votes else np.nan
    return _finding(new, old, np.array(each, float), pooled, delta)


def _finding(new: str, old: str, off: np.ndarray, pooled: float, delta: float) -> Finding:
    """The paired tests of raters' differences (N,)."""
    from scipy.stats import t as student

    count = len(off)
    mean = float(off.mean()) if count else np.nan
    sd = float(off.std(ddof=1)) if count > 1 else np.nan
    varies = count > 1 and np.ptp(off) > 1e-12
    tests = judged(-off)  # of what is to be smaller
    half = float(student.ppf(0.975, count - 1)) * sd / np.sqrt(count) if varies else np.nan
    return Finding(new=new, old=old, differences=off, mean=mean, low=mean - half, high=mean + half,
                   t=mean / (sd / np.sqrt(count)) if varies else np.nan, degrees=max(count - 1, 0), p=tests.t_p,
                   wilcoxon_p=tests.wilcoxon_p, normal_p=tests.normal, pooled_p=pooled,
                   d=mean / sd if varies else np.nan, delta=delta)  # fmt: skip


def _shares(name: str, values: list[int]) -> Shares:
    counts = np.bincount(np.array(values, int), minlength=len(SCALE) + 1)[1:]
    mean = float(np.mean(values)) if values else np.nan
    return Shares(name, counts, mean, float(np.std(values, ddof=1)) if len(values) > 1 else np.nan)


def _by_system(study: Study, answers: Answers, scenario: str | None = None) -> tuple[Shares, ...]:
    """All ratings of each system, of one scenario or of all."""
    out = []
    for system in study.systems:
        names = {clip.name for clip in study.clips if clip.system == system and scenario in (None, clip.scenario)}
        rated = (answers.ratings[rater].items() for rater in answers.raters)
        out.append(_shares(system, [value for row in rated for name, value in row if name in names]))
    return tuple(out)


def _notes(study: Study, answers: Answers) -> list[str]:
    """What to know of the raters: how many, who is missing, who always says the same."""
    silent = [rater for rater in study.orders if rater not in answers.raters]
    notes = [f"{len(answers.raters)} of {len(study.orders)} raters answered"]
    if silent:
        notes.append(f"without an answer: {', '.join(silent)}")
    if answers.missing:
        notes.append(f"{answers.missing} answers that count are missing; what is there is used")
    if len(answers.raters) < 6:
        notes.append("fewer than six raters: the tests say little")
    for rater in answers.raters:
        given = [*answers.ratings[rater].values(), *answers.choices[rater].values()]
        if len(given) > 4 and len(set(given)) == 1:
            notes.append(f"{rater} gave every clip the same answer")
    return notes
