"""Block search: words followed, key moments at exactly their frame, and strange orders served."""

from pathlib import Path

import numpy as np
import pytest

from beyond_mocap.base.errors import UserCancelledError
from beyond_mocap.library.build import build_library
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.resolve_plan import resolve_plan
from beyond_mocap.synthesis.search.block_costs import FITTED_ALPHA, AnnotationCost, rescale_alpha
from beyond_mocap.synthesis.search.blocks import FINEST_LENGTH, BlockSearch
from beyond_mocap.synthesis.search.distance import build_straight_edit, list_block_frames
from beyond_mocap.synthesis.search.request import build_request, library_frame

DATA = Path(__file__).resolve().parents[5] / "shared" / "data" / "mocap"


def shown(library, order, alpha=0.2):
    """Clip and library frame of every output frame as the search found them."""
    clip, frame = list_block_frames(BlockSearch(library, order, alpha).run())
    return clip[: len(order)], frame[: len(order)]


def words_shown(library, clip, frame):
    return [library.clips[c].labels_at(library.frames.source[f]) for c, f in zip(clip, frame)]


def measure_jumps(library, clip, frame):
    """How far features jump in all, from the frame that would follow to the one that is shown."""
    follows = np.minimum(frame[:-1] + 1, (library.frames.first + library.frames.count)[clip[:-1]] - 1)
    return np.linalg.norm(library.frames.features[frame[1:]] - library.frames.features[follows], axis=1).sum()


def own_clip(library, clip, frame):
    """Whether each frame lies inside its clip."""
    return (frame >= library.frames.first[clip]) & (frame < (library.frames.first + library.frames.count)[clip])


def test_every_frame_shows_a_clip_s_frame(library, order):
    clip, frame = shown(library, order())
    assert len(clip) == 241 and np.all(own_clip(library, clip, frame))


@pytest.mark.parametrize("time", [0.0, 0.03, 1.5, 3.97, 4.0, 4.27, 7.9, 8.0])
def test_a_key_moment_is_shown_at_exactly_its_frame(library, order, time):
    asked = order((time, "kick left"))
    clip, frame = shown(library, asked)
    at = int(round(asked.keys[0].frame))
    key = asked.keys[0].choices[0]
    assert clip[at] == key.clip and frame[at] == round(library_frame(library, key))


def test_several_key_moments_each_at_its_own(library, order):
    asked = order((1.0, "kick right"), (3.5, "kick left"), (6.0, "kick"))
    search = BlockSearch(library, asked, 0.2)
    edit = build_straight_edit(search, search.run())
    assert [key.number for key in edit.keys] == [0, 1, 2]
    for placed in edit.keys:
        at = int(round(asked.keys[placed.number].frame))
        assert edit.clip[at] == placed.key.clip
        assert library.frames.source[int(edit.frame[at])] == pytest.approx(placed.key.frame, abs=1.0)


def test_entry_and_exit_of_a_kick_are_played_whole(library, order):
    clip, frame = shown(library, order((4.0, "kick right")))
    assert np.array_equal(np.diff(frame[108:126]), np.ones(17)) and len(set(clip[108:126])) == 1


@pytest.mark.parametrize("words", ["standing", "walking", "jogging", "running", "walking left"])
def test_words_of_spans_are_followed(library, order, words):
    clip, frame = shown(library, order((0.0, 8.0, words)))
    carried = words_shown(library, clip, frame)
    assert np.mean([set(words.split()) == w for w in carried]) > 0.95


def test_words_change_when_they_are_asked_to(library, order):
    clip, frame = shown(library, order((0.0, 4.0, "jogging"), (4.0, 8.0, "walking")))
    carried = words_shown(library, clip, frame)
    assert np.mean(["jogging" in w for w in carried[:110]]) > 0.9
    assert np.mean(["walking" in w for w in carried[130:]]) > 0.9


def test_the_setting_alpha_becomes_the_fitted_weight():
    settings = np.linspace(0.0, 1.0, 21)
    weights = [rescale_alpha(setting) for setting in settings]
    assert weights[0] == 0.0 and weights[-1] == 1.0 and np.all(np.diff(weights) > 0.0)
    assert rescale_alpha(Plan.alpha) == pytest.approx(FITTED_ALPHA)
    assert rescale_alpha(0.4, Plan.alpha) == pytest.approx(0.4)  # where the thesis' own weight fits


