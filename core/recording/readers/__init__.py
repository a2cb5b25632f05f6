"""One file per kind of table that can be read; found by walking this folder."""
