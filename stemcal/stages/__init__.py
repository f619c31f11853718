"""The stages of a study. The module `stage` lists them; each stage is a package with these modules.

options        its section of the spec, and the rules of the section
analysis       the computation of its result and of the notes on it
result         its result, as stored in its file
words          its sentences, if there are many
showing        its sentences, tables and figures in report and terminal (`figures` if there are many)
verdict_rules  its rules of the verdict; rules about all runs are in the package `verdict`

The other modules are shared: `design` defines the runs of a design, `fitting` the surfaces and their fit to the
measurements, `loop` the search of the refinement; `fresh` checks stage files, `results` reads the results of a study.
"""
