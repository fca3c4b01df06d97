"""Recordings with known answers, for tests, benchmarks and the sample."""
