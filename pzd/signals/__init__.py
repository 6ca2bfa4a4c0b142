"""What any record is made of: cycles, kinematics, smoothing, recursions, autoregression, harmonics, roads."""
