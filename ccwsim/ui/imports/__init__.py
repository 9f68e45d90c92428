"""Files of the user: a training image and hard data, and what they leave open."""
