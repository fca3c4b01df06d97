"""Requests, previews, variants and quality of takes, and what is out of date."""

REGISTERED = ("freshness", "result")
