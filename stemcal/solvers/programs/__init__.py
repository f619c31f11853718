"""Runs of programs outside stemcal: what every solver of that kind shares.

`inputs` is what a run is given, `program_base` takes it from beginning to end and names its failures, `readers` makes a
number of what a program leaves.
"""
