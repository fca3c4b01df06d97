"""What Faustino's thesis measured for its five scenarios (2016, chapter 5.2, Tables 1, 2 and 4)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ThesisFigures:
    """What the thesis measured for one scenario.

    Attributes:
        name: its name there.
        duration: s of motion.
        distance: m from the track, mean over the whole and at the key moments (Table 1, without catch-up).
        similarity: eq. 18, mean over the whole and at the key moments (Table 2).
        seconds: to synthesize with foot-skate and with it minimized (Table 4, Intel Core i7-5600U).
    """

    name: str
    duration: float
    distance: tuple[float, float]
    similarity: tuple[float, float]
    seconds: tuple[float, float]


THESIS = {
    "52a6a673f930577814c92293a5158487b4d1ab951bc7c7dce0872cd19c6cd62c": ThesisFigures(
        name="1, Gerrard", duration=20.0, distance=(4.52, 1.20), similarity=(-0.05, -1.0), seconds=(65.0, 148.0)),
    "2f30a6e0a08bc0d3ef796cfb94024df462b0c9e9fcb382f9caf291b541f058bf": ThesisFigures(
        name="2, Messi", duration=22.5, distance=(3.42, 2.14), similarity=(-0.54, -0.24), seconds=(95.0, 215.0)),
    "49c390dc510ab76be1e13573956af19afedba214a966b1f4cea13d0b5f4202f1": ThesisFigures(
        name="3, Vilhena", duration=22.5, distance=(3.24, 3.50), similarity=(-0.09, -0.75), seconds=(34.0, 353.0)),
    "34418919b949fc6c2059203d3337e7d505b507aac8eb9df957db11fb73fc9591": ThesisFigures(
        name="4, Lennon", duration=21.0, distance=(1.21, 3.19), similarity=(-0.34, -0.44), seconds=(199.0, 477.0)),
    "74d21aceb62db13afd1541e917b2a3320179cd94798eaf061a7f6d26d9d53e2a": ThesisFigures(
        name="5, Hein", duration=19.5, distance=(1.86, 1.20), similarity=(-0.25, -0.80), seconds=(94.0, 614.0)),
}  # fmt: skip
"""SHA-256 of the track that stands for a scenario of the thesis -> what the thesis measured.

A file's name says nothing of its content: only the very tracks that this project measures on are compared with it.
"""
