"""A whole match: from provider files to everybody's motion and the ball, in pieces that any number of processes make.

- `units`        a player's plan cut into windows of work
- `cut_plan`     a plan between two times
- `searched`     what the search finds for one of them
- `named_edit`   an edit list that names its clips by path
- `splice`       windows joined into one edit list
- `player_edit`  all that is kept of a player
- `expand`       the motion of any span of it
"""
