"""The one page writer: a page is text, tables and figures, in one template and one style sheet."""
