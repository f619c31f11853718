"""The verdict of a study by stated rules, each reason with its remedy.

Stages give their reasons (`Stage.reasons`), `verdict_rules` those about all runs and the order of all; `advice`
computes the numbers of the remedies.
"""
