"""Motions in a file: the same bits back, and a walk through all of them needs the memory of one."""

from pathlib import Path

import numpy as np
import pytest

from beyond_mocap.files.motion_file import MotionWriter, divide_into_motions, map_array
from beyond_mocap.motion.motion import Motion
from beyond_mocap.synthetic.gait import build_gait

STATUS = Path("/proc/self/status")
MEGABYTE = 1 << 20


@pytest.fixture
def walk():
    return build_gait(1.4, 2.0, 30.0)


@pytest.mark.parametrize("in_memory", [True, False])
def test_the_same_bits_come_back(walk, tmp_path, in_memory):
    writer = MotionWriter(None if in_memory else tmp_path / "motions.npy")
    written = [walk, walk.frames(3, 20), build_gait(3.0, 1.0, 60.0)]
    for motion in written:
        writer.append(motion)
    for one, other in zip(writer.finish(), written, strict=True):
        assert one.fps == other.fps and one.skeleton is other.skeleton
        assert one.root_positions.tobytes() == other.root_positions.tobytes()
        assert one.rotations.tobytes() == other.rotations.tobytes()
        assert not one.rotations.flags.writeable


def test_a_file_of_another_length_is_refused(walk, tmp_path):
    writer = MotionWriter(tmp_path / "motions.npy")
    writer.append(walk)
    writer.finish()
    with pytest.raises(ValueError):
        divide_into_motions(map_array(tmp_path / "motions.npy"), [(walk.skeleton, len(walk) - 1, walk.fps)])


def read_mapped_bytes() -> int:
    """Bytes of mapped files that this process has in memory."""
    return next(1024 * int(line.split()[1]) for line in STATUS.read_text().splitlines() if line.startswith("RssFile"))


@pytest.mark.skipif(not STATUS.exists(), reason="the system does not say what is in memory")
def test_a_walk_through_all_motions_needs_the_memory_of_one(walk, tmp_path):
    count = MEGABYTE // (32 * len(walk.skeleton))
    long = Motion(walk.skeleton, np.zeros((count, 3)), np.repeat(walk.rotations[:1], count, axis=0), 30.0)
    writer = MotionWriter(tmp_path / "motions.npy")
    for _ in range(32):
        writer.append(long)
    motions = writer.finish()
    before, most = read_mapped_bytes(), 0
    for motion in motions:
        assert np.isfinite(motion.rotations.sum())
        most = max(most, read_mapped_bytes() - before)
    assert most < 6 * MEGABYTE
    for motion in list(motions):  # the control: all of them, without letting go
        motion.rotations.sum()
    assert read_mapped_bytes() - before > 24 * MEGABYTE
