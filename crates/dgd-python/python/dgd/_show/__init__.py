"""What a person sees: pictures, pages, tables, progress, and cells of notebooks."""
