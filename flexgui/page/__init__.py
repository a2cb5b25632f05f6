"""The page of one browser, around its stages."""
