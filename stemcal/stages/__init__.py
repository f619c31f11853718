"""What the stages of `stemcal.workflow` are made of, one concern per module.

layout      which design a stage runs, in coded and natural units
answering   requests → records, finished ones looked up, the others computed
computing   runs in the hands of an executor, and what their failures are called
policy      what the spec says about runs that fail
ledger      every run and what has become of it
inspection  whether the study folder is sound
artefacts   the files a stage leaves
lineage     whether the file of an earlier stage still belongs to this spec
surfacing   the fit of the surface, and what stands beside it
turning     from the regression surface to the calibrated parameters
joining     the same for several diameters at once
certainty   how well the measured forces fix the parameters
stepping    runs that are decided one by one
climbing    steps towards the target between screening and surface
refining    the closed loop: simulate at the solution, correct it, again
audit       computed figures against printed ones, table by table
auditing    the audit of a whole paper
suspicions  what its numbers say about each other
remarks     sentences about signs, scatter and tables
planning    what would be run, and what it would cost
"""
