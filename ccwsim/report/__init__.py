"""Reports as one HTML file that works offline: text, tables, pictures, charts, judgements."""
