"""How good a result is: consistency, laws, predictions of runs kept apart."""
