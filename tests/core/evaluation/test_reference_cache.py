"""What recordings score is kept beside a library's cache: the same bits back, and never anything damaged or foreign."""

import json
import shutil
from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest

from beyond_mocap.evaluation.reference import reference_cache
from beyond_mocap.evaluation.report import evaluate
from beyond_mocap.library import synthetic_clips
from beyond_mocap.library.build import build_library
from beyond_mocap.library.folder.recordings import CACHE_FOLDER

FPS = 30.0


@pytest.fixture
def folder(library, tmp_path):
    """A copy of the library and its cache, without a reference."""
    leave_out = shutil.ignore_patterns("reference*")
    return shutil.copytree(library.folder, tmp_path / "library", ignore=leave_out)


@pytest.fixture
def built(monkeypatch):
    """The frame rates of every reference that is measured."""
    rates, build = [], reference_cache.build_reference

    def count(library, fps):
        rates.append(fps)
        return build(library, fps)

    monkeypatch.setattr(reference_cache, "build_reference", count)
    return rates


def flatten(value) -> list:
    """Every plain value in nested records; arrays as type, shape and bytes."""
    if is_dataclass(value):
        return [part for field in fields(value) for part in flatten(getattr(value, field.name))]
    if isinstance(value, (tuple, list)):
        return [len(value), *(part for entry in value for part in flatten(entry))]
    array = np.asarray(value if not isinstance(value, dict) else list(value.items()))
    return [(array.dtype, array.shape, array.tobytes())]


def test_from_the_file_come_the_same_bits_and_the_same_report(folder, cut, built, monkeypatch):
    monkeypatch.setattr(synthetic_clips, "MAX_SPEED", 2.4)  # no synthetic runs, which would take half of the time
    take = cut(("walk.bvh", 20.0, 40), ("jog.bvh", 240.0, 80))
    first, again = build_library(folder), build_library(folder)
    reports = [json.dumps(evaluate(take, None, library)) for library in (first, again)]
    assert built == [FPS] and reports[0] == reports[1]
    a, b = (reference_cache.load_reference(library, FPS) for library in (first, again))
    assert a is not b and flatten(a) == flatten(b) and a.kicks and a.index == b.index
    completed = reference_cache.load_reference(again.with_synthetic_clips, FPS)  # recordings alone are measured
    assert built == [FPS] and flatten(completed) == flatten(a)


def test_another_rate_other_recordings_and_other_measures_have_their_own(folder, built, monkeypatch):
    reference_cache.load_reference(build_library(folder), FPS)
    reference_cache.load_reference(build_library(folder), 25.0)
    assert built == [FPS, 25.0]
    monkeypatch.setattr(reference_cache, "VERSION", 0)
    reference_cache.load_reference(build_library(folder), FPS)
    (folder / "run.bvh").unlink()
    index = reference_cache.load_reference(build_library(folder), FPS).index
    assert built == [FPS, 25.0, FPS, FPS] and "run.bvh" not in index


@pytest.mark.parametrize("damage", ["cut off", "a changed number", "another form", "fewer recordings", "a folder"])
def test_damaged_foreign_or_missing_it_is_measured_again(folder, built, damage):
    whole = reference_cache.load_reference(build_library(folder), FPS)
    place = folder / CACHE_FOLDER
    arrays = {file.stem: np.load(file) for file in place.glob("reference-*/*.npy")}
    file = next(place.glob("reference-*/sway.npy"))
    if damage == "cut off":
        file.write_bytes(file.read_bytes()[:-8])
    elif damage == "a changed number":
        file.write_bytes(file.read_bytes()[:-8] + b"12345678")
    elif damage == "a folder":  # it cannot be written either
        (place / "reference-30.json").unlink()
        (place / "reference-30.json").mkdir()
    else:
        lacks = {"another form": "courses.item.heading.count", "fewer recordings": ""}[damage]
        kept = {name: array[:1] if not lacks and name.startswith("rate") else array for name, array in arrays.items()
                if name != lacks}
        kept |= {} if lacks else {"rate.count": np.array([1])}
        reference_cache.cache.save_arrays(*reference_cache._find_place(build_library(folder), FPS), kept)
    again = reference_cache.load_reference(build_library(folder), FPS)
    assert built == [FPS, FPS] and flatten(again) == flatten(whole)


def test_a_library_that_was_changed_leaves_no_file(folder, built):
    changed = replace(build_library(folder), notes=())
    reference_cache.load_reference(changed, FPS)
    assert built == [FPS] and not list((folder / CACHE_FOLDER).glob("reference*"))
