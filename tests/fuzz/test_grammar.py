"""Well-formed but odd inputs from hypothesis: they are read, or refused in one line."""

import json

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from beyond_mocap.annotation import parse_timeline
from beyond_mocap.base.errors import BeyondMocapError
from beyond_mocap.files.tracking.tracking import read_track_csv
from beyond_mocap.motion.track import clean_track
from beyond_mocap.passes.scene_json import SAMPLES, parse_scene

MANY = settings(max_examples=400, deadline=None, suppress_health_check=list(HealthCheck))
numbers = st.one_of(st.floats(), st.integers(), st.floats(-50.0, 50.0))
words = st.sampled_from(["walking", "kick", "right", "-kick", "transition", "standing", "unit frames", "#", "é", "3f"])
values = st.recursive(
    st.none() | st.booleans() | numbers | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
)


def is_taken(function, *arguments):
    """What a function gives; None where it refuses in one line."""
    try:
        return function(*arguments)
    except BeyondMocapError as error:
        assert "\n" not in str(error)
        return None


@MANY
@given(st.lists(st.tuples(numbers, st.none() | numbers, st.lists(words, max_size=3)), max_size=8))
def test_lines_of_labels(rows):
    lines = [" ".join([repr(start), *([] if end is None else [repr(end)]), *labels]) for start, end, labels in rows]
    timeline = is_taken(parse_timeline, "\n".join(lines), "words.txt", 30.0)
    assert timeline is None or all(np.isfinite(key.time) for key in timeline.keys)


@MANY
@given(
    st.sampled_from(sorted(SAMPLES)),
    st.lists(
        st.tuples(
            st.sampled_from(
                ["players", "passes", "repeat", "fps", "seed", "ball", "net", "serve", "errors", "weights", "defaults"]
            ),
            values,
        ),
        max_size=3,
    ),
)
def test_scenes(name, changes):
    is_taken(parse_scene, json.loads(json.dumps({**SAMPLES[name], **dict(changes)})))


@MANY
@given(rows=st.lists(st.tuples(numbers, numbers, numbers), max_size=30))
def test_tracks(rows, tmp_path_factory):
    path = tmp_path_factory.mktemp("track") / "track.csv"
    path.write_text("time_s,x_m,y_m\n" + "".join(f"{t!r},{x!r},{y!r}\n" for t, x, y in rows))
    track = is_taken(lambda: clean_track(read_track_csv(path))[0])
    assert track is None or (np.isfinite(track.times).all() and np.isfinite(track.positions).all())
