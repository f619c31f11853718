"""The stages of a study. `base` has the one list of them; each has a module or folder with its result and its function.

design      which design a stage runs, in coded and natural units, and its runs once answered
result      what every stage's result has: how it begins, JSON, tables, runs
fresh       what a stage was made of; one of the list made, or read where it is fresh
results     the results of a study as far as it has come
"""
