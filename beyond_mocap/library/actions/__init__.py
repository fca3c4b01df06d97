"""Clips of synthetic actions, which `library.missing_actions` builds, beside the cache."""
