"""The response surface: design rows → forces → regression, analysis of variance, and what stands beside them."""
