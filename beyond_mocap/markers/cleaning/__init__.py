"""Clean a trial: label swaps, jumps, unlabeled markers and gaps (Fredriksson section 5.1)."""
