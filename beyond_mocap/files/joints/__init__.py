"""Skeletal tracking: the joints of people over time, as cameras around a pitch see them."""
