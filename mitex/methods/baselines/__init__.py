"""What the four systems are compared with."""
