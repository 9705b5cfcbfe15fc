"""From the wrench that is wanted to currents that keep every cable between its limits."""
