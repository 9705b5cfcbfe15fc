"""FIDIM as published: total least squares of the internal dynamics, weighted and with payloads."""
