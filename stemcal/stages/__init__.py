"""The stages of a study. `base` has the one list of them; each has a module or folder with its result and its function.

design      which design a stage runs, in coded and natural units, and its runs once answered
lineage     whether the file of an earlier stage still belongs to this spec
result      what every stage's result has: how it begins, JSON, tables, runs
making      a stage of the list run, or its result read
results     the results of a study as far as it has come
"""
