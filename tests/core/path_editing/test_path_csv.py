"""Paths as tables: what is read, and one line for what is no path."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.base.errors import InputError
from beyond_mocap.path_editing.path_line import read_curve


@pytest.mark.parametrize("content, points", [
    (b"x_m,y_m\n0,0\n\n1.5,-2\n", [[0, 0, 0], [1.5, -2, 0]]),
    (b"\xef\xbb\xbfname,y_m,x_m,z_m\r\na,1,2,3\r\nb,4,5,6\r\n", [[2, 1, 3], [5, 4, 6]]),
    (b"x_m,y_m,z_m\n0,0,0\n0,0,2\n", [[0, 0, 0], [0, 0, 2]]),
    (b'"x_m",y_m \n 1e-3 ,+2\n"1","2"', [[0.001, 2, 0], [1, 2, 0]]),
    (b"x_m,y_m\n0,0\n0,0\n1,0\n1,0\n", [[0, 0, 0], [0, 0, 0], [1, 0, 0], [1, 0, 0]]),
    (b"x_m;y_m;z_m\r\n0;0,5;-1,25\r\n1,5e0;2;,5\r\n", [[0, 0.5, -1.25], [1.5, 2, 0.5]]),
    (b"x_m;y_m\n0.5;0\n1;2.5\n", [[0.5, 0, 0], [1, 2.5, 0]]),
    (b"x;y\n0,5;0\n1;2\n", [[0.5, 0, 0], [1, 2, 0]]),
    (b"x,y,z\n0,0,1\n1,0,2\n", [[0, 0, 1], [1, 0, 2]]),
    (b"x\ty\n0,5\t0\n1\t2\n", [[0.5, 0, 0], [1, 2, 0]]),
    (b"x,x_m,y_m\n9,0,0\n9,1,0\n", [[0, 0, 0], [1, 0, 0]]),
], ids=["plain", "other columns, Windows", "straight up", "quoted", "repeated points stay",
        "decimal commas", "semicolons and points", "short names with semicolons", "short names", "tabs",
        "the full name counts"])  # fmt: skip
def test_points_in_the_order_of_their_rows(tmp_path, content, points):
    (tmp_path / "c.csv").write_bytes(content)
    np.testing.assert_allclose(read_curve(tmp_path / "c.csv"), points)


@pytest.mark.parametrize("content, part", [
    (b"", "the file is empty"),
    (b"\x00\x01", "binary"),
    (b"\xff\xfex\x00,", "binary"),
    (b"a,b\n1,2\n", ":1: no column x_m, y_m"),
    (b"0,0\n1,0\n", ":1: no column"),
    (b"x_m|y_m\n0|0\n1|0\n", "separated by bars"),
    (b"x_m y_m\n0 0\n1 0\n", "separated by spaces"),
    (b"a;b\n0;0\n1;0\n", "separated by semicolons"),
    (b"x_m;y_m\n0;0\n1.234,5;0\n", ":3: x_m '1.234,5'"),
    (b"x_m;y_m\n0;0\n1,2,3;0\n", ":3: x_m '1,2,3'"),
    (b"x_m,y_m\n", "0 points"),
    (b"x_m,y_m\n1,2\n", "1 point;"),
    (b"x_m,y_m\n1,2\n1,2\n1,2\n", "3 points, all at one place"),
    (b"x_m,y_m\n1,2\n1,abc\n", ":3: y_m 'abc'"),
    (b"x_m,y_m\n1,2\n1,\n", ":3: y_m ''"),
    (b"x_m,y_m\n1,2\n1\n", ":3: 1 cell;"),
    (b"x_m,y_m\n1,2\n1,inf\n", ":3: y_m 'inf'"),
    (b"x_m,y_m,z_m\n1,2,0\n1,3,nan\n", ":3: z_m 'nan'"),
    (b"x_m,y_m\n1,2\n1,2e5\n", ":3: y_m 2e5"),
    (b"x_m,y_m\n" + b"-9000,0\n9000,0\n" * 4, "126 km"),
    (b"x_m,y_m,x_m\n1,2,3\n1,2,3\n", "a column is repeated"),
])  # fmt: skip
def test_what_is_no_path_is_told_with_its_line(tmp_path, content, part):
    (tmp_path / "c.csv").write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_curve(tmp_path / "c.csv")
    assert part in str(caught.value) and "c.csv" in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["missing.csv", "."])
def test_what_is_no_file_is_told(tmp_path, name):
    with pytest.raises(InputError):
        read_curve(tmp_path / name)


@settings(deadline=None)
@given(st.sampled_from([b"", b"x_m,y_m,z_m\n", b"x;y;z\n"]),
       st.one_of(st.binary(max_size=120), st.text("0123456789.,;-+eEinfa\n\r\"' xyz_m", max_size=120)))
def test_any_content_is_read_or_refused(tmp_path_factory, header, content):
    file = tmp_path_factory.mktemp("fuzz") / "c.csv"
    file.write_bytes(header + (content if isinstance(content, bytes) else content.encode()))
    try:
        line = read_curve(file)
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert line.shape[1:] == (3,) and len(line) >= 2 and np.isfinite(line).all()
