"""CasADi expressions as machine code: the same bits, tens of times faster than its interpreter."""
