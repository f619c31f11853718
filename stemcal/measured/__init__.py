"""Laboratory data: stem diameters and shear-test curves, from the files of the machine to the targets of a spec.

headings      numbers, names and units in the languages of laboratories
cells         files of any encoding and workbooks of Excel → lines of cells
tables        where the numbers are among them, what is above, which column is meant
statistics    mean, standard deviation, intervals, normality, outliers
diameters     stem diameters → normal fit and grades
shear_curves  the columns of one force–displacement file → trimmed curves of its specimens and their maxima
shear         all specimens → forces per grade → the `targets` of a spec
curve_modes   scores of whole curves
"""
