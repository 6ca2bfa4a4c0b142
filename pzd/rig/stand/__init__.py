"""The virtual test stand: waveforms, voltage and temperature programmes, warming, frame, sensors."""
