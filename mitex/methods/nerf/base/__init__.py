"""From photos to the base shape that a texture lies on."""
