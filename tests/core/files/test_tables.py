"""Tables out and back: what is written reads back, bad files get one line, no half files."""

import json
import os
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beyond_mocap.annotation import Timeline
from beyond_mocap.base.errors import InputError
from beyond_mocap.files.atomic import atomic_write
from beyond_mocap.files.tables import read_ball, write_ball, write_report
from beyond_mocap.motion.motion import Motion
from beyond_mocap.motion.skeleton import Skeleton
from beyond_mocap.motion.track.ball_path import BallPath
from beyond_mocap.synthesis.provenance import Provenance, read_provenance, write_provenance
from beyond_mocap.synthesis.take import Take

READERS = (read_provenance, read_ball)
HEADERS = {
    read_provenance: "frame,time_s,clip,clip_frame,mirrored,labels,contact_left,contact_right\n",
    read_ball: "time_s,x_m,y_m,z_m,measured\n",
}


def provenance():
    return Provenance(
        times=np.arange(3) / 30,
        clip=("a/run, fast.bvh", 'b"quoted".bvh', "c.bvh"),
        clip_frame=np.array([0.0, 1.25, 119.5]),
        mirrored=np.array([False, True, True]),
        words=(("running",), ("kick", "right"), ()),
        contacts=np.array([[True, False], [False, False], [False, True]]),
    )


def test_provenance_comes_back(tmp_path):
    file = tmp_path / "p.csv"
    write_provenance(file, provenance())
    assert file.read_text(encoding="utf-8").splitlines()[0] + "\n" == HEADERS[read_provenance]
    back, wrote = read_provenance(file), provenance()
    assert back.clip == wrote.clip and back.words == wrote.words
    for name in ("times", "clip_frame", "mirrored", "contacts"):
        np.testing.assert_allclose(getattr(back, name), getattr(wrote, name), atol=1e-6)


def test_a_planned_heading_comes_back_with_its_unknowns(tmp_path):
    file, wrote = tmp_path / "p.csv", replace(provenance(), planned_heading=np.array([np.pi / 2.0, np.nan, 7.0]))
    write_provenance(file, wrote)
    cells = [row.split(",")[-1] for row in file.read_text().splitlines()]
    assert cells == ["planned_heading_deg", "90.00", "", "41.07"]
    back = read_provenance(file).planned_heading
    np.testing.assert_allclose(back, [np.pi / 2.0, np.nan, 7.0 - 2.0 * np.pi], atol=1e-4)


def test_a_take_tells_where_its_frames_came_from(tmp_path):
    motion = Motion(Skeleton(("hips",), (-1,), np.zeros((1, 3))), np.zeros((2, 3)), [[[1.0, 0, 0, 0]]] * 2, 30.0)
    take = Take(
        motion=motion,
        start_time=4.0,
        clips=("run.bvh", "kick.bvh"),
        clip=np.array([1, 0]),
        clip_frame=np.array([7.5, 2.0]),
        mirrored=np.array([True, False]),
        words=(("kick", "left"), ("running",)),
        contacts=np.array([[True, False], [False, True]]),
        seams=np.array([1]),
        timeline=Timeline(),
        keys=(),
        ball=None,
        method="path",
        seed=0,
    )
    write_provenance(tmp_path / "p.csv", take)
    assert (tmp_path / "p.csv").read_text(encoding="utf-8").splitlines()[1:] == [
        "0,4.000000,kick.bvh,7.5000,1,kick left,1,0",
        "1,4.033333,run.bvh,2.0000,0,running,0,1",
    ]


def test_the_ball_comes_back_with_its_unknowns(tmp_path):
    positions = np.array([[1.0, 2.0, 0.11], [np.nan] * 3, [-3.5, 0.25, 2.0]])
    file = tmp_path / "b.csv"
    write_ball(file, BallPath(np.arange(3) / 25, positions, np.array([True, False, True])))
    back = read_ball(file)
    np.testing.assert_allclose(back.positions, positions)
    assert back.measured.tolist() == [True, False, True] and file.read_text().splitlines()[2] == "0.040000,,,,0"


def test_a_report_is_json_without_nan(tmp_path):
    file = tmp_path / "r.json"
    write_report(
        file,
        {
            "version": "1",
            "root_error_m": {"mean": np.float64(0.5), "max": float("nan")},
            "frames": np.int64(3),
            "list": np.array([1.0, np.inf]),
            "keys": ({"labels": ("kick", "low"), "used_instead": None},),
            "done": np.bool_(True),
        },
    )
    assert json.loads(file.read_text(encoding="utf-8")) == {
        "version": "1",
        "root_error_m": {"mean": 0.5, "max": None},
        "frames": 3,
        "list": [1.0, None],
        "keys": [{"labels": ["kick", "low"], "used_instead": None}],
        "done": True,
    }


@pytest.mark.parametrize(
    "reader, text, part",
    [
        (read_ball, HEADERS[read_ball] + "0,1,2,3,yes\n", ":2: measured 'yes'"),
        (read_provenance, HEADERS[read_provenance] + "0,0,a,0,2,run,0,0\n", ":2: mirrored '2'"),
    ],
)
def test_mistakes_name_their_line(tmp_path, reader, text, part):
    file = tmp_path / "t.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        reader(file)
    assert part in str(caught.value) and "t.csv" in str(caught.value)


@settings(deadline=None)
@given(st.sampled_from(READERS), st.booleans(), st.binary(max_size=120))
def test_any_content_is_read_or_refused(tmp_path_factory, reader, headed, content):
    file = tmp_path_factory.mktemp("fuzz") / "t.csv"
    file.write_bytes(HEADERS[reader].encode() * headed + content)
    try:
        reader(file)
    except InputError as error:
        assert "\n" not in str(error)


def test_a_failed_write_leaves_the_old_file_and_no_rest(tmp_path, monkeypatch):
    file = tmp_path / "r.json"
    write_report(file, {"a": 1})

    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(InputError, match="No space"):
        write_report(file, {"a": 2})
    assert [path.name for path in tmp_path.iterdir()] == ["r.json"] and json.loads(file.read_text()) == {"a": 1}


def test_halves_of_characters_are_written_and_read_back(tmp_path):
    """A file's name that is no UTF-8, and a name out of somebody's JSON."""
    told = {"tracking": os.fsdecode(b"/home/\xff/match.dat"), "name": json.loads('"R\\ud83fs"'), "plain": "Ræs"}
    atomic_write(tmp_path / "x.json", json.dumps(told, ensure_ascii=False))
    assert json.loads((tmp_path / "x.json").read_text("utf-8")) == told


def test_a_missing_folder_is_told(tmp_path):
    with pytest.raises(InputError, match="No such file"):
        atomic_write(tmp_path / "none" / "x.txt", "x")
