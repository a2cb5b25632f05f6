"""The page's panels: one file per stage of the work, found by walking this folder."""
