"""One page over a match that was made: how well every player came out, and the worst seconds first.

    Path("report.html").write_text(page(folder), encoding="utf-8")

`folder` is what `beyond-mocap match ... --out FOLDER` wrote; docs/match/match-report.md says what is read from it.
"""
