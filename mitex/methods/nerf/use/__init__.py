"""A texture on the user's meshes, and what leaves the renderer."""
