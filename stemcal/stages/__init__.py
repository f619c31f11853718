"""The stages of a study. `stage` has the one list of them; each has a folder with its entry point, options and result.

design      which design a stage runs, in coded and natural units, and its runs once answered
result      what every stage's result has: how it begins, JSON, tables, runs
fresh       what a stage was made of; one of the list made, or read where it is fresh
results     the results of a study as far as it has come
"""
