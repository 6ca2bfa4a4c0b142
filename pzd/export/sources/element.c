#include "element.h"

#include <math.h>

#include "element_data.h"

#define MOST_PIECES 16      /* a path that only rises or falls passes five regimes */
#define MOST_NEWTON_STEPS 60
#define ROUNDING 1e-15

/* One direction of the flow: |F| = friction + c w + q w^2, and beyond `opens` the slope `beyond`. */
typedef struct {
    double friction, c, q, opens, beyond, speed_open;
} curve;

static double between(double low, double high, double share)
{
    return low == high ? low : low + share * (high - low); /* equal infinities stand */
}

static int place_of(const double *nodes, int count, double value, double *share)
{
    int i = 0;
    *share = 0.0;
    if (count < 2)
        return 0;
    while (i < count - 2 && value >= nodes[i + 1])
        i++;
    *share = fmin(fmax((value - nodes[i]) / (nodes[i + 1] - nodes[i]), 0.0), 1.0);
    return i;
}

/* Play (backlash) of half-width r: Ue = max(U - r, min(U + r, Ue)). */
static double felt(double effective, double signal)
{
    return fmax(signal - PLAY, fmin(signal + PLAY, effective));
}

/* The parameters now: linear over temperature and effective signal, held beyond, T0 and C as the drift has them. */
static void parameters(double effective, double temperature, double *p)
{
    double warmer, higher; /* shares of the nodes above */
    const int t = place_of(TEMPERATURES, TEMPERATURE_NODES, temperature, &warmer);
    const int s = place_of(SIGNALS, SIGNAL_NODES, effective, &higher);
    const int t1 = t + 1 < TEMPERATURE_NODES ? t + 1 : t, s1 = s + 1 < SIGNAL_NODES ? s + 1 : s;
    for (int n = 0; n < COLUMNS; n++)
        p[n] = between(between(ROWS[t][s][n], ROWS[t1][s][n], warmer),
                       between(ROWS[t][s1][n], ROWS[t1][s1][n], warmer), higher);
    p[T0] *= exp(-p[TEMPERATURE_DRIFT_BETA_T0] * (temperature - REFERENCE_TEMPERATURE));
    p[C] *= exp(-p[TEMPERATURE_DRIFT_BETA_C] * (temperature - REFERENCE_TEMPERATURE));
}

/* Flow speed [m/s] at a force `over` the friction [N], the relief valve shut. */
static double shut_speed(double over, double c, double q)
{
    return 2.0 * over / (c + sqrt(c * c + 4.0 * q * over));
}

static curve curve_of(const double *p, double side)
{
    const double factor = 1.0 + p[ASYMMETRY_ALPHA] * side, bleed = 1.0 + p[KNEE_BETA] * side;
    const double knee = side > 0.0 ? p[KNEE_F_REB] : p[KNEE_F_COMP];
    const int first = knee < p[RELIEF_VALVE_F_R];
    const double beyond = !first ? p[RELIEF_VALVE_C_R] : side > 0.0 ? p[KNEE_C_REB] : p[KNEE_C_COMP];
    curve flow = {p[T0] * factor, p[C] * factor * bleed, p[ORIFICE_QUADRATIC_Q], 0.0, beyond, INFINITY};
    flow.opens = fmax(fmin(knee, p[RELIEF_VALVE_F_R]), flow.friction);
    if (isfinite(flow.opens))
        flow.speed_open = shut_speed(flow.opens - flow.friction, flow.c, flow.q);
    return flow;
}

/* Force of the oil spring [N] at a deflection, behind a play of whole width delta. */
static double spring(double deflection, const double *p)
{
    const double extension = fabs(deflection) - 0.5 * p[LASH_DELTA];
    return extension > 0.0 ? copysign(p[K] * extension, deflection) : 0.0;
}

/* Deflection [m] at which it carries a force that is not 0 [N]. */
static double deflection_at(double force, double side, const double *p)
{
    return side * (0.5 * p[LASH_DELTA] + fabs(force) / p[K]);
}

/* Time [s] in which the flow goes from one speed to another while the rod moves at v [m/s]; v does not lie between.
 *
 * From |F| = friction + c w + q w^2 and d|F|/dt = k (v - w):  dt = (c + 2 q w) / (k (v - w)) dw, integrated.
 */
static double time_to(double from, double to, double v, double c, double q, double k)
{
    return ((c + 2.0 * q * v) * log1p((to - from) / (v - to)) - 2.0 * q * (to - from)) / k;
}

/* Flow speed [m/s] after a time [s]: the same, solved for w by Newton's method, which converges from one side. */
static double speed_after(double from, double v, double c, double q, double k, double time)
{
    double s = k * time / (c + 2.0 * q * from);
    for (int n = 0; q > 0.0 && n < MOST_NEWTON_STEPS; n++) {
        const double gone = -expm1(-s) * (v - from);
        const double step = ((c + 2.0 * q * v) * s - 2.0 * q * gone - k * time) / (c + 2.0 * q * (from + gone));
        s -= step;
        if (fabs(step) <= ROUNDING * s)
            break;
    }
    return from - expm1(-s) * (v - from);
}

