"""The section on the ball: flight, aim, hit analysis, touches from tracking, contact."""

from __future__ import annotations


def section() -> list[str]:
    """Lines for results.md; each part is loaded when it is measured."""
    from benchmarks import ball_contact, ball_flight, ball_hits, ball_touches

    parts = (
        ("Flight and aim", ball_flight), ("Hit analysis and matching", ball_hits),
        ("Touches from tracking", ball_touches),
        ("Contact", ball_contact),
    )  # fmt: skip
    return [line for title, part in parts for line in ("", f"### {title}", "", *part.section())][1:]
