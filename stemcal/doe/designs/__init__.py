"""Which runs to make: designs by name, runs added to them, what they hide and what they can find."""
