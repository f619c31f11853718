"""Where a surface, or several, give what was measured, and how well that fixes the factors."""
