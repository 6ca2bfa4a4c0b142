/* The Bingham element of Makowski and Knap 2021, eq. (1) to (3), with the effects that were found in the damper.
 *
 * Inputs go linearly over a step, or are held where both ends are the same. Within the step the path is a closed form
 * where there is one, and else integrated piece by piece; `laws.c` holds both, and every law. Extension (rebound) is
 * positive. No memory is allocated. To build: cc -std=c99 -O2 -c element.c laws.c, in single precision with
 * -DDAMPER_SINGLE. With -DDAMPER_LOOKUP the path is a look-up in `lookup_data.h`, which `--to c-lookup` writes: of
 * LOOKUP_STEP whatever the step, in the same time for every input.
 */
#ifndef ELEMENT_H
#define ELEMENT_H

#include "laws.h"

typedef struct {
    real path[STATES];       /* elastic deflection x - y of the oil spring [m], and the last flow speed [m/s] */
    real drive[DRIVES];      /* control signal behind each effect of the drive */
    real branches[BRANCHES]; /* elastic deflection of each branch [m] */
} element_state;

typedef struct {
    real displacement; /* of the rod, counted from the zero of the effects [m] */
    real velocity;     /* [m/s] */
    real acceleration; /* for the inertia of the fluid alone [m/s2] */
    real signal;       /* control signal */
    real temperature;  /* [degC] */
} element_inputs;

/* The state at rest with the inputs, the oil spring carrying a force [N]. */
element_state element_start(const element_inputs *inputs, real force);

/* The state a step [s] later, the inputs going linearly from `start` to `end`. */
element_state element_after(element_state state, const element_inputs *start, const element_inputs *end, real step);

/* Force at the rod [N]. */
real element_force(element_state state, const element_inputs *inputs);

/* The equations of state, for a solver: places of the deflection and of the drive in a row of their rates. */
enum { DEFLECTION_RATE, DRIVE_RATES, RATES = DRIVE_RATES + DRIVES };

/* What changes its sign where a rate bends: at yield and at the relief valve to either side, and where the rod turns. */
enum { YIELDS, RELIEFS = YIELDS + 2, TURNS = RELIEFS + 2, INDICATORS };

/* Rates of the states, and the indicators, at one moment. */
void element_rates(element_state state, const element_inputs *inputs, real rates[RATES], real indicators[INDICATORS]);

/* The state with its branches after a travel [m] of the rod to one side. */
element_state element_moved(element_state state, const element_inputs *inputs, real travel);

#endif
