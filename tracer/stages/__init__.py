"""From pixel to radiance: one file a step of the specification's light path."""
