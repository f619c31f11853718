"""What the laboratory brings: stem diameters and shear-test curves, from the machine's files to targets.

reading      files of any encoding, separator and decimal mark → a table of texts
numerals     numbers as people and machines write them
headings     names and units of columns
columns      which column is force, which displacement, and in which unit
samples      mean, standard deviation, intervals
normality    does a sample look normal: Shapiro–Wilk, Anderson–Darling
outliers     Grubbs' test: names a suspect, drops nothing
diameters    stem diameters → normal fit and grades
curves       one force–displacement file → trimmed curve and its maximum
shear        all specimens → forces per grade
scaling      force over diameter as a power law
targets      the `targets` section of a spec
"""
