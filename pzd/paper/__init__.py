"""What the paper of Makowski and Knap (2021) prints, and what must be assumed to compute it."""
