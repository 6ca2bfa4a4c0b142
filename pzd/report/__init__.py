"""What the passengers feel, and one page that tells the whole story."""
