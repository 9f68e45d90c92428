"""Scripts that make the bundled files; they are not part of the installed package."""
