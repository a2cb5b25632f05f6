"""Pure functions from results to figures and tables; the page and the report show the same."""
