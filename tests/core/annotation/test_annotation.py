"""The shared language: vocabulary, timelines, their text form, clip annotations, gaits by speed."""

import pathlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.annotation import (
    CONTINUOUS,
    DISCRETE,
    LOCOMOTION,
    ClipAnnotation,
    KeyMoment,
    Span,
    Timeline,
    avoided_labels_per_frame,
    check_timeline,
    choose_gaits,
    compute_gait_thresholds,
    estimate_gait_thresholds,
    fill_timeline,
    find_missing_keys,
    find_nearest_labels,
    find_problems,
    find_relatives,
    find_similar_labels,
    format_timeline,
    labels_per_frame,
    list_labels_below,
    list_vocabulary,
    parse_timeline,
    read_annotation_csv,
    read_clip_annotations,
    read_timeline,
    sort_labels,
    swap_sides,
)
from beyond_mocap.base.errors import InputError

DATA = pathlib.Path(__file__).resolve().parents[3] / ".." / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="the recordings in ../shared/data are not here")

FAUSTINO = """\
0 8.5
8.5 9.8 right dribble
9.8 top kick low right
9.8 15
15 20 celebration arms inside
"""


def complaint(text, **options):
    """The message that reading and validating `text` ends with."""
    with pytest.raises(InputError) as caught:
        check_timeline(parse_timeline(text, "a.txt", fps=30), where="a.txt", **options)
    return str(caught.value)


# --- vocabulary


def test_the_tree_holds_the_words_of_the_appendix():
    words = list_vocabulary()
    assert {"kick", "bicycle", "half", "with_setup", "subtle", "left", "long_duration", "letgo", "sprinting"} <= words
    assert "moonwalk" not in words and "moonwalk" in list_vocabulary(["moonwalk"])
    assert "kick" in DISCRETE and "walking" in CONTINUOUS and not DISCRETE & CONTINUOUS


def test_the_tree_knows_what_comes_below_and_beside():
    assert list_labels_below(["kick", "low"]) == ("inside", "outside", "top", "volley")
    assert list_labels_below(["stomp", "dive", "short_duration"]) == ("high", "low")
    assert {"foot", "body", "low"} <= find_relatives("receive") and "kick" not in find_relatives("receive")


@pytest.mark.parametrize("word, meant", [("kikc", "kick"), ("Insid".lower(), "inside"), ("dribbel", "dribble")])
def test_misspelt_words_find_the_one_meant(word, meant):
    assert find_similar_labels(word, list_vocabulary())[0] == meant


def test_nearest_puts_the_action_before_its_colour():
    held = [("jump", "high", "right"), ("kick", "low", "left"), ("walking",), ("kick", "high", "left", "running")]
    assert find_nearest_labels(["kick", "high", "right"], held) == (held[3], held[1], held[0])
    assert find_nearest_labels(["header"], held, count=1) == (held[0],)
    assert find_nearest_labels(["kick", "low"], [("low", "kick"), ("kick", "low")]) == (("kick", "low"),)


def test_sides_change_places_and_come_back():
    words = ("kick", "right", "front", "turn_left")
    assert swap_sides(words) == ("kick", "left", "front", "turn_right")
    assert swap_sides(swap_sides(words)) == words


# --- text form


def test_faustinos_example_is_read_as_he_means_it():
    timeline = parse_timeline(FAUSTINO)
    assert timeline.keys == (KeyMoment(9.8, ("top", "kick", "low", "right")),)
    assert [span.words for span in timeline.spans] == [(), ("right", "dribble"), (), ("celebration", "arms", "inside")]
    assert find_problems(timeline, start=0.0, end=20.0) == []


def test_comments_marks_line_ends_and_frames():
    text = "\ufeff# who\r\n\r\n30f 60f Walking # slow\r\nunit frames\r\n90 kick\r\n"
    timeline = parse_timeline(text, fps=30, start=5.0)
    assert timeline == Timeline((Span(6.0, 7.0, ("walking",)),), (KeyMoment(8.0, ("kick",)),))


def test_an_empty_file_means_all_automatic():
    assert parse_timeline(" \n# nothing\n") == Timeline()


