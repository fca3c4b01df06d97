"""Synthesis of one player: resolve a plan, search the library for clips, construct the final motion.

`search_library` adds synthetic clips to the recordings where a plan needs them, by the actions that it asks for
(`requested_actions`). `search.request` converts a plan into frames at the library's rate, `search.block_costs`,
`search.path_costs` and `search.cut_costs` hold the costs. `search.blocks` finds the sequence of blocks with the
lowest cost, coarse to fine (Faustino 2016, §3.2), `search.locomotion` adds or removes cycles until the travelled
distance fits (§3.2.4), and `search.path_search` weighs speed and turning together with labels and continuity. Every
search returns an `EditList`: the clip frame that each output frame shows.
"""
