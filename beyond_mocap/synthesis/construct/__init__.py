"""From what a search chose to a body: source frames laid on a track, feet planted, the ball met."""
