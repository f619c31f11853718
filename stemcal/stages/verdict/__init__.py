"""What a study comes to in a word, by stated rules: each reason with the step that mends it.

`rules.RULES` are the rules, in the order in which their reasons are told; `advice` makes the numbers of the next step.
"""
