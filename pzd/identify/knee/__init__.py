"""The knee law of a passive damper: fitted, judged, and held to Bingham's on tests kept back."""
