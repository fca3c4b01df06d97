"""What a take is measured by while it is made, and what gave way."""
