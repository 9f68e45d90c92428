"""The menu to share, save and open a study."""
