"""The clean-up of a trial: swaps, jumps, unlabeled markers and gaps (Fredriksson §5.1)."""
