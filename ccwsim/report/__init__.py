"""Reports as one HTML file for offline use, with text, tables, pictures, charts and judgements."""
