"""What methods share that learn from words."""
