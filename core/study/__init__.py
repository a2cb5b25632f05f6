"""Studies: hidden effects of a chosen size, the blind matrix, and challenges for people."""