@pytest.mark.skipif(not DATA.is_dir(), reason="needs recordings of walking and jogging")
def test_a_walker_jogs_where_the_track_does(tmp_path, track_of):
    """Recordings of CMU: the weight 0.2 on the rescaled cost walks on."""
    files = [DATA / f"cmu10/train_{gait}_{number}.bvh" for gait in ("walking", "running") for number in (1, 2, 3)]
    for path in files:
        (tmp_path / path.name).symlink_to(path)
    rows = (DATA / "annotations.csv").read_text().splitlines()
    rows = [rows[0], *(row.removeprefix("cmu10/") for row in rows if row.startswith("cmu10/train_"))]
    (tmp_path / "annotations.csv").write_text("\n".join(rows))
    library = build_library(tmp_path, unit=0.05644)
    plan = Plan(track=track_of(lambda t: np.where((t > 5.0) & (t < 10.0), 2.8, 1.2), 15.0), method="blocks")
    asked = build_request(library, resolve_plan(plan, library))
    jogs = []
    for alpha in (rescale_alpha(Plan.alpha), Plan.alpha):
        carried = words_shown(library, *shown(library, asked, alpha))
        jogs.append(np.mean(["jogging" in words for words in carried[170:290]]))
    assert jogs[0] > 0.9 > 0.5 > jogs[1]


def test_alpha_weighs_words_against_continuity(library, order):
    asked = order(*[(t, t + 2.0, "running" if t % 4.0 else "standing") for t in np.arange(0.0, 8.0, 2.0)])
    jumps, agreement = [], []
    for alpha in (0.0, 0.2, 1.0):
        clip, frame = shown(library, asked, alpha)
        jumps.append(measure_jumps(library, clip, frame))
        agreement.append(np.mean([bool(a & w) for a,
                                  w in zip(asked.requested_labels, words_shown(library, clip, frame))]))
    assert jumps[0] < 0.1 * jumps[1] and jumps[1] < jumps[2]
    assert agreement[0] <= agreement[1] <= agreement[2] and agreement[2] > 0.9


def test_the_blocks_chosen_have_the_best_words(library, order):
    asked = order((0.0, 8.0, "jogging front"))
    search = BlockSearch(library, asked, 1.0)
    blocks = search.run()
    cost = AnnotationCost(library.frames).compute_block_costs(blocks.start[:-2], [frozenset({"jogging", "front"})]
                                                              * FINEST_LENGTH)
    assert np.all(cost == -1.0)


def test_without_mirrors_none_is_used(library, order):
    for lines in (((0.0, 8.0, "walking right"),), ((4.0, "kick"),), ()):
        clip, _ = shown(library, order(*lines, mirror=False))
        assert not any(library.clips[c].mirrored for c in set(clip))


@pytest.mark.parametrize("seconds", [0.04, 0.1, 0.2, 0.3, 1.04, 1.08])
def test_short_motions(library, order, track_of, seconds):
    asked = order(track=track_of(1.4, seconds))
    clip, frame = shown(library, asked)
    assert len(clip) == len(asked) <= int(seconds * 30 + 1e-6) + 1 and np.all(own_clip(library, clip, frame))
    asked = order((seconds / 2, "kick right"), track=track_of(1.4, seconds))
    clip, frame = shown(library, asked)
    assert clip[int(round(asked.keys[0].frame))] == asked.keys[0].choices[0].clip


@pytest.mark.parametrize("seconds", [0.1, 0.3, 0.6])
def test_clips_shorter_than_the_longest_block(tmp_path, clip_file, track_of, seconds):
    clip_file(tmp_path / "walk.bvh", 1.4, seconds)
    clip_file(tmp_path / "jog.bvh", 2.8, seconds, "jogging")
    library = build_library(tmp_path)
    asked = build_request(library, resolve_plan(Plan(track=track_of(1.4, 3.0)), library))
    clip, frame = shown(library, asked)
    assert len(clip) == 91 and {library.clips[c].path for c in clip} <= {"walk.bvh", "jog.bvh"}
    search = BlockSearch(library, asked, 0.2)
    assert len(build_straight_edit(search, search.run())) == 91


def test_the_same_order_gives_the_same_blocks(library, order):
    a, b = (BlockSearch(library, order((4.0, "kick")), 0.2).run() for _ in range(2))
    assert np.array_equal(a.start, b.start) and np.array_equal(a.clip, b.clip)


def test_it_can_be_stopped_and_tells_how_far_it_is(library, order):
    told = []
    BlockSearch(library, order(), 0.2, lambda fraction, text: told.append(fraction)).run()
    assert told == sorted(told) and 0.0 <= told[0] and told[-1] <= 1.0
    with pytest.raises(UserCancelledError):
        BlockSearch(library, order(), 0.2, cancelled=lambda: True).run()
