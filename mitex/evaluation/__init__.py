"""How good a result is: measures."""
