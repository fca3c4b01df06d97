"""Where a hand is, frame by frame: by its joint of a solved motion, and sharper by the markers that it carries.

A solved motion is filtered, which takes off the very peak that a throw is about; the hand's markers are not. Where at
least three markers near the wrist are seen, the hand's frame is the one that carries them (eq. 3.14), else the
motion's.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...motion.hand import Hand
from ..frames import rigid_fit
from ..trial import MarkerTrial

NEAR = 0.14
"""m from the wrist within which a marker belongs to the hand."""
_PASSES = 4
_LIFTS = sorted(np.arange(-40, 41) / 100.0, key=abs)  # m
_BEHIND = 0.02  # m nearer to the elbow than the wrist is, where the forearm's markers begin
_KNUCKLES = (0.055, 0.115)  # m from the wrist: a marker there sits on the metacarpals' heads
_REACH_OF_KNUCKLES = 2.22  # fingers are 1.22 times the third metacarpal, Buchholz et al. 1992 (see `without_ball`)
_TORN = 4.0  # times the usual misfit of the hand's markers, above which one of them is not where it should be
_STEADY = 0.012  # m, spread in the hand's frame below which a marker is the hand's


def sharpened(hand: Hand, trial: MarkerTrial, never: tuple[str, ...] = ()) -> Hand:
    """The hand as its own markers have it, in every frame in which they tell.

    trial: as many frames, at even times. never: labels that are no part of the hand (the ball's). A constant shift of
    the motion against the markers, as setting feet on the floor makes, is found and taken off.
    """
    lift = _lift(hand, trial, never)
    names, seen = _near(replace(hand, origin=hand.origin + lift, elbow=hand.elbow + lift), trial, never)
    if not names:
        return hand
    shift = lift
    for _ in range(_PASSES):
        local = np.einsum("tji,tmj->tmi", hand.rotation, seen - (hand.origin + shift)[:, None, :])
        places = np.nanmedian(local, axis=0)
        shift = shift + np.nanmedian(seen - _placed(hand, shift, places), axis=(0, 1))
    moved = replace(hand, origin=hand.origin + shift, elbow=hand.elbow + shift, shift=shift)
    fit = rigid_fit(places, seen)
    tells = fit.sound & (fit.rms < max(_TORN * _usual(fit.rms), _STEADY))
    known = np.isfinite(seen).all(axis=-1) & ~(fit.sound & ~tells)[:, None]
    off = np.where(known[..., None], seen - _placed(hand, shift, places), 0.0).sum(axis=1)
    off = off / np.maximum(known.sum(axis=1), 1)[:, None]  # one or two markers move it, and cannot turn it
    return replace(
        moved,
        reach=_reach(hand, places),
        origin=np.where(tells[:, None], fit.shift, moved.origin + off),
        rotation=np.where(tells[:, None, None], fit.rotation, moved.rotation),
        markers=names,
    )


def _usual(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else 0.0


def _reach(hand: Hand, places: np.ndarray) -> float:
    """m from wrist to fingertip: the skeleton's, and what a marker on the knuckles tells, each as good as the other."""
    along = places @ hand.finger
    knuckles = along[(along > _KNUCKLES[0]) & (along < _KNUCKLES[1])]
    return hand.reach if not len(knuckles) else 0.5 * (hand.reach + _REACH_OF_KNUCKLES * float(np.median(knuckles)))


def _placed(hand: Hand, shift: np.ndarray, places: np.ndarray) -> np.ndarray:
    return (hand.origin + shift)[:, None, :] + np.einsum("tij,mj->tmi", hand.rotation, places)


def _lift(hand: Hand, trial: MarkerTrial, never: tuple[str, ...]) -> np.ndarray:
    """(3,) m, upwards: by what the motion stands too low for the markers, as far as their distances from the wrist
    tell: those of the hand's own markers do not change."""
    often = np.count_nonzero(trial.seen[:: max(len(trial) // 300, 1)], axis=0) > 2
    kept = [number for number, label in enumerate(trial.labels) if label not in never and often[number]]
    few = trial.positions[:: max(len(trial) // 300, 1), kept]
    if not kept:
        return np.zeros(3)
    origin = hand.origin[:: max(len(trial) // 300, 1), None, :]
    near = np.flatnonzero(np.nanmedian(np.linalg.norm(few[..., :2] - origin[..., :2], axis=-1), axis=0) < NEAR)
    best, found = np.inf, 0.0
    for height in _LIFTS if len(near) >= 3 else ():
        away = np.linalg.norm(few[:, near] - origin - [0.0, 0.0, height], axis=-1)
        spread = np.sort(np.nanstd(away, axis=0))[:3].sum()
        if spread < best:
            best, found = spread, height
    return np.array([0.0, 0.0, found])


def _near(hand: Hand, trial: MarkerTrial, never: tuple[str, ...]) -> tuple[tuple[str, ...], np.ndarray]:
    """Labels of the markers that stay with the hand, and their places (T, M, 3) m."""
    away = np.linalg.norm(trial.positions - hand.origin[:, None, :], axis=-1)
    forearm = float(np.median(np.linalg.norm(hand.origin - hand.elbow, axis=-1)))
    kept = []
    for number, label in enumerate(trial.labels):
        known = np.isfinite(away[:, number])
        if label in never or np.count_nonzero(known) < max(0.3 * len(trial), 1):
            continue
        distance = away[known, number]
        spread = np.subtract(*np.percentile(distance, [90, 10]))
        arm = np.median(np.linalg.norm(trial.positions[known, number] - hand.elbow[known], axis=-1))
        if np.median(distance) < NEAR and spread < 3.0 * _STEADY and arm > forearm - _BEHIND:
            kept.append(number)
    return tuple(trial.labels[number] for number in kept), trial.positions[:, kept]

