"""A finished dataset for people: queries, windows, films, pages."""
