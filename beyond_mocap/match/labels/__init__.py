"""What players do and when, from events and solved touches, on the tracking's clock."""
