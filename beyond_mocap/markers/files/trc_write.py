"""Trials written as TRC files: millimetres, Y up, as OpenSim reads them."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from ...files.whole import atomic_write
from ..trial import MarkerTrial

_PLACE = "%.4f\t%.4f\t%.4f"


def write_trc(trial: MarkerTrial, path: str | os.PathLike) -> None:
    """Write a trial; cells of markers that are not seen stay empty. InputError where it cannot be written."""
    atomic_write(path, trc_text(trial, Path(path).name))


def trc_text(trial: MarkerTrial, name: str = "") -> str:
    """The text of a TRC file; `name` stands in its first line."""
    labels = [" ".join(label.split()) for label in trial.labels]
    count, rate = len(labels), f"{trial.fps:.6f}"
    head = [
        f"PathFileType\t4\t(X/Y/Z)\t{name or trial.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate}\t{rate}\t{len(trial)}\t{count}\tmm\t{rate}\t1\t{len(trial)}",
        "Frame#\tTime\t" + "\t".join(f"{label}\t\t" for label in labels),
        "\t\t" + "\t".join(f"X{i}\tY{i}\tZ{i}" for i in range(1, count + 1)),
        "",
    ]
    places = 1000.0 * trial.positions[..., [0, 2, 1]] * np.array([1.0, 1.0, -1.0])
    rows = [f"{i}\t{seconds:.7f}\t{_cells(frame, seen)}"
            for i, (seconds, frame, seen) in enumerate(zip(trial.seconds, places, trial.seen), 1)]  # fmt: skip
    return "\n".join([*head, *rows, ""])


def _cells(places: np.ndarray, seen: np.ndarray) -> str:
    """One frame's (M, 3) places in millimetres; empty cells where a marker is not seen."""
    if seen.all():
        return "\t".join([_PLACE] * len(seen)) % tuple(places.ravel().tolist())
    return "\t".join(_PLACE % tuple(place) if there else "\t\t" for place, there in zip(places.tolist(), seen))
