"""A whole match in pieces, made by any number of processes.

- `order`        what is asked; `folder` where it is made, by one run at a time; `state` what match.json says
- `make`         the whole way; `stages` its parts
- `roles`        who is there when and where; `words` what he does with the ball; `parts` his orders
- `pool`         pieces of work spread over processes or a cluster; `work` the kinds of them
- `units`        a player's plan cut into windows of work
- `cut_plan`     a plan between two times
- `searched`     what the search finds for one of them; `kept_pieces` keeps it
- `named_edit`   an edit list that names its clips by path
- `splice`       windows joined into one edit list
- `player_edit`  all that is kept of a player
- `expand`       the motion of any span of it; `shown` the same as everybody is to see it
- `crowd`        bodies kept apart; `crowd_window` a window of everybody, `kept_crowd` keeps it; `match_ball` the ball
- `figures`      a player's report
"""
