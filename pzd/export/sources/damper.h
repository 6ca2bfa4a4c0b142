/* The table of a controlled damper for a control unit: force, the signal for a force, and the comfort law.
 *
 * Single precision, no allocation, no state; the run time is the same for every input. Extension (rebound) is positive
 * for deflection, velocity and force. The sign bit of a velocity of 0 picks the side of the dry friction. Beyond the
 * outermost signals and temperatures the table is held; beyond its last speed it is held or goes on, as the config says.
 */
#ifndef DAMPER_H
#define DAMPER_H

/* Force [N] at a temperature [degC], a control signal and a rate of extension [m/s]. */
float damper_force(float temperature, float signal, float velocity);

/* Lowest and highest force [N] that any signal gives at a temperature [degC] and a rate of extension [m/s]. */
void damper_range(float temperature, float velocity, float *low, float *high);

/* Lowest control signal whose force comes nearest to a wanted one [N] at a temperature [degC] and a rate [m/s]. */
float damper_signal(float temperature, float force, float velocity);

/* Forces and signals of both axles that make the acceleration at the comfort point K smallest, through the table.
 *
 * Makowski and Knap 2021, eq. (9) to (12): |a_0 + D^T T| least over the forces T within reach.
 *
 * temperature  of the dampers [degC]
 * deflection   of each suspension from where the car stands [m]
 * rate         of each deflection [m/s]
 * force        filled with the force of each axle [N], that of all its dampers at the wheel
 * signal       filled with the control signal of each axle
 */
void damper_comfort(float temperature, const float deflection[2], const float rate[2], float force[2], float signal[2]);

#endif
