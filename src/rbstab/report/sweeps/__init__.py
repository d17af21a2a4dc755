"""What a report says of a sweep, part by part; `sections` puts the parts together."""
