"""What the laboratory brings: stem diameters and shear-test curves, from the machine's files to targets.

text_tables     files of any encoding, separator and decimal mark → tables of texts
encodings       which encoding a file is written in
workbook        the sheets of an Excel workbook
lines           where the numbers stand among lines of cells, and what stands over them
numerals        numbers as people and machines write them
vocabulary      what columns are called in the languages of laboratories
headings        names and units of columns
columns         a column by its name or number, and its unit
channels        which columns are one specimen's displacement and force
samples         mean, standard deviation, intervals
normality       does a sample look normal: Shapiro–Wilk, Anderson–Darling
outliers        Grubbs' test: names a suspect, drops nothing
diameters       stem diameters → normal fit and grades
shear_curves    the specimens of one force–displacement file → trimmed curves and their maxima
shear           all specimens → forces per grade
target_entries  the `targets` section of a spec
"""
