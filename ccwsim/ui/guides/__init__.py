"""The page Guides: probabilities, active cells, directions, zones and further images."""
