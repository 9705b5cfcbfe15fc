"""What is there and happens: robots as declared, bodies, undeclared effects, runs drawn."""
