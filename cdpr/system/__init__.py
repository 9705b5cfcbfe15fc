"""Folders that commands may write to, files that appear whole, processes that end with theirs."""
