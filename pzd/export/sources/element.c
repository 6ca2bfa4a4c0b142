#include "element.h"

#include "element_data.h"
#ifdef DAMPER_LOOKUP
#include "lookup_data.h"
#endif

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

#ifdef DAMPER_LOOKUP
static real share_of(real value, real limit, int nodes, int *low)
{
    const real place = most(R(0.0), least(R(1.0), (value + limit) / (R(2.0) * limit))) * (real)(nodes - 1);
    *low = (int)place < nodes - 2 ? (int)place : nodes - 2;
    return place - (real)*low;
}

/* Elastic deflection [m] after LOOKUP_STEP, by the table. */
static real looked_up(real deflection, real velocity, real effective, real temperature)
{
    real warmer, higher, found[2][2];
    const int t = place_of(LOOKUP_AT_TEMPERATURE, LOOKUP_TEMPERATURES, temperature, &warmer);
    const int s = place_of(LOOKUP_AT_SIGNAL, LOOKUP_SIGNALS, effective, &higher);
    const int ts[] = {t, t + 1 < LOOKUP_TEMPERATURES ? t + 1 : t}, ss[] = {s, s + 1 < LOOKUP_SIGNALS ? s + 1 : s};
    const real limit = between(between(LOOKUP_MOST[ts[0]][ss[0]], LOOKUP_MOST[ts[1]][ss[0]], warmer),
                               between(LOOKUP_MOST[ts[0]][ss[1]], LOOKUP_MOST[ts[1]][ss[1]], warmer), higher);
    int i, j;
    const real a = share_of(deflection, limit, LOOKUP_DEFLECTIONS, &i);
    const real b = share_of(velocity, LOOKUP_SPEED, LOOKUP_SPEEDS, &j);
    for (int n = 0; n < 2; n++)
        for (int m = 0; m < 2; m++) {
            const real(*after)[LOOKUP_SPEEDS] = LOOKUP_AFTER[ts[n]][ss[m]];
            found[n][m] = between(between(after[i][j], after[i + 1][j], a),
                                  between(after[i][j + 1], after[i + 1][j + 1], a), b);
        }
    return limit * between(between(found[0][0], found[1][0], warmer), between(found[0][1], found[1][1], warmer), higher);
}
#endif

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
#ifdef DAMPER_LOOKUP
    state.path[0] = looked_up(state.path[0], R(0.5) * (over.u0 + over.u1), last, end->temperature);
#else
    path_advance(state.path, over, TOLERANCE, 0);
#endif
    return state;
}

real element_force(element_state state, const element_inputs *inputs)
{
    const real effective = settled(&state, inputs->signal);
    parameters p = parameters_at(effective, inputs->temperature);
    return regimes_spring_force(state.path[0], p.element) + kernels_branch_force(R(0.0), state.branches, p.parallel) +
           kernels_parallel_force(inputs->displacement, inputs->velocity, inputs->acceleration, p.parallel);
}

static parameters parameters_now(const element_state *state, const element_inputs *inputs)
{
    element_state passed = *state;
    return parameters_at(settled(&passed, inputs->signal), inputs->temperature);
}

void element_rates(element_state state, const element_inputs *inputs, real rates[RATES], real indicators[INDICATORS])
{
    const real drive[] = DRIVE;
    const parameters p = parameters_now(&state, inputs);
    const real force = regimes_spring_force(state.path[0], p.element), side = M(copysign)(R(1.0), force);
    for (int n = 0; n < RATES; n++)
        rates[n] = R(0.0);
    rates[DEFLECTION_RATE] = inputs->velocity - side * flow_flow_speed(M(fabs)(force), p.element, side, R(0.0));
    drive_rates(inputs->signal, state.drive, drive, rates + DRIVE_RATES);
    for (int n = 0; n < 2; n++) {
        const real to = n == 0 ? R(1.0) : R(-1.0), opens = flow_relief(p.element, to);
        const real above = regimes_over_yield(state.path[0], p.element, to);
        indicators[YIELDS + n] = above;
        indicators[RELIEFS + n] = isfinite(opens) ? above + flow_breakaway(p.element, to) - opens : R(-1.0);
    }
    indicators[TURNS] = inputs->velocity;
}

element_state element_moved(element_state state, const element_inputs *inputs, real travel)
{
    parameters p = parameters_now(&state, inputs);
    kernels_branches_follow(travel, state.branches, p.parallel);
    return state;
}
