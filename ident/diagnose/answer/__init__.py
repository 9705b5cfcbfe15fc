"""How a diagnosis is told: values with honest deviations, in the directions that data see."""
