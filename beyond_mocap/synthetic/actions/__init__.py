"""Synthetic actions as tables of key poses: a goalkeeper's moves, celebrations and gestures."""
