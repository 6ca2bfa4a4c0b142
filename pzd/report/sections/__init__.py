"""The steps of the story, one file each, in the order in which the page tells them."""
