"""Quality of a take: the measures that synthesis itself needs, and the report of unmet constraints."""
