"""Which runs to make: designs by name, runs added to them, and their aliases."""
