"""The half-car of the paper on the identified damper: policies, fidelities, energy."""
