"""Trials written as TRC files: millimetres, Y up, as OpenSim reads them."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from ..markers.trial import MarkerTrial
from .whole import atomic_write


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
    rows = [_row(i, seconds, frame) for i, (seconds, frame) in enumerate(zip(trial.seconds, places), 1)]
    return "\n".join([*head, *rows, ""])


def _row(number: int, seconds: float, places: np.ndarray) -> str:
    cells = (f"{value:.4f}" if np.isfinite(place).all() else "" for place in places for value in place)
    return f"{number}\t{seconds:.7f}\t" + "\t".join(cells)
