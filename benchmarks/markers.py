"""The section on optical markers: planted truth, faults, filters, real trials, speed, releases."""

from __future__ import annotations


def section() -> list[str]:
    """Lines for results.md; each part is loaded when it is measured."""
    from benchmarks import markers_planted, markers_real, markers_release

    parts = (
        ("Markers planted on known motions", markers_planted.truth_table),
        ("The same on bone", markers_planted.bone_table),
        ("Filters on planted markers", markers_planted.filter_table),
        ("Gaps, swaps, jumps and lost labels", markers_planted.fault_table),
        ("Frames a second", markers_planted.speed_table),
        ("Real trials", markers_real.trial_table),
        ("Releases of planted throws", markers_release.planted_table),
        ("Pitches against the radar", markers_release.radar_table),
    )
    return [line for title, part in parts for line in ("", f"### {title}", "", *part())][1:]
