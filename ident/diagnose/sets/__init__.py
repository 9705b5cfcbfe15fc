"""Sets of wrong places that replace one another."""
