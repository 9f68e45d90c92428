"""The page Import: the user's training image and hard data, and questions about them."""
