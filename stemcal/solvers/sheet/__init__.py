"""Sheets: runs and their results as rows of a CSV file or a workbook, and the solver that reads answers from them."""
