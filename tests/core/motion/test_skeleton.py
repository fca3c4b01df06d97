"""Skeletons refuse what is no tree, and know their like."""

import dataclasses

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.motion.skeleton import Skeleton

ARM = Skeleton(("root", "upper", "lower"), (-1, 0, 1), [[0, 0, 0], [0, 0, 0.3], [0, 0, 0.25]], (2,), [[0, 0, 0.2]])


@pytest.mark.parametrize(
    "names, parents, offsets, says",
    [
        (("a", "b"), (-1, 1), np.zeros((2, 3)), "parents"),
        (("a", "b"), (1, -1), np.zeros((2, 3)), "parents"),
        (("a", "b"), (-1, -1), np.zeros((2, 3)), "parents"),
        (("a", "a"), (-1, 0), np.zeros((2, 3)), "same name"),
        (("a", "b"), (-1, 0), np.zeros((3, 3)), "offsets"),
        ((), (), np.zeros((0, 3)), "names"),
    ],
)
def test_what_is_no_tree_is_refused(names, parents, offsets, says):
    with pytest.raises(InputError, match=says):
        Skeleton(names, parents, offsets)


def test_joints_are_found_by_name_and_by_parent():
    assert ARM.index("lower") == 2 and ARM.children(0) == (1,) and len(ARM) == 3
    with pytest.raises(InputError, match="'hand'; |no joint 'hand'"):
        ARM.index("hand")


def test_arrays_are_copies_that_cannot_be_written():
    offsets = np.zeros((1, 3))
    skeleton = Skeleton(("root",), (-1,), offsets)
    offsets[0] = 1.0
    assert np.all(skeleton.offsets == 0.0)
    with pytest.raises(ValueError):
        skeleton.offsets[0, 0] = 1.0
    assert np.shares_memory(dataclasses.replace(skeleton, names=("hips",)).offsets, skeleton.offsets)
    view = offsets[:]
    view.setflags(write=False)  # but can be written by its owner
    assert not np.shares_memory(Skeleton(("root",), (-1,), view).offsets, view)


def test_same_bones_within_a_millimetre_and_the_same_fingerprint_within_a_tenth():
    near, far = (dataclasses.replace(ARM, offsets=ARM.offsets + shift) for shift in (1e-6, 2e-3))
    assert ARM.has_same_bones(near) and not ARM.has_same_bones(far) and ARM.has_same_bones(far, 0.01)
    assert ARM.fingerprint == near.fingerprint != far.fingerprint
    assert not ARM.has_same_bones(dataclasses.replace(ARM, names=("root", "upper", "hand")))
