"""What the constancy of cable lengths along each run says of the geometry, whatever forces act."""
