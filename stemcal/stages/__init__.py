"""What the stages of `stemcal.workflow` are made of, one concern per module.

layout      which design a stage runs, in coded and natural units
answering   requests → records, finished ones looked up, the others computed
computing   runs in the hands of an executor, and what their failures are called
policy      what the spec says about runs that fail
ledger      every run and what has become of it
inspection  whether the study folder is sound
artefacts   the files a stage leaves
lineage     whether the file of an earlier stage still belongs to this spec
turning     from the regression surface to the calibrated parameters
audit       computed figures against printed ones
remarks     sentences about signs, scatter and tables
planning    what would be run, and what it would cost
"""