/* The regimes in the order in which a path passes them: 0 stuck, 1 flow, 2 relief valve open, with the sign of F. */
static int regime_of(double force, const curve *rebound, const curve *compression)
{
    const curve *flow = force >= 0.0 ? rebound : compression;
    const int sign = force >= 0.0 ? 1 : -1;
    if (fabs(force) <= flow->friction)
        return 0;
    return fabs(force) > flow->opens ? 2 * sign : sign;
}

/* Carry the deflection through what is left of a step within one regime; the regime it ends in. */
static int piece(double *deflection, double u, double *left, int regime, const curve *flow, const double *p)
{
    const double side = regime > 0 ? 1.0 : -1.0, v = side * u, force = fabs(spring(*deflection, p));
    const int open = regime == 2 || regime == -2;
    const double c = open ? flow->beyond : flow->c, q = open ? 0.0 : flow->q;
    const double start = open ? flow->opens : flow->friction, offset = open ? flow->speed_open : 0.0;
    const double w = offset + shut_speed(fmax(force - start, 0.0), c, q);
    const double edge = v > w && !open ? flow->speed_open : offset;
    const int leaves = v > w ? v > edge && !open : v < edge;
    if (leaves) {
        const double time = fmax(time_to(w, edge, v, c, q, p[K]), 0.0);
        if (time < *left) {
            const int outwards = v > w;
            *left -= time;
            *deflection = deflection_at(outwards || open ? flow->opens : flow->friction, side, p);
            return regime + (outwards ? 1 : -1) * (int)side;
        }
    }
    const double faster = speed_after(w, v, c, q, p[K], *left) - offset;
    *deflection = deflection_at(start + c * faster + q * faster * faster, side, p);
    *left = 0.0;
    return regime;
}

static double deflection_after(double deflection, double u, double step, const double *p)
{
    const curve rebound = curve_of(p, 1.0), compression = curve_of(p, -1.0);
    int regime = regime_of(spring(deflection, p), &rebound, &compression);
    double left = step;
    for (int n = 0; n < MOST_PIECES && left > 0.0; n++) {
        if (regime == 0) {
            const double edge = u > 0.0 ? deflection_at(rebound.friction, 1.0, p) : deflection_at(compression.friction, -1.0, p);
            const double time = u != 0.0 ? fmax((edge - deflection) / u, 0.0) : left;
            if (time >= left)
                return deflection + u * left;
            deflection = edge;
            left -= time;
            regime = u > 0.0 ? 1 : -1;
        } else {
            regime = piece(&deflection, u, &left, regime, regime > 0 ? &rebound : &compression, p);
        }
    }
    return deflection;
}

/* Force [N] beside the element. */
static double parallel(double x, double v, double a, const double *p)
{
    const double beyond = fmax(fabs(x) - p[END_STOP_X_E], 0.0), slow = v / p[STRIBECK_FRICTION_V_S];
    double force = p[PRELOAD_OFFSET_F_0] + p[GAS_SPRING_K_G] * x + p[FLUID_INERTIA_M] * a;
    if (beyond > 0.0)
        force += copysign(p[END_STOP_K_E] * beyond * beyond, x);
    if (p[STRIBECK_FRICTION_F_S] != 0.0 && v != 0.0)
        force += copysign(p[STRIBECK_FRICTION_F_S] * exp(-slow * slow), v);
    if (p[ACCUMULATOR_F_G] != 0.0)
        force -= p[ACCUMULATOR_F_G] * pow(fmax(1.0 + x / p[ACCUMULATOR_L], 0.05), -1.3);
    return force;
}

/* Elastic deflection of the second branch [m] after a travel of the rod to one side. */
static double wound(double branch, double travel, const double *p)
{
    const double most = p[SECOND_BRANCH_T0_2] / p[SECOND_BRANCH_K_2];
    return fmax(-most, fmin(most, branch + travel));
}

element_state element_start(const element_inputs *inputs, double force)
{
    double p[COLUMNS];
    element_state state = {0.0, inputs->signal, 0.0};
    parameters(state.effective, inputs->temperature, p);
    if (force != 0.0)
        state.deflection = deflection_at(force, copysign(1.0, force), p);
    return state;
}

element_state element_after(element_state state, const element_inputs *inputs, double step)
{
    double p[COLUMNS];
    state.effective = felt(state.effective, inputs->signal);
    parameters(state.effective, inputs->temperature, p);
    state.deflection = deflection_after(state.deflection, inputs->velocity, step, p);
    state.branch = wound(wound(state.branch, 0.0, p), inputs->velocity * step, p);
    return state;
}

double element_force(element_state state, const element_inputs *inputs)
{
    double p[COLUMNS];
    parameters(felt(state.effective, inputs->signal), inputs->temperature, p);
    return spring(state.deflection, p) + p[SECOND_BRANCH_K_2] * wound(state.branch, 0.0, p) +
           parallel(inputs->displacement, inputs->velocity, inputs->acceleration, p);
}
