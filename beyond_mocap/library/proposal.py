"""A proposal: labels that a recording may carry, how sure they are, and why."""

from __future__ import annotations

from dataclasses import dataclass

from ..annotation import ClipAnnotation

RULES, LEARNED = "rules", "learned"


@dataclass(frozen=True)
class Proposal:
    """Words for a stretch of a recording, in its own frames; confidence: 0 to 1; why: what was seen, for a person;
    source: RULES, or LEARNED from annotated clips."""

    annotation: ClipAnnotation
    confidence: float
    why: str
    source: str = RULES
