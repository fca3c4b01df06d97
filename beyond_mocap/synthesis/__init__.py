"""From a plan to a take: resolve, search, construct.

`wanted` puts the order into frames of the library's rate, `block_costs` and `path_costs` say what things cost,
`blocks` finds the cheapest sequence and searches coarse to fine as Faustino §3.2 does,
`locomotion` adds or removes cycles until the travelled distance fits (§3.2.4), and `path_search` looks at speed and
turn together with words and continuity. Every search ends in an `edit_list`: which clip frame each output frame shows.
"""
