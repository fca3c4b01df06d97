"""Why a clip was chosen: the parts add up to what the search paid, and name what is planted."""

import numpy as np
import pytest

from beyond_mocap.plan import Plan
from beyond_mocap.synthesis.balance import balanced
from beyond_mocap.synthesis.blocks import BlockSearch
from beyond_mocap.synthesis.distance import exact_keys, straight_edit
from beyond_mocap.synthesis.path_costs import Weights
from beyond_mocap.synthesis.path_search import PathSearch
from beyond_mocap.synthesis.why import PARTS, block_reasons, reasons

LINES = [(), ((4.0, "kick"),), ((2.013, "kick right"), (6.0, "kick left")), ((3.0, 6.0, "running"),)]


class Paid(PathSearch):
    """The search, and what its best way cost it."""

    def _read(self, layers):
        self.paid = float(layers[-1].cost.min())
        return super()._read(layers)


@pytest.mark.parametrize("lines", LINES)
def test_the_parts_add_up_to_what_the_search_paid(library, order, lines):
    asked = order(*lines)
    search = Paid(library, asked)
    edit = search.run()
    found = reasons(library, asked, edit, Weights(), others=0)
    assert sum(reason.cost for reason in found) == pytest.approx(search.paid, abs=2e-3)
    assert [(reason.first, reason.end) for reason in found] == edit.pieces


def test_a_key_moment_put_on_time_costs_what_the_search_paid(library, order):
    asked = order((2.013, "kick right"))
    search = Paid(library, asked, balanced(0.5))
    edit = exact_keys(library, search.run(), asked)
    found = reasons(library, asked, edit, balanced(0.5), others=0)
    assert sum(reason.cost for reason in found) == pytest.approx(search.paid, abs=2e-3)


def test_a_missed_speed_is_the_dearest_part(library, order, track_of):
    asked = order(track=track_of(8.0))
    found = reasons(library, asked, PathSearch(library, asked).run(), Weights())
    assert {next(iter(reason.costs)) for reason in found} == {"speed"}


def test_words_that_the_clip_lacks_are_told(library, order):
    asked = order((0.0, 8.0, "running"))  # at a walk
    edit = PathSearch(library, asked).run()
    found = reasons(library, asked, edit, Weights())
    lacking = [r for r in found if "running" not in library.clips[r.clip].words_at(r.shown[0])]
    assert lacking and all(r.costs.get("words", 0.0) > 0.5 for r in lacking)


def test_others_are_other_clips_and_cost_what_they_cost(library, order):
    asked = order()
    found = reasons(library, asked, PathSearch(library, asked).run(), Weights())
    first = found[0]
    assert first.others and all((o.path, o.mirrored) != (first.path, first.mirrored) for o in first.others)
    assert [o.more for o in first.others] == sorted(o.more for o in first.others)


def test_parts_have_words(library, order):
    asked = order((4.0, "kick"))
    found = reasons(library, asked, PathSearch(library, asked).run(), Weights())
    assert {name for reason in found for name in (*reason.costs, *reason.seam)} <= set(PARTS)


def test_blocks_tell_words_and_pose(library, order):
    asked = order((0.0, 8.0, "walking"))
    search = BlockSearch(library, asked, Plan.alpha)
    edit = straight_edit(search, search.run())
    found = block_reasons(library, asked, edit, Plan.alpha)
    assert [(reason.first, reason.end) for reason in found] == edit.pieces
    assert not found[0].seam and all(reason.seam["pose"] >= 0.0 for reason in found[1:] if reason.seam)
    walking = [
        r for r in found if all("walking" in library.clips[r.clip].words_at(f) for f in np.linspace(*r.shown, 9))
    ]
    assert walking and all(r.costs["words"] < 0.0 for r in walking)


def test_a_word_that_must_not_be_is_paid_for_and_told(library, track_of):
    from beyond_mocap.annotation import parse_timeline
    from beyond_mocap.synthesis.wanted import wanted

    asked = wanted(library, Plan(track=track_of(), timeline=parse_timeline("0 8 -walking\n", "words", 30.0, 0.0)))
    search = Paid(library, asked)
    found = reasons(library, asked, search.run(), Weights(), others=0)
    assert sum(reason.cost for reason in found) == pytest.approx(search.paid, rel=1e-5, abs=2e-3)
