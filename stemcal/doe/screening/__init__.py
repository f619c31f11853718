"""Two-level effects and what they are tested against."""
