"""Synthetic clips that repeat a stretch of a recording: strides of a run, and standing."""
