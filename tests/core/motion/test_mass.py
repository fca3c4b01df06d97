"""The centre of mass, by the segment masses of men and women."""

import numpy as np
import pytest

from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.mass import SEGMENT_MASSES, compute_centre_of_mass
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthetic.gait import build_gait

DE_LEVA = {  # thigh, shank, foot, upper arm, forearm, hand; head; trunk: table 4, per cent of the body's mass
    "men": (14.16, 4.33, 1.37, 2.71, 1.62, 0.61, 6.94, 43.46),
    "women": (14.78, 4.81, 1.29, 2.55, 1.38, 0.56, 6.68, 42.57),
}  # fmt: skip


@pytest.fixture(scope="module")
def standing():
    motion = build_gait(0.0, 1.0, 30.0, seed=4)
    return identify_joints(motion.skeleton), forward_kinematics(motion)[0]


@pytest.mark.parametrize("who", DE_LEVA)
def test_the_trunk_has_what_the_other_segments_leave(who):
    *limbs, head, trunk = DE_LEVA[who]
    masses = SEGMENT_MASSES[who]
    assert [mass for mass, _ in masses.limbs] == pytest.approx([mass / 100.0 for mass in limbs])
    rest = 1.0 - masses.head - 2.0 * sum(mass for mass, _ in masses.limbs)
    assert (masses.head, rest) == pytest.approx((head / 100.0, trunk / 100.0), abs=2e-4)


def test_men_and_women_have_their_centre_of_mass_within_a_centimetre_of_the_same_skeleton(standing):
    body, places = standing
    men, women = (compute_centre_of_mass(body, places, SEGMENT_MASSES[who]) for who in ("men", "women"))
    apart = np.linalg.norm(men - women, axis=1)
    assert np.all((apart > 1e-3) & (apart < 1e-2))
    assert np.array_equal(men, compute_centre_of_mass(body, places))


def test_a_segment_pulls_by_its_mass(standing):
    body, places = standing
    moved = places.copy()
    moved[:, body.head, 0] += 1.0
    for masses in SEGMENT_MASSES.values():
        pull = compute_centre_of_mass(body, moved, masses) - compute_centre_of_mass(body, places, masses)
        assert pull == pytest.approx(np.tile([masses.head, 0.0, 0.0], (len(places), 1)))
