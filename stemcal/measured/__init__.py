"""What the laboratory brings: stem diameters and shear-test curves, from the machine's files to targets.

sheets          files of any encoding, workbooks of Excel
lines           where the numbers are among lines of cells, and what is above them
headings        numbers, names and units in the languages of laboratories
text_tables     one table of any separator and decimal mark, its columns by name or number
channels        which columns are one specimen's displacement and force
statistics      mean, standard deviation, intervals, normality, outliers
diameters       stem diameters → normal fit and grades
shear_curves    the specimens of one force–displacement file → trimmed curves and their maxima
shear           all specimens → forces per grade
curve_modes     scores of whole curves
target_entries  the `targets` section of a spec
"""
