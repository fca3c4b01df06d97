"""Which clip stands for which gait: its speed and words are the gait's, and no other clip's locomotion carries it."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.base.settings.synthesis import parse_gait_clips
from beyond_mocap.library.automatic_locomotion import apply_chosen_gaits
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.synthesize import synthesize


@pytest.fixture(scope="module")
def chosen(library):
    return apply_chosen_gaits(library, {"walking": "bows/turn.bvh", "jogging": "jog.bvh"})


def carrying(library, word):
    column = library.frames.vocabulary.index(word)
    return {library.clips[i].path for i in np.unique(library.frames.clip[library.frames.words[:, column]])}


def test_without_a_choice_the_library_is_the_same(library):
    assert apply_chosen_gaits(library, {}) is library


def test_the_chosen_clip_says_the_gait(library, chosen):
    assert [g.labels for g in library.gaits if g.label == "walking"] == [("walking",)]
    walking, jogging = chosen.gaits[1:3]
    assert walking.labels == ("walking", "left") and walking.speed == pytest.approx(1.4, abs=0.1)
    assert jogging.labels == ("jogging",) and jogging.speed == pytest.approx(2.8, abs=0.1)


def test_no_other_clip_carries_the_word_but_for_actions(library, chosen):
    assert carrying(library, "walking") == {"walk.bvh", "bows/turn.bvh"} and carrying(chosen, "walking") == {
        "bows/turn.bvh"
    }
    assert carrying(chosen, "running") == {"run.bvh"}
    words, vocabulary = chosen.frames.words, chosen.frames.vocabulary
    clip = np.array([clip.path == "kick.bvh" for clip in chosen.clips])[chosen.frames.clip]
    kicks = words[:, vocabulary.index("kick")]
    assert np.array_equal(words[clip & kicks], library.frames.words[clip & kicks])
    assert not np.any(words[clip & ~kicks, vocabulary.index("jogging")])


@pytest.mark.parametrize("method", ["path", "distance"])
def test_a_take_walks_with_the_chosen_clip(library, track_of, method):
    played = {}
    for gaits in ((), (("walking", "bows/turn.bvh"),), (("walking", "walk.bvh"),)):
        take = synthesize(library, Plan(track=track_of(1.4), method=method, gaits=gaits))
        played[gaits] = np.mean([take.clips[clip] == "bows/turn.bvh" for clip in take.clip])
    bow, straight = (played[(("walking", name),)] for name in ("bows/turn.bvh", "walk.bvh"))
    assert bow > 0.9 and straight < 0.1


@pytest.mark.parametrize("gaits, parts", [
    ({"strolling": "walk.bvh"}, ["'strolling'", "walking"]),
    ({"walking": "wlk.bvh"}, ["'wlk.bvh'", "walk.bvh"]),
    ({"walking": "jog.bvh"}, ["jog.bvh", "'walking'", "bows/turn.bvh"]),
    ({"jogging": "kick.bvh", "walking": "kick.bvh"}, ["kick.bvh", "'walking'"]),
])
def test_a_wrong_choice_is_told_in_one_line(library, gaits, parts):
    with pytest.raises(InputError) as told:
        apply_chosen_gaits(library, gaits)
    assert "\n" not in str(told.value) and all(part in str(told.value) for part in parts), str(told.value)


def test_choices_as_text():
    assert parse_gait_clips(["walking = a/b.bvh", r"Jogging=c\d.bvh"]) == (("walking", "a/b.bvh"),
                                                                           ("jogging", "c/d.bvh"))
    for wrong in (["walking"], ["=a.bvh"], ["walking="], ["walking=a", "walking=b"]):
        with pytest.raises(InputError):
            parse_gait_clips(wrong)
