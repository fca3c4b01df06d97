"""Test whether one system's motions look more natural than another's: one-sided tests, effect sizes (Faustino §5.1.2).

Faustino tests all ratings as if each came from another person, but one rater gives many. The main test here takes each
rater's mean difference as one value, scenario by scenario; Faustino's is reported beside it (`pooled_p`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base.errors import InputError
from ..evaluation.paired_tests import compare_differences
from .answers import Answers
from .form import SAME, SCALE
from .order import Study

ALPHA = 0.05  # significance level, for all hypotheses of a study together


@dataclass(frozen=True, eq=False)
class Shares:
    """The distribution of a group of answers.

    Attributes:
        name: name of the group.
        counts: (5,) number of each rating, 1 to 5.
        mean, sd: mean and standard deviation (divided by n - 1).
    """

    name: str
    counts: np.ndarray
    mean: float
    sd: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Finding:
    """The result of one hypothesis: `new` looks more natural than `old`. NaN where there is too little data.

    Attributes:
        new, old: the two systems.
        differences: (N,) each rater's mean of new - old over the scenarios in which they answered to both: points of
            the scale or, in a study of pairs, 1 for new chosen, -1 for old, 0 for neither.
        mean, low, high: mean of the differences with its 95 % interval (Student).
        t, degrees: the paired statistic and its degrees of freedom.
        p: one-sided p that new is no better.
        wilcoxon_p: the same by signed ranks.
        normal_p: p of Shapiro and Wilk's test of the differences.
        pooled_p: p of all answers as if each had a rater of its own: Welch's t, or for pairs the binomial distribution
            of choices.
        d: Cohen's d of the differences.
        delta: Cliff's delta, the share of pairs of ratings with new higher minus the share with new lower.
        holm_p: p adjusted for the number of hypotheses (Holm 1979).
    """

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
    """All results of a study.

    Attributes:
        study, answers: the study and the raters' answers.
        by_system: ratings of each system; empty in a study of pairs.
        by_scenario: each scenario's title and its ratings of each system; empty in a study of pairs.
        findings: one for each hypothesis.
        notes: what to know about the raters, one line each.
    """

    study: Study
    answers: Answers
    by_system: tuple[Shares, ...]
    by_scenario: tuple[tuple[str, tuple[Shares, ...]], ...]
    findings: tuple[Finding, ...]
    notes: tuple[str, ...]


def analyse_study(study: Study, answers: Answers, better: Sequence[tuple[str, str]] = ()) -> Analysis:
    """Analyse the answers to a study.

    Args:
        study: the study.
        answers: the raters' answers.
        better: (new, old) systems of each hypothesis that new looks more natural; without any, the first system of the
            table against each other one. Duplicates count once.
    Returns:
        The analysis.
    Raises:
        InputError: if the study lacks a system, or a hypothesis names one system twice.
    """
    hypotheses = list(dict.fromkeys(better)) or [(study.systems[0], other) for other in study.systems[1:]]
    for system in [name for pair in hypotheses for name in pair]:
        if system not in study.systems:
            raise InputError("system", system, f"one of {', '.join(study.systems)}", "correct the name")
    if repeated := next((new for new, old in hypotheses if new == old), None):
        raise InputError("hypothesis", f"{repeated} against itself", "two systems", "name another one")
    find = _compare_choices if study.pairs else _compare_ratings
    findings = [find(study, answers, new, old) for new, old in hypotheses]
    adjusted = adjust_holm([finding.p for finding in findings])
    findings = [Finding(**{**vars(finding), "holm_p": p}) for finding, p in zip(findings, adjusted)]
    scenarios = () if study.pairs else study.scenarios
    return Analysis(study=study, answers=answers, by_system=() if study.pairs else _count_by_system(study, answers),
                    by_scenario=tuple((scenario, _count_by_system(study, answers, scenario)) for scenario in scenarios),
                    findings=tuple(findings), notes=tuple(_list_notes(study, answers)))  # fmt: skip


def adjust_holm(p: Sequence[float]) -> list[float]:
    """Adjust p values so that all hypotheses together have the error rate of one (Holm 1979).

    Args:
        p: the p values; NaN stays NaN.
    Returns:
        The adjusted values, in the same order.
    """
    # From the smallest p up: multiply by the number of hypotheses left, never below a previous one.
    known = sorted((place for place, value in enumerate(p) if np.isfinite(value)), key=lambda place: p[place])
    out, least = [float("nan")] * len(p), 0.0
    for order, place in enumerate(known):
        least = max(least, min(1.0, (len(known) - order) * p[place]))
        out[place] = least
    return out


def compute_cliffs_delta(new: np.ndarray, old: np.ndarray) -> float:
    """Compute Cliff's delta: the share of pairs with new above old minus the share below (Cliff 1993).

    Args:
        new: (N,) ratings.
        old: (M,) ratings.
    Returns:
        -1 to 1, 0 for no difference; NaN without ratings.
    """
    if not len(new) or not len(old):
        return float("nan")
    return float(np.sign(np.subtract.outer(np.asarray(new, float), np.asarray(old, float))).mean())


def compute_welch_p(new: np.ndarray, old: np.ndarray) -> float:
    """Compute the one-sided p that the mean of `new` is no larger than that of `old`, with unequal variances (Welch
    1947).

    Args:
        new: (N,) values.
        old: (M,) values.
    Returns:
        p; NaN where one has fewer than two values or neither varies.
    """
    from scipy.stats import t as student

    if min(len(new), len(old)) < 2 or max(np.ptp(new), np.ptp(old)) <= 0.0:
        return float("nan")
    parts = np.array([new.var(ddof=1) / len(new), old.var(ddof=1) / len(old)])
    degrees = parts.sum() ** 2 / np.sum(parts**2 / [len(new) - 1, len(old) - 1])
    return float(student.sf((new.mean() - old.mean()) / np.sqrt(parts.sum()), degrees))


def _compare_ratings(study: Study, answers: Answers, new: str, old: str) -> Finding:
    """Build the finding of two systems from ratings."""
    table = {clip.name: clip for clip in study.clips}
    differences, ratings = [], {new: [], old: []}
    for rater in answers.raters:
        rated = {(table[name].system, table[name].scenario): value for name, value in answers.ratings[rater].items()}
        off = [rated[new, s] - rated[old, s] for s in study.scenarios if (new, s) in rated and (old, s) in rated]
        if off:
            differences.append(np.mean(off))
        for system, values in ratings.items():
            values += [value for (own, _), value in rated.items() if own == system]
    a, b = (np.array(ratings[system], float) for system in (new, old))
    return _build_finding(new, old, np.array(differences, float), compute_welch_p(a, b), compute_cliffs_delta(a, b))


def _compare_choices(study: Study, answers: Answers, new: str, old: str) -> Finding:
    """Build the finding of two systems from choices between pairs."""
    from scipy.stats import binomtest

    table = {clip.name: clip for clip in study.clips}
    differences, votes = [], []
    for rater in answers.raters:
        rater_votes = []
        for shown, chosen in answers.choices[rater].items():
            if {table[name].system for name in shown} == {new, old}:
                rater_votes.append(0.0 if chosen == SAME else 1.0 if table[chosen].system == new else -1.0)
        if rater_votes:
            differences.append(np.mean(rater_votes))
        votes += [vote for vote in rater_votes if vote]
    won = votes.count(1.0)
    pooled = float(binomtest(won, len(votes), 0.5, "greater").pvalue) if votes else np.nan
    delta = (2 * won - len(votes)) / len(votes) if votes else np.nan
    return _build_finding(new, old, np.array(differences, float), pooled, delta)


def _build_finding(new: str, old: str, differences: np.ndarray, pooled: float, delta: float) -> Finding:
    """Build a finding from the raters' differences (N,) by paired tests."""
    from scipy.stats import t as student

    count = len(differences)
    mean = float(differences.mean()) if count else np.nan
    sd = float(differences.std(ddof=1)) if count > 1 else np.nan
    varies = count > 1 and np.ptp(differences) > 1e-12
    tests = compare_differences(-differences)  # the tests expect negative differences
    half = float(student.ppf(0.975, count - 1)) * sd / np.sqrt(count) if varies else np.nan
    return Finding(new=new, old=old, differences=differences, mean=mean, low=mean - half, high=mean + half,
                   t=mean / (sd / np.sqrt(count)) if varies else np.nan, degrees=max(count - 1, 0), p=tests.t_p,
                   wilcoxon_p=tests.wilcoxon_p, normal_p=tests.normal, pooled_p=pooled,
                   d=mean / sd if varies else np.nan, delta=delta)  # fmt: skip


