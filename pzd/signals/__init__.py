"""Signal processing of any record: cycles, kinematics, smoothing, noise, lack of fit, harmonics and road spectra."""
