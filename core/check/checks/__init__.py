"""One file per fault; found by walking this folder."""
