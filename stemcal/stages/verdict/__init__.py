"""The verdict of a study by stated rules, each reason with its remedy.

`rules.RULES` are the rules, in the order of their reasons; `advice` computes the numbers of the remedies.
"""
