"""Laboratory data: stem diameters and shear-test curves, from the files of the machine to the targets of a spec.

headings      names and units of columns in the languages of laboratories
cells         files of any encoding and workbooks of Excel → lines of cells, and which of them are data
tables        lines of cells → tables, whose columns have names, units and numbers
statistics    mean, standard deviation, intervals, normality, outliers
diameters     stem diameters → normal fit and grades
shear_curves  the columns of one force–displacement file → trimmed curves of its specimens and their maxima
shear         all specimens → forces per grade → the `targets` of a spec
curve_modes   scores of whole curves
"""
