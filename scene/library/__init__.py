"""The library's clips in the scene."""

REGISTERED = ("clips",)
