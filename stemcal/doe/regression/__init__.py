"""Least squares, and the response surface fitted with it: a full quadratic model, its ANOVA and its reduction."""
