/* The Bingham element of Makowski and Knap 2021, eq. (1) to (3), with the effects that were found in the damper.
 *
 * Inputs are held over a step; within it every piece of the path is a closed form. Extension (rebound) is positive.
 */
#ifndef ELEMENT_H
#define ELEMENT_H

typedef struct {
    double deflection; /* elastic deflection x - y of the oil spring [m] */
    double effective;  /* control signal as the valve feels it */
    double branch;     /* elastic deflection of the second branch [m] */
} element_state;

typedef struct {
    double displacement; /* of the rod, counted from the zero of the effects [m] */
    double velocity;     /* [m/s] */
    double acceleration; /* for the inertia of the fluid alone [m/s2] */
    double signal;       /* control signal */
    double temperature;  /* [degC] */
} element_inputs;

/* The state at rest with the inputs, the oil spring carrying a force [N]. */
element_state element_start(const element_inputs *inputs, double force);

/* The state a step [s] later. */
element_state element_after(element_state state, const element_inputs *inputs, double step);

/* Force at the rod [N]. */
double element_force(element_state state, const element_inputs *inputs);

#endif
