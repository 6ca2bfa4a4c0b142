"""What a test of a damper usually shows: peak- and continuous-velocity plot, gas force, friction, step response."""
