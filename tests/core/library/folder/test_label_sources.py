"""Who said a row is written behind it, in a text and in a table, and read back; what a person wrote has no source."""

from pathlib import Path

import pytest

from beyond_mocap.annotation import ClipAnnotation
from beyond_mocap.library.folder.label_files import format_rows, read_labels, read_sources, write_labels

ROWS = (
    ClipAnnotation(0, 80, None, ("jogging", "front")), ClipAnnotation(60, 90, 75, ("kick", "right", "low")),
    ClipAnnotation(100, 100, 100, ("header",)),
)
SAID = {ROWS[1]: ("learned", 0.93), ROWS[2]: ("rules", 0.6)}


@pytest.fixture
def clip(tmp_path):
    path = tmp_path / "one.bvh"
    path.write_text("a recording stands here")
    return path


def test_in_a_text_it_is_a_comment(clip):
    write_labels(clip, clip.parent, ROWS, 30.0, sources=SAID)
    lines = clip.with_suffix(".txt").read_text().splitlines()
    assert lines[0] == "0f 80f jogging front" and lines[2] == "75f kick right low  # learned 0.93"
    assert lines[3] == "100f header  # rules 0.60"
    rows = read_labels(clip, clip.parent, 30.0)
    assert rows == ROWS and read_sources(clip, clip.parent, rows, 30.0) == SAID
    assert format_rows(ROWS) == "".join(line.split("  #")[0] + "\n" for line in lines)


@pytest.mark.parametrize("columns, said", [(",source,confidence", SAID), ("", {})])
def test_in_a_table_it_stands_in_columns_where_these_are(clip, columns, said):
    table = Path(clip.parent / "annotations.csv")
    table.write_text(f"file,start_frame,end_frame,key_frame,labels{columns}\n")
    write_labels(clip, clip.parent, ROWS, 30.0, sources=SAID)
    rows = read_labels(clip, clip.parent, 30.0)
    assert rows == ROWS and read_sources(clip, clip.parent, rows, 30.0) == said


@pytest.mark.parametrize("text", ["# by hand", "# learned", "# 0.9", "# take 1", ""])
def test_other_comments_are_a_persons(clip, text):
    clip.with_suffix(".txt").write_text(f"0f 80f jogging {text}\n")
    rows = read_labels(clip, clip.parent, 30.0)
    assert len(rows) == 1 and read_sources(clip, clip.parent, rows, 30.0) == {}


def test_no_words_have_no_source(clip):
    assert read_sources(clip, clip.parent, (), 30.0) == {}
