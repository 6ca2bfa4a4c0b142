#include "element.h"

#include "element_data.h"

/* All parameters at one moment: the row of the element, that of the parallel forces, and those of the material. */
typedef struct {
    row element;
    real parallel[PARALLEL];
} parameters;

static real between(real low, real high, real share)
{
    return low == high ? low : low + share * (high - low); /* equal infinities stand */
}

static int place_of(const real *nodes, int count, real value, real *share)
{
    int i = 0;
    *share = R(0.0);
    if (count < 2)
        return 0;
    while (i < count - 2 && value >= nodes[i + 1])
        i++;
    *share = most(R(0.0), least(R(1.0), (value - nodes[i]) / (nodes[i + 1] - nodes[i])));
    return i;
}

/* Linear over temperature and effective signal, held beyond; the material as it is at the temperature. */
static parameters parameters_at(real effective, real temperature)
{
    real warmer, higher, own[COLUMNS]; /* shares of the nodes above */
    parameters p;
    const int t = place_of(TEMPERATURES, TEMPERATURE_NODES, temperature, &warmer);
    const int s = place_of(SIGNALS, SIGNAL_NODES, effective, &higher);
    const int t1 = t + 1 < TEMPERATURE_NODES ? t + 1 : t, s1 = s + 1 < SIGNAL_NODES ? s + 1 : s;
    for (int n = 0; n < COLUMNS; n++)
        own[n] = between(between(ROWS[t][s][n], ROWS[t1][s][n], warmer),
                         between(ROWS[t][s1][n], ROWS[t1][s1][n], warmer), higher);
    for (int n = 0; n < ROW; n++)
        p.element.at[n] = own[n];
    for (int n = 0; n < PARALLEL; n++)
        p.parallel[n] = own[ROW + n];
    p.element = material(p.element, own + ROW + PARALLEL, temperature, REFERENCE_TEMPERATURE);
    return p;
}

/* The effective signal once the control signal has come to a value at once; the drive is left there. */
static real settled(element_state *state, real signal)
{
    real drive[] = DRIVE;
    return kernels_follow_voltage(signal, signal, R(0.0), state->drive, drive);
}

static int same(const row *one, const row *other)
{
    int alike = 1;
    for (int n = 0; n < ROW; n++)
        alike = alike && one->at[n] == other->at[n];
    return alike;
}

element_state element_start(const element_inputs *inputs, real force)
{
    element_state state = {{R(0.0)}, {R(0.0)}, {R(0.0)}};
    for (int n = 0; n < DRIVES; n++)
        state.drive[n] = inputs->signal;
    state.path[0] = regimes_deflection_at(force, parameters_at(inputs->signal, inputs->temperature).element);
    return state;
}

element_state element_after(element_state state, const element_inputs *start, const element_inputs *end, real step)
{
    real drive[] = DRIVE;
    const real first = settled(&state, start->signal);
    parameters before = parameters_at(first, start->temperature);
    const real last = kernels_follow_voltage(start->signal, end->signal, step, state.drive, drive);
    parameters after = parameters_at(last, end->temperature);
    const time_step over = {step, start->velocity, end->velocity, before.element, after.element,
                            !same(&before.element, &after.element)};
    kernels_branches_follow(R(0.0), state.branches, before.parallel);
    compose_advance_branches(R(0.5) * (over.u0 + over.u1) * step, over.u0, over.u1, step, state.branches, after.parallel);
    path_advance(state.path, over, TOLERANCE, 0);
    return state;
}

real element_force(element_state state, const element_inputs *inputs)
{
    const real effective = settled(&state, inputs->signal);
    parameters p = parameters_at(effective, inputs->temperature);
    return regimes_spring_force(state.path[0], p.element) + kernels_branch_force(R(0.0), state.branches, p.parallel) +
           kernels_parallel_force(inputs->displacement, inputs->velocity, inputs->acceleration, p.parallel);
}
