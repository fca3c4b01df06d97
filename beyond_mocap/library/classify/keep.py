"""A classifier in a file: one `.npz` of plain arrays and a header in JSON, never pickled, checked when it is read."""

from __future__ import annotations

import io
import json
import os
from pathlib import Path

import numpy as np

from ...base.errors import InputError
from ...files.whole import atomic_write
from .classifier import Act, Classifier
from .details import Details
from .kernel import Kernel
from .signals import LENGTH, STRIKES, Space

VERSION = 1
NAME = "learned_words.npz"
"""The file's name beside a library's cache."""

_LARGEST = 256 * 1024 * 1024
_NEXT = "learn from annotated clips again"


def write(path: str | os.PathLike, known: Classifier) -> None:
    """Writes a classifier whole; InputError where it cannot be written."""
    arrays = {"mean": known.space.mean, "scale": known.space.scale, "basis": known.space.basis}
    for number, act in enumerate(known.acts):
        arrays[f"{number}.supports"], arrays[f"{number}.weights"] = act.kernel.supports, act.kernel.weights
        arrays[f"{number}.sure"] = act.weights
        for group, plane in enumerate(act.details.planes):
            arrays[f"{number}.plane.{group}"] = plane
    header = {"version": VERSION, "clips": known.clips, "acts": [_header(act) for act in known.acts]}
    arrays["header"] = np.frombuffer(json.dumps(header).encode(), np.uint8)
    out = io.BytesIO()
    np.savez_compressed(out, **arrays)
    atomic_write(path, out.getvalue())


def read(path: str | os.PathLike) -> Classifier:
    """The classifier in a file; InputError where it is missing, damaged, or of another version."""
    path = Path(path)
    try:
        if path.stat().st_size > _LARGEST:
            raise InputError(path, "more than 256 MiB", "a file of learned words", _NEXT)
        with np.load(path, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
        header = json.loads(arrays["header"].tobytes())
        version = header["version"]
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError(path, "no such file", "a file of learned words", _NEXT) from None
    except Exception:  # a damaged file can fail in any of zipfile's, numpy's and json's own ways
        raise InputError(path, "a file that cannot be read", "a file of learned words", _NEXT) from None
    if version != VERSION:
        raise InputError(path, f"version {version!r}", f"version {VERSION}", _NEXT)
    try:
        return _restored(header, arrays)
    except (LookupError, TypeError, ValueError, AttributeError, OverflowError):
        raise InputError(path, "numbers that do not belong together", "a file of learned words", _NEXT) from None


def _header(act: Act) -> dict:
    return {
        "word": act.word, "moment": act.moment, "shift": act.kernel.shift, "gamma": act.kernel.gamma,
        "silent": act.silent, "shown": act.shown, "strike": act.strike, "lead": act.lead,
        "before": act.before, "after": act.after,
        "choices": act.details.choices, "by_rule": act.details.by_rule,
    }


def _restored(header: dict, arrays: dict) -> Classifier:
    """ValueError where a shape or number is out of order."""
    components = arrays["basis"].shape[1]
    mean, scale = _array(arrays, "mean", (LENGTH,)), _array(arrays, "scale", (LENGTH,))
    space = Space(mean, scale, _array(arrays, "basis", (LENGTH, components)))
    if np.any(scale <= 0.0) or not header["acts"]:
        raise ValueError("scale")
    acts = tuple(_act(number, one, arrays, components) for number, one in enumerate(header["acts"]))
    return Classifier(space, acts, int(header["clips"]))


def _act(number: int, header: dict, arrays: dict, components: int) -> Act:
    count = len(arrays[f"{number}.weights"])
    if not count or not _word(header["word"]):
        raise ValueError("act")
    supports = _array(arrays, f"{number}.supports", (count, components))
    kernel = Kernel(supports, _array(arrays, f"{number}.weights", (count,)), _number(header["shift"]),
                    _number(header["gamma"], least=0.0))
    choices = tuple(tuple(_word(word) for word in group) for group in header["choices"])
    planes = tuple(_array(arrays, f"{number}.plane.{group}", (len(words), components + 1))
                   for group, words in enumerate(choices))
    by_rule = tuple(bool(one) for one in header["by_rule"])
    strike = int(header["strike"])
    if len(by_rule) != len(choices) or not -1 <= strike < len(STRIKES) or not all(choices):
        raise ValueError("header")
    before, after = (_number(header[name], least=0.0) for name in ("before", "after"))
    return Act(word=_word(header["word"]), moment=bool(header["moment"]), kernel=kernel,
               weights=_array(arrays, f"{number}.sure", (3,)), silent=_number(header["silent"]),
               shown=_number(header["shown"]), strike=strike, lead=_number(header["lead"]), before=before, after=after,
               details=Details(choices, planes, by_rule))


def _array(arrays: dict, name: str, shape: tuple[int, ...]) -> np.ndarray:
    found = arrays[name]
    if found.shape != shape or found.dtype.kind != "f" or not np.all(np.isfinite(found)):
        raise ValueError(name)
    return found


def _number(value, least: float = -1e6) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not least <= value < 1e6:
        raise ValueError("number")
    return float(value)


def _word(value) -> str:
    if not isinstance(value, str) or any(not (letter.isalnum() or letter in "_-") for letter in value):
        raise ValueError("word")
    return value
