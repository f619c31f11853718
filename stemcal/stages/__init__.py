"""What the stages of `stemcal.workflow` are made of, one concern per module.

layout      which design a stage runs, in coded and natural units
answering   requests → records, finished ones looked up, the others sent to the executor
artefacts   the files a stage leaves
lineage     whether the file of an earlier stage still belongs to this spec
turning     from the regression surface to the calibrated parameters
audit       computed figures against printed ones
remarks     sentences about signs, scatter and tables
planning    what would be run, and what it would cost
"""
