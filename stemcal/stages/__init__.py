"""The stages of a study. `stage` has the one list of them; each has a folder with these files.

options        its section of the spec, and the rules of the section
analysis       how its result is found, with the notes on it
result         what it leaves in its file
words          its sentences, where there are many
showing        its sentences, tables and figures in report and terminal (`figures` where there are many)
verdict_rules  its rules of the verdict; those about all runs are in the folder `verdict`

The other modules are shared: `design` has the runs of a design, `fitting` the surfaces and their fit,
`loop` the search of the refinement, `fresh` what a stage was made of, `results` the results of a study so far.
"""
