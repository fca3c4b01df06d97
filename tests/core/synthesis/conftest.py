"""Orders put into frames of the made library."""

import pytest

from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.resolve_plan import resolve_plan
from beyond_mocap.synthesis.search.request import build_request


@pytest.fixture(scope="session")
def order(library, track_of, timeline_of):
    """order(*lines, track=None, **plan) -> Wanted: by default eight seconds of walking along +x."""

    def build_search_request(*lines, track=None, **plan):
        plan = Plan(track=track or track_of(), timeline=timeline_of(*lines), **plan)
        return build_request(library, resolve_plan(plan, library))

    return build_search_request