words = st.lists(st.from_regex(r"[a-z_]{1,8}", fullmatch=True).filter(lambda w: w != "unit"), max_size=4).map(tuple)
seconds = st.floats(-1e10, 1e10)
stretches = st.tuples(seconds, seconds).map(sorted).filter(lambda pair: pair[0] < pair[1])
spans = st.builds(lambda pair, w, avoid: Span(*pair, w, avoid=avoid), stretches, words, words)
keys = st.builds(KeyMoment, seconds, words.filter(bool), avoid=words)


@settings(deadline=None)
@given(st.builds(Timeline, st.lists(spans, max_size=5).map(tuple), st.lists(keys, max_size=4).map(tuple)))
def test_what_is_written_reads_back_equal(timeline):
    assert parse_timeline(format_timeline(timeline)) == timeline


@settings(max_examples=200, deadline=None)
@given(st.text(alphabet=st.characters(codec="utf-8"), max_size=200))
def test_any_text_is_read_or_refused_in_one_line(text):
    try:
        timeline = parse_timeline(text, "a.txt", fps=30)
    except InputError as error:
        assert "\n" not in str(error) and str(error).startswith("a.txt:")
    else:
        assert parse_timeline(format_timeline(timeline)) == timeline


TOKENS = "0 1 2.5 9f -3 1e400 nan inf kick walking -walking -kick - transition -transition unit frames # x".split()


@settings(deadline=None)
@given(st.lists(st.sampled_from(TOKENS), max_size=12))
def test_any_line_of_plausible_tokens_is_read_or_refused(tokens):
    try:
        check_timeline(parse_timeline(" ".join(tokens[:6]) + "\n" + " ".join(tokens[6:]), "a.txt", fps=30), start=0,
                       end=10)
    except InputError as error:
        assert "\n" not in str(error)


@pytest.mark.parametrize(
    "text, where, part",
    [
        ("0 5 walking\nfive 6 kick", "a.txt:2", "'five' is not a time"),
        ("5,5 kick", "a.txt:1", "'5,5' is not a time"),
        ("5,5 kick", "a.txt:1", "write seconds with a point: 5.5"),
        ("00:05 kick", "a.txt:1", "write seconds with a point: 5"),
        ("-5,5 kick", "a.txt:1", "write seconds with a point: -5.5"),
        ("unit frames\n1:05 kick", "a.txt:2", "write the number of frames"),
        ("0 1:02,5 walking", "a.txt:1", "write seconds with a point: 62.5"),
        ("0 1:01:00 walking", "a.txt:1", "write seconds with a point: 3660"),
        ("5 3 walking", "a.txt:1", "not after the start"),
        ("4 4 walking", "a.txt:1", "write one time for a key moment"),
        ("1 2 3 walking", "a.txt:1", "three numbers"),
        ("7", "a.txt:1", "one time and no labels"),
        ("unit metres", "a.txt:1", "'unit seconds' or 'unit frames'"),
        ("1e300 kick", "a.txt:1", "the time 1e300"),
        ("0 1 kikc", "a.txt:1", "kick"),
        ("3 kick low insde", "a.txt:1", "inside"),
        ("99 kick low", "a.txt:1", "from 0 s to 20 s"),
        ("-1 2 walking", "a.txt:1", "outside the track"),
        ("0 3 walking\n2 4 running", "a.txt:2", "'0 3 walking' (line 1)"),
        ("2 kick\n2 jump", "a.txt:2", "at the same time"),
        ("2 transition", "a.txt:1", "write it alone"),
        ("2 3 transition kick", "a.txt:1", "write it alone"),
        ("2 3 -transition", "a.txt:1", "'-transition'"),
        ("2 3 walking -walkin", "a.txt:1", "like walking"),
        ("0 3 walking -walking", "a.txt:1", "'walking' is both requested and avoided"),
        ("5 -kick", "a.txt:1", "one time and no labels"),
        ("2 3 walking -", "a.txt:1", "'' is not a label"),
        ("2 3 walking --kick", "a.txt:1", "'-kick' is not a label"),
    ],
)
def test_every_mistake_gets_its_line_and_a_way_out(text, where, part):
    message = complaint(text, start=0.0, end=20.0)
    assert message.startswith(where + ": ") and part in message and "\n" not in message


def test_frames_without_a_rate_are_refused():
    with pytest.raises(InputError, match="frame rate is unknown"):
        parse_timeline("30f kick")


