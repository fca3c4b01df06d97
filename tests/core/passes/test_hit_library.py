"""Hit motions of a whole library: found, told apart, matched with an example, and linked."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.files.bvh import bvh
from beyond_mocap.library.build import build_library
from beyond_mocap.motion.motion import place_motion
from beyond_mocap.passes.hit_library import HitLibrary, MatchWeights
from beyond_mocap.passes.hits import detect_hits
from beyond_mocap.passes.pass_scene import KINDS
from beyond_mocap.passes.pose_distance import BoneWeights, align_poses
from beyond_mocap.synthetic.gait import build_gait
from beyond_mocap.synthetic.gestures import build_strike
from beyond_mocap.synthetic.moves import build_header


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Three right kicks of different strength, a header, a walk and standing."""
    folder = tmp_path_factory.mktemp("hits")
    for name, made, words in (
        ("inside", build_strike("kick low inside", fps=60.0), "kick low inside right"),
        ("slow", build_strike("kick low inside", fps=30.0, speed=0.8), "kick low inside right"),
        ("top", build_strike("kick low top", fps=60.0), "kick low top right"),
        ("header", build_header(fps=60.0), "header standing"),
    ):
        bvh.write_bvh(folder / f"{name}.bvh", made.motion)
        (folder / f"{name}.txt").write_text(
            f"{made.start:.3f} {made.end:.3f} {words}\n{made.key:.3f} {words}\n"
        )
    bvh.write_bvh(folder / "walk.bvh", build_gait(1.4, 3.0, 30.0))
    (folder / "walk.txt").write_text("0 3 walking\n")
    bvh.write_bvh(folder / "stand.bvh", build_gait(0.0, 3.0, 30.0))
    (folder / "stand.txt").write_text("0 3 standing\n")
    return folder


@pytest.fixture(scope="module")
def library(folder):
    return build_library(folder)


@pytest.fixture(scope="module")
def kicks(library):
    return HitLibrary.from_library(library, "foot")


def name_of(library, kicks, number):
    return library.clips[kicks.hits[number].clip].path


def test_both_feet_can_do_what_one_was_seen_to_do(library, kicks):
    assert len(kicks) == 6 and sorted(kicks.sides) == ["left"] * 3 + ["right"] * 3
    assert all(library.clips[one.clip].mirrored == (one.hit.side == "left") for one in kicks.hits)


def test_the_words_moment_is_the_key(library, kicks):
    for one in kicks.hits:
        clip = library.clips[one.clip]
        assert one.is_labelled and one.hit.key == next(row.key for row in clip.annotations if row.key is not None)
        assert one.hit.ball_stretch[0] <= one.hit.key <= one.hit.ball_stretch[1]


def test_a_touch_that_words_name_is_there_though_it_is_slow(tmp_path):
    """A trap: the foot hardly moves, and the analysis sees nothing."""
    bvh.write_bvh(tmp_path / "trap.bvh", build_gait(0.6, 3.0, 30.0))
    (tmp_path / "trap.txt").write_text(
        "0 3 walking\n1 2 receive foot right standing\n1.5 receive foot right standing\n"
    )
    found = HitLibrary.from_library(build_library(tmp_path), "foot")
    assert [(one.hit.side, one.hit.key, one.is_labelled) for one in found.hits] == [
        ("right", 45, True), ("left", 45, True)
    ]  # fmt: skip
    assert all(30 <= one.hit.first < 45 < one.hit.last <= 60 for one in found.hits)
    assert found.sort_by_kind("toss")[0] in (0, 1)


def test_each_part_has_its_own(library):
    heads = HitLibrary.from_library(library, "head")
    assert {name_of(library, heads, number) for number in range(len(heads))} == {"header.bvh"}
    with pytest.raises(InputError, match="lacks"):
        HitLibrary.from_library(library, "tail")


def test_it_is_kept_beside_the_cache(library, kicks, monkeypatch):
    monkeypatch.setattr("beyond_mocap.passes.hit_library.detect_hits", None)
    again = HitLibrary.from_library(library, "foot")
    assert len(again) == len(kicks)
    for a, b in zip(again.hits, kicks.hits):
        assert (a.clip, a.is_labelled, a.hit.key, a.hit.side, a.hit.fasts) == (
            b.clip, b.is_labelled, b.hit.key, b.hit.side, b.hit.fasts
        )
        np.testing.assert_array_equal(a.hit.vectors, b.hit.vectors)