def _compute_shares(name: str, values: list[int]) -> Shares:
    counts = np.bincount(np.array(values, int), minlength=len(SCALE) + 1)[1:]
    mean = float(np.mean(values)) if values else np.nan
    return Shares(name, counts, mean, float(np.std(values, ddof=1)) if len(values) > 1 else np.nan)


def _count_by_system(study: Study, answers: Answers, scenario: str | None = None) -> tuple[Shares, ...]:
    """Count the ratings of each system, in one scenario or in all."""
    out = []
    for system in study.systems:
        names = {clip.name for clip in study.clips if clip.system == system and scenario in (None, clip.scenario)}
        rated = (answers.ratings[rater].items() for rater in answers.raters)
        out.append(_compute_shares(system, [value for row in rated for name, value in row if name in names]))
    return tuple(out)


def _list_notes(study: Study, answers: Answers) -> list[str]:
    """List what to know about the raters: how many answered, who is missing, who always gives the same answer."""
    silent = [rater for rater in study.orders if rater not in answers.raters]
    notes = [f"{len(answers.raters)} of {len(study.orders)} raters answered"]
    if silent:
        notes.append(f"without an answer: {', '.join(silent)}")
    if answers.missing:
        notes.append(f"missing answers: {answers.missing}; the others are used")
    if len(answers.raters) < 6:
        notes.append("fewer than six raters: the tests have little power")
    for rater in answers.raters:
        values = [*answers.ratings[rater].values(), *answers.choices[rater].values()]
        if len(values) > 4 and len(set(values)) == 1:
            notes.append(f"{rater} gave every clip the same answer")
    return notes
