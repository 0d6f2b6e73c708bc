"""Pages of the documentation's reference that are made from the code and the catalogues, never by hand."""
