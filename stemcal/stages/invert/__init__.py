"""From the surface, or several, back to parameters, and how well these are known."""
