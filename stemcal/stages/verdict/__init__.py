"""The verdict of a study: reasons from rules, each with its remedy.

Stages provide their rules (`Stage.reasons`). `verdict_rules` has the rules about all runs and sorts all reasons;
`advice` computes the numbers in the remedies.
"""
