"""The comparisons, one file each; `rows(size)` gives the lines of the table."""
