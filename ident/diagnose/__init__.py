"""Find the residual, trace it to a missing effect, add that effect, report before and after."""
