"""Commands on single files: other programs' formats, boards to print."""
