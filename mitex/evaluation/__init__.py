"""How good a result is: measures, and the experiments of the papers."""
