"""The equations of a platform on cables, stated once in CasADi, and what follows from them."""
