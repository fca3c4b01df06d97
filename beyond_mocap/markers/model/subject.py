"""Models of several sessions become one of the subject: one skeleton, and each session's own markers on it (Fredriksson
§5.2.3).

A body's bones are the same on every day, only the markers lie elsewhere, and what is found of the bones differs by how
they lay. Segment by segment, from the root down, the sessions' frames are turned onto each other where the centres of
the joints below say that they differ; these centres are then averaged in the turned frames, those that are surer
counting more; and the markers of each session go along with their segment.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...base.errors import InputError
from ...motion.skeleton import Skeleton
from ..frames import rigid_fit
from .model import MarkerModel

_ROUNDS = 4
_SURE = 1e-4  # metres: no centre is surer


def subject_models(models: Sequence[MarkerModel]) -> tuple[MarkerModel, ...]:
    """The models of one subject's sessions, all with the same skeleton, in their order.

    InputError where they are none, or their joints differ: sessions of another marker set, or another body's.
    """
    if not models:
        raise InputError("models", "none given", "at least one")
    _check_alike(models)
    first = models[0].skeleton
    worth = np.array([1.0 / np.maximum(model.centre_sigma, _SURE) ** 2 for model in models])
    offsets = np.array([model.skeleton.offsets for model in models])
    mean = np.average(offsets, axis=0, weights=np.broadcast_to(worth[:, :, None], offsets.shape))
    turns = np.tile(np.eye(3), (len(models), len(first), 1, 1))
    for joint in range(len(first)):
        below = list(first.children(joint))
        if not below:
            continue
        for _ in range(_ROUNDS if len(below) > 1 else 1):
            for number in range(len(models)):
                turns[number, joint] = _turn_onto(offsets[number, below], mean[below], worth[number, below])
            turned = np.einsum("sij,snj->sni", turns[:, joint], offsets[:, below])
            mean[below] = np.average(turned, axis=0, weights=np.broadcast_to(worth[:, below, None], turned.shape))
    ends = np.mean([model.skeleton.end_offsets for model in models], axis=0)
    skeleton = Skeleton(first.names, first.parents, mean, first.end_parents, ends)
    sessions = tuple(dict.fromkeys(name for model in models for name in model.sessions))
    sigma = _agreement(worth, offsets, mean)
    return tuple(_on(model, skeleton, turn, sessions, sigma) for model, turn in zip(models, turns))


def _check_alike(models: Sequence[MarkerModel]) -> None:
    for model in models[1:]:
        one, other = models[0].skeleton, model.skeleton
        if (one.names, one.parents, one.end_parents) != (other.names, other.parents, other.end_parents):
            odd = sorted(set(one.names) ^ set(other.names))
            raise InputError("models", f"joints that not all sessions have: {', '.join(odd) or 'in another order'}",
                             "sessions of one subject with the same joints")  # fmt: skip


def _turn_onto(own: np.ndarray, mean: np.ndarray, worth: np.ndarray) -> np.ndarray:
    """The rotation (3, 3) about the joint that brings the centres below it (N, 3) nearest to their means: none for a
    single one, whose direction all frames share, as rest poses have it."""
    if len(own) < 2:
        return np.eye(3)
    joint, held = [[0.0, 0.0, 0.0]], np.r_[worth.max() * 100.0, worth]  # the joint itself stays
    fit = rigid_fit(np.vstack([joint, own]), np.vstack([joint, mean]), held)
    return fit.rotation if fit.sound else np.eye(3)


def _on(model: MarkerModel, skeleton: Skeleton, turn: np.ndarray, sessions, sigma) -> MarkerModel:
    """A session's model on the subject's skeleton: markers turn with their segment, and those along a bone that became
    longer or shorter keep their share of it."""
    places = np.einsum("mij,mj->mi", turn[model.joint], model.places)
    for joint in range(len(skeleton)):
        below = skeleton.children(joint)
        if len(below) != 1:
            continue
        old, new = model.skeleton.offsets[below[0]], skeleton.offsets[below[0]]
        mine = np.flatnonzero(model.joint == joint)
        share = np.clip(places[mine] @ old / max(old @ old, 1e-9), 0.0, 1.0)
        places[mine] += share[:, None] * (new - old)
    return replace(model, skeleton=skeleton, places=places, sessions=sessions, centre_sigma=sigma)


def _agreement(worth: np.ndarray, offsets: np.ndarray, mean: np.ndarray) -> np.ndarray:
    """(J,) m, how uncertain a centre is after averaging: what each session says of itself, or how far they differ."""
    told = 1.0 / np.sqrt(worth.sum(axis=0))
    apart = np.linalg.norm(np.sqrt(np.mean((offsets - mean) ** 2, axis=0)), axis=-1) / np.sqrt(len(offsets))
    return np.maximum(told, apart)
