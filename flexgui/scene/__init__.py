"""The arm in 3-D: where everything is (pure geometry), and its nodes in a viser scene."""
