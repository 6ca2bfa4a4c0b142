"""The tests of the trade: peak- and continuous-velocity plots, gas force, friction, response to a step."""
