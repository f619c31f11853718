"""Runs of programs outside stemcal: what every solver of that kind shares.

`inputs` is what a run is given: files, with the factors' values written into those that are templates. `run_folders`
are what runs work in, `program_base` takes a run from beginning to end and names its failures. `readers` finds a series
of numbers in what a program leaves, `reductions` makes one number of it.
"""
