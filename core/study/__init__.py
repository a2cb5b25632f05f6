"""Studies: hidden effects of a chosen size, and challenges for people."""