def test_a_key_inside_a_span_and_touching_spans_are_fine():
    text = "0 3 walking\n3 6 dribble\n4 kick\n0 20\n6 8 transition"
    assert find_problems(parse_timeline(text), start=0.0, end=20.0) == []


def test_user_words_are_words():
    assert "moonwalk" in complaint("0 1 moonwalk")
    check_timeline(parse_timeline("0 1 moonwalk"), known_labels=["moonwalk"])


def test_all_problems_are_told_in_order():
    found = find_problems(parse_timeline("5 6 fooo\n0 1 baar\n"), where="t")
    assert [str(problem).split(":")[1] for problem in found] == ["2", "1"]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_files_are_utf_8_or_have_a_byte_order_mark(tmp_path, encoding):
    (tmp_path / "a.txt").write_text("0 1 walking\r\n", encoding)
    assert read_timeline(tmp_path / "a.txt") == parse_timeline("0 1 walking\n")


@pytest.mark.parametrize("content", [b"\x00\x01\x02", b"\xff\xfe0", b"0 1 w\xe4lking"])
def test_files_that_are_no_text_are_refused(tmp_path, content):
    file = tmp_path / "a.txt"
    file.write_bytes(content)
    with pytest.raises(InputError, match="a.txt"):
        read_timeline(file)


