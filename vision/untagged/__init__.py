"""A platform without tags: followed by the features that it has of itself."""
