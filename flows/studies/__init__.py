"""The paper's studies of the vehicle model."""
