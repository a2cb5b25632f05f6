"""The model beside the measurements."""
