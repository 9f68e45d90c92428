"""The page Import: files of a training image and of hard data, and questions about the files."""
