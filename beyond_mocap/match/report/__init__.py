"""One page over a synthesized match: how good each player is, and the worst seconds first.

    Path("report.html").write_text(build_match_page(folder), encoding="utf-8")

`folder` is what `beyond-mocap match ... --out FOLDER` wrote; docs/reference/match-report.md lists what is read from it.
"""
