"""NeRF-Texture: textures with a meso-structure, captured from photos (Huang et al. 2023)."""
