"""The ground out of OBJ files: axes, the forms of faces, and one line for what is no mesh."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.base.errors import InputError
from beyond_mocap.files.obj import read_mesh

SQUARE = "v 0 1 0\nv 2 1 0\nv 2 1 -3\nv 0 1 -3\n"


@pytest.mark.parametrize("faces, triangles", [
    ("f 1 2 3\nf 1 3 4\n", [[0, 1, 2], [0, 2, 3]]),
    ("f 1 2 3 4\n", [[0, 1, 2], [0, 2, 3]]),
    ("f -4 -3 -2 -1\n", [[0, 1, 2], [0, 2, 3]]),
    ("vt 0 0\nvn 0 1 0\no hill\ng a\ns 1\nusemtl \xfc\nf 1/1 2/1/1 3//1\n", [[0, 1, 2]]),
    ("f 1 2 \\\n3 # a corner\n", [[0, 1, 2]]),
])  # fmt: skip
def test_faces_in_all_forms(tmp_path, faces, triangles):
    (tmp_path / "g.obj").write_bytes(("\ufeff# ground\r\n" + SQUARE + faces).encode("utf-8"))
    vertices, found = read_mesh(tmp_path / "g.obj")
    np.testing.assert_array_equal(found, triangles)
    np.testing.assert_allclose(vertices, [[0, 0, 1], [2, 0, 1], [2, 3, 1], [0, 3, 1]])


@pytest.mark.parametrize("text, part", [
    ("", "empty"),
    ("\0\1", "binary"),
    ("hello\n", "no faces"),
    (SQUARE, "4 vertices and no faces"),
    (SQUARE + "l 1 2\n", "no faces"),
    (SQUARE + "f 1 2\n", ":5: a face of 2 corners"),
    (SQUARE + "f 1 2 5\n", ":5: vertex 5 of 4"),
    (SQUARE + "f 1 2 0\n", ":5: vertex 0 of 4"),
    (SQUARE + "f 1 2 -5\n", ":5: vertex -5 of 4"),
    (SQUARE + "f 1 2 a\n", ":5: corner 'a'"),
    (SQUARE + "f 1 2 /3\n", ":5: corner '/3'"),
    ("v 0 0\nf 1 1 1\n", ":1: vertex '0 0'"),
    ("v 0 0 nan\nf 1 1 1\n", ":1: vertex"),
    ("v 0 0 1e9\nf 1 1 1\n", "check the unit"),
])  # fmt: skip
def test_what_is_no_mesh_is_told_with_its_line(tmp_path, text, part):
    (tmp_path / "g.obj").write_text(text)
    with pytest.raises(InputError) as caught:
        read_mesh(tmp_path / "g.obj")
    assert part in str(caught.value) and "g.obj" in str(caught.value)


@settings(deadline=None)
@given(st.one_of(st.binary(max_size=150), st.text("vf 0123456789-./\\#\n\rnaie+", max_size=150)))
def test_any_content_is_read_or_refused(tmp_path_factory, content):
    file = tmp_path_factory.mktemp("fuzz") / "g.obj"
    file.write_bytes(SQUARE.encode() + (content if isinstance(content, bytes) else content.encode()))
    try:
        vertices, triangles = read_mesh(file)
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert np.isfinite(vertices).all() and triangles.min() >= 0 and triangles.max() < len(vertices)