def test_a_missing_file_is_told(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_timeline(tmp_path / "none.txt")


def test_words_that_the_text_form_cannot_carry_are_refused():
    for word in ("two words", "5", "a#b", "", "3.5f", "5,5", "1:05"):
        with pytest.raises(InputError):
            Span(0, 1, (word,))


def test_words_that_must_not_be_stand_behind_a_dash():
    timeline = parse_timeline("0 20 -Dribble\n3.2 6 running -sprinting\n4 kick -left")
    assert timeline.spans == (Span(0, 20, avoid=("dribble",)), Span(3.2, 6, ("running",), avoid=("sprinting",)))
    assert timeline.keys == (KeyMoment(4, ("kick",), avoid=("left",)),)
    assert find_problems(timeline, start=0.0, end=20.0) == []
    assert format_timeline(timeline) == "0 20 -dribble\n3.2 6 running -sprinting\n4 kick -left\n"


# --- frames


def test_words_hold_from_start_up_to_end():
    timeline = parse_timeline("0 2 walking\n2 3 transition\n3 4 right dribble\n4 5")
    assert labels_per_frame(timeline, np.arange(11) * 0.5) == [
        *[frozenset({"walking"})] * 4,
        *[None] * 2,
        *[frozenset({"right", "dribble"})] * 2,
        *[frozenset()] * 3,
    ]


def test_words_are_avoided_from_start_up_to_end_but_for_those_that_are_asked():
    timeline = parse_timeline("0 4 -dribble -kick\n1 2 dribble\n2 3 walking -back")
    assert avoided_labels_per_frame(timeline, np.arange(5.0)) == [
        {"dribble", "kick"}, {"kick"}, {"dribble", "kick", "back"}, {"dribble", "kick"}, {"dribble", "kick"},
    ]
    assert avoided_labels_per_frame(parse_timeline("0 4 walking"), np.arange(5.0)) == [frozenset()] * 5


def test_automatic_gaits_fill_what_is_left_open():
    times = np.arange(101) * 0.1
    automatic = [("walking",) if t < 5 else ("running",) for t in times]
    filled = fill_timeline(parse_timeline("2 4 dribble\n6 7\n9 10 transition\n3 kick"), times, automatic)
    assert [(span.start, span.end, span.words) for span in filled.spans] == [
        (0.0, 2.0, ("walking",)),
        (2.0, 4.0, ("dribble",)),
        (4.0, 5.0, ("walking",)),
        (5.0, 9.0, ("running",)),
        (9.0, 10.0, ("transition",)),
    ]
    assert filled.keys == (KeyMoment(3.0, ("kick",)),)


@settings(deadline=None)
@given(
    st.lists(st.tuples(st.floats(-1, 11), st.floats(0.01, 4), st.booleans()), max_size=6),
    st.lists(st.sampled_from(["walking", "running"]), min_size=2, max_size=60),
)
def test_filling_leaves_no_frame_without_words(pieces, gaits):
    gaits = [*gaits, gaits[-1]]  # the last frame ends the last stretch and has none of its own
    times = np.linspace(0.0, 10.0, len(gaits))
    asked = Timeline(tuple(Span(a, a + length, ("dribble",) if worded else ()) for a, length, worded in pieces))
    automatic = [(gait,) for gait in gaits]
    filled = fill_timeline(asked, times, automatic)
    for before, after, gait in zip(labels_per_frame(asked, times), labels_per_frame(filled, times), gaits):
        assert after == (before or {gait})
    assert fill_timeline(filled, times, automatic) == filled


# --- gaits


def test_thresholds_lie_a_quarter_up_and_standing_ends_where_a_body_would_glide():
    np.testing.assert_allclose(compute_gait_thresholds([1.0, 3.0, 5.0]), [1.5, 3.5])
    np.testing.assert_allclose(compute_gait_thresholds([0.1, 0.5, 2.9]), [0.3, 1.1])
    assert len(compute_gait_thresholds([1.0])) == 0
    for wrong in ([2.0, 1.0], [1.0, np.nan]):
        with pytest.raises(InputError):
            compute_gait_thresholds(wrong)


def test_recorded_thresholds_lie_where_the_labels_change():
    rng = np.random.default_rng(1)
    speed = np.concatenate([rng.uniform(0.0, 0.2, 300), rng.uniform(0.7, 2.0, 300), rng.uniform(2.0, 4.0, 300)])
    found = estimate_gait_thresholds(np.array([0.1, 1.3, 2.9]), speed, np.repeat([0, 1, 2], 300))
    assert found[0] == 0.3 and abs(found[1] - 2.0) < 0.03
    gaits = choose_gaits(np.full(60, 1.9), 30, [0.1, 1.3, 2.9], found)
    assert set(gaits) == {1}


def test_steady_speeds_get_their_own_gait():
    speeds = np.array([0.1, 1.4, 2.8, 4.5, 6.5])
    gaits = choose_gaits(np.repeat(speeds, 60), 30, speeds, compute_gait_thresholds(speeds))
    assert gaits.tolist() == np.repeat(np.arange(5), 60).tolist()
    assert LOCOMOTION[gaits[0]] == "standing"


def test_a_speed_at_the_boundary_does_not_flicker():
    rng = np.random.default_rng(3)
    speeds = np.array([0.1, 1.3, 2.9])
    noise = np.convolve(rng.normal(size=1200), np.hanning(15), "same")
    speed = 1.7 + 0.15 * noise / noise.std()
    plain = np.count_nonzero(np.diff(np.searchsorted(compute_gait_thresholds(speeds), speed)))
    steady = np.count_nonzero(np.diff(choose_gaits(speed, 30, speeds, compute_gait_thresholds(speeds))))
    assert plain > 60 and steady < plain / 8


@settings(deadline=None)
@given(st.lists(st.floats(0, 12), max_size=80), st.integers(1, 5))
def test_gaits_are_in_range_and_last(speed, count):
    speeds = np.linspace(0.2, 8.0, count)
    gaits = choose_gaits(np.array(speed), 10, speeds, compute_gait_thresholds(speeds), minimum=0.4)
    assert len(gaits) == len(speed) and np.all((gaits >= 0) & (gaits < count))
    edges = np.flatnonzero(np.diff(gaits)) + 1
    assert not len(edges) or np.diff([0, *edges, len(gaits)]).min() >= 4


# --- clips


def test_a_key_line_belongs_to_the_span_of_its_action(tmp_path):
    file = tmp_path / "clip.txt"
    file.write_text("0 4 walking\n1 2 kick right\n1.5 kick low right\n3 jump\n0 4\n", encoding="utf-8")
    assert read_clip_annotations(file, 120) == (
        ClipAnnotation(0, 480, None, ("walking",)),
        ClipAnnotation(120, 240, 180, ("kick", "right", "low")),
        ClipAnnotation(360, 360, 360, ("jump",)),
    )


def test_several_keys_in_one_span_each_get_its_extent(tmp_path):
    file = tmp_path / "clip.txt"
    file.write_text("unit frames\n0 100 juggling\n20 juggling\n60 juggling left\n", encoding="utf-8")
    assert [(a.start, a.end, a.key, a.words) for a in read_clip_annotations(file, 60)] == [
        (0, 100, 20, ("juggling",)),
        (0, 100, 60, ("juggling", "left")),
    ]


HEADER = "file,fps,start_frame,end_frame,key_frame,labels\n"


def test_the_table_is_read_by_its_columns(tmp_path):
    file = tmp_path / "annotations.csv"
    rows = "a.bvh,30,0,9,,walking front\nb.bvh,30,5,9,7.0,Kick low\na.bvh,30,0,9,,\n"
    file.write_text("\ufeff" + HEADER + rows, encoding="utf-8")
    assert read_annotation_csv(file) == {
        "a.bvh": (ClipAnnotation(0, 9, None, ("walking", "front")),),
        "b.bvh": (ClipAnnotation(5, 9, 7, ("kick", "low")),),
    }


@pytest.mark.parametrize(
    "text, part",
    [
        ("", "empty file"),
        ("file,labels\na,b\n", "no column start_frame, end_frame, key_frame"),
        (HEADER + "a.bvh,30,x,9,,walking\n", ":2: start_frame 'x'"),
        (HEADER + "a.bvh,30,nan,9,,walking\n", ":2: start_frame 'nan'"),
        (HEADER + "a.bvh,30,9,1,,walking\n", ":2: end_frame 1 before"),
        (HEADER + "a.bvh,30,0,9,12,kick\n", ":2: key_frame 12 outside"),
        (HEADER + "a.bvh,30,0,9,12.5,kick\n", ":2: key_frame '12.5'"),
        (HEADER + ",30,0,9,,kick\n", ":2: the file is blank"),
        (HEADER + "a.bvh,30\n", ""),
    ],
)
def test_mistakes_in_the_table_name_their_line(tmp_path, text, part):
    file = tmp_path / "annotations.csv"
    file.write_text(text, encoding="utf-8")
    if not part:
        assert read_annotation_csv(file) == {}
        return
    with pytest.raises(InputError) as caught:
        read_annotation_csv(file)
    found, *expected_and_step = str(caught.value).split("; ")
    assert part in found and "annotations.csv" in found and len(expected_and_step) == 2


@settings(deadline=None)
@given(st.binary(max_size=120))
def test_any_table_is_read_or_refused(tmp_path_factory, content):
    file = tmp_path_factory.mktemp("fuzz") / "annotations.csv"
    file.write_bytes(HEADER.encode() + content)
    try:
        read_annotation_csv(file)
    except InputError as error:
        assert "\n" not in str(error)


@needs_data
def test_the_recordings_annotations_are_read_whole():
    found = read_annotation_csv(DATA / "mocap" / "annotations.csv")
    assert sum(map(len, found.values())) == 1613
    kick = found["lmd/Player1/P1_S01_penalty_kick.bvh"][0]
    assert kick == ClipAnnotation(236, 283, 260, ("kick", "right", "standing", "low", "top", "front"))


@needs_data
@pytest.mark.parametrize("number", range(1, 6))
def test_the_scenarios_are_valid_and_what_the_recordings_lack_is_named(number):
    file = DATA / "tracking" / "scenarios" / f"scenario{number}_annotations.txt"
    timeline = read_timeline(file)
    check_timeline(timeline, start=0.0, end=27.0, where=str(file))
    assert parse_timeline(format_timeline(timeline)) == timeline
    clips = read_annotation_csv(DATA / "mocap" / "annotations.csv").values()
    held = [words for clip in clips for a in clip if a.key is not None for words in (a.words, swap_sides(a.words))]
    lacking = find_missing_keys(timeline, held)
    assert all(not set(key.words).isdisjoint({"receive", "slide", "header"}) for key, _ in lacking)
    assert all(len(offers) == 3 for _, offers in lacking)


def test_words_are_told_as_one_says_them():
    assert sort_labels({"low", "right", "front", "standing", "kick"}) == ("kick", "right", "standing", "low", "front")
    assert sort_labels({"front", "walking"}) == ("walking", "front")
    missing = parse_timeline("3 header\n")
    assert find_missing_keys(missing, [{"low", "right", "kick"}])[0][1] == (("kick", "right", "low"),)
    assert set(sort_labels({"mine", "header"})) == {"mine", "header"}
