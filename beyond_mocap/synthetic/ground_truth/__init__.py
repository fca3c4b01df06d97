"""Synthetic recordings with ground truth, for tests, benchmarks and the sample."""
