"""Foreign truth: machines of 150 cells and more, integrated here, against a user's network of 4 to 8 lumps."""
