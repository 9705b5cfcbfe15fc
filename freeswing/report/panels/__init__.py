"""The sections of the page, one a file; each copes with results that are not there."""