def test_a_damaged_file_is_worked_out_anew(folder, kicks, tmp_path):
    fresh = build_library(folder, cache_dir=tmp_path)
    assert len(HitLibrary.from_library(fresh, "foot")) == len(kicks)
    (kept,) = tmp_path.glob("hits_*.npz")
    kept.write_bytes(b"no array")
    assert len(HitLibrary.from_library(fresh, "foot")) == len(kicks)


def test_what_is_asked_of_is_kept_apart(folder, tmp_path):
    """Also where the file system does not tell large letters from small ones: a joint may be called Head."""
    fresh = build_library(folder, cache_dir=tmp_path)
    joint = next(name for name in fresh.skeleton.names if name.casefold() == "head")
    for part in ("head", joint if joint != "head" else "Neck"):
        HitLibrary.from_library(fresh, part)
    assert len({path.name.casefold() for path in tmp_path.glob("hits_*.npz")}) == 2


def test_an_example_finds_itself_and_then_its_like(library, kicks):
    """Equation 2 of each hit motion with itself is 0; the slower take of the same kick is nearer than another kick."""
    for number, one in enumerate(kicks.hits):
        order, distance = kicks.sort_by_similarity(one.hit)
        assert order[0] == number and distance[number] == pytest.approx(0.0, abs=1e-9)
    mine = [n for n in range(len(kicks)) if name_of(library, kicks, n) == "inside.bvh"]
    inside = next(n for n in mine if kicks.sides[n] == "right")
    order, _ = kicks.sort_by_similarity(kicks.hits[inside].hit, side="right")
    assert [name_of(library, kicks, n) for n in order] == ["inside.bvh", "slow.bvh", "top.bvh"]


def test_the_distance_is_equation_2(kicks):
    a, b = kicks.hits[0].hit, kicks.hits[2].hit
    weights = MatchWeights(speed=0.3, vector=0.7, time=2.0)
    expected = (
        0.3 * abs(a.max_speed - b.max_speed)
        + 0.7 * sum(np.linalg.norm(x - y) for x, y in zip(a.vectors, b.vectors))
        + 2.0 * sum(abs(x - y) for x, y in zip(a.times, b.times))
    )
    assert kicks.sort_by_similarity(a, weights)[1][2] == pytest.approx(expected)


def test_an_example_may_face_anywhere_and_be_of_another_size(library, kicks):
    one = kicks.hits[0]
    clip = library.clips[one.clip].motion
    turned = detect_hits(place_motion(clip, 2.4, (7.0, 1.0, 0.0)), "foot", one.hit.side).strongest
    child = replace(one.hit, size=0.5 * one.hit.size, max_speed=0.5 * one.hit.max_speed, vectors=0.5 * one.hit.vectors)
    assert kicks.sort_by_similarity(turned)[0][0] == kicks.sort_by_similarity(child)[0][0] == 0
    assert kicks.sort_by_similarity(child)[1][0] == pytest.approx(0.0, abs=1e-9)


def test_kinds_go_by_speed(kicks):
    slow, fast = int(np.argmin(kicks.speeds)), int(np.argmax(kicks.speeds))
    assert kicks.sort_by_kind("attack")[0] in np.flatnonzero(kicks.speeds == kicks.speeds[fast])
    assert kicks.sort_by_kind("toss")[0] in np.flatnonzero(kicks.speeds == kicks.speeds[slow])  # the nearest to one
    assert set(kicks.kinds) <= set(KINDS) and len(kicks.sort_by_kind("pass", "left")) == 3


def test_aligned_poses_do_not_know_where_the_body_is(library):
    motion, frames = library.clips[0].motion, np.array([10.0, 20.5, 31.0])
    here, there = align_poses(motion, frames), align_poses(place_motion(motion, 1.9, (3.0, 4.0, 0.0)), frames)
    for a, b in zip(here, there):
        np.testing.assert_allclose(a, b, atol=1e-9)
    np.testing.assert_allclose(here[0][:, 0, :2], 0.0, atol=1e-12)


def test_weights_that_make_no_sense_are_refused():
    with pytest.raises(InputError, match="6 numbers"):
        BoneWeights((1.0, 2.0))


def test_a_library_without_hits_matches_nothing(library):
    order, distance = HitLibrary("foot", ()).sort_by_similarity(HitLibrary.from_library(library).hits[0].hit)
    assert len(order) == len(distance) == 0
