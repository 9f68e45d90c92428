"""What makes the program's bundled files; no part of the installed package."""
