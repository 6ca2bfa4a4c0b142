"""Records made ready for the diagnosis: cleaned, some excluded, and split into what is fitted and what is not."""
