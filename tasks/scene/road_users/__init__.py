"""Road users beside the ego vehicle: their bodies, and the tracks on which these move."""
