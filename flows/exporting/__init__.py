"""A dataset in the formats that other teams' tools read: one module a format, one table of them."""
