"""What the model of a driven robot lacks: screened, fitted, judged on held-out runs."""
