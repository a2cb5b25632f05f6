"""The parts of a study, one file each: which cases it has and what one case computes."""
