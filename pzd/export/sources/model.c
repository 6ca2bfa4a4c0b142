#include "model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static element_inputs inputs_of(const model *m)
{
    const element_inputs inputs = {m->values[DISPLACEMENT] + m->travel - m->values[ZERO], m->values[VELOCITY],
                                   m->values[ACCELERATION], m->values[SIGNAL], m->values[TEMPERATURE]};
    return inputs;
}

void model_reset(model *m, int exchanged)
{
    memset(m, 0, sizeof *m);
    m->exchanged = exchanged;
    m->values[SIGNAL] = START_SIGNAL;
    m->values[TEMPERATURE] = START_TEMPERATURE;
    m->values[ZERO] = START_ZERO;
}

void model_start(model *m)
{
    const element_inputs inputs = inputs_of(m);
    m->state = element_start(&inputs, m->values[INITIAL_FORCE]);
    m->branched = m->values[DISPLACEMENT];
    m->running = 1;
}

/* The model with its start values settled, as they will be. */
static model begun(const model *m)
{
    model now = *m;
    if (!now.running)
        model_start(&now);
    return now;
}

/* The state now: a solver knows of no branch, whose closed form over the way since the last turn is taken here. */
static element_state state_of(const model *m)
{
    const element_inputs inputs = inputs_of(m);
    if (!m->exchanged)
        return m->state;
    return element_moved(m->state, &inputs, (real)(m->values[DISPLACEMENT] - m->branched));
}

void model_remember(model *m)
{
    m->state = state_of(m);
    m->branched = m->values[DISPLACEMENT];
}

static double force_of(const model *m)
{
    const model now = begun(m);
    const element_inputs inputs = inputs_of(&now);
    return element_force(state_of(&now), &inputs);
}

static real *at(element_state *state, int place)
{
    return place < DRIVE_RATES ? state->path : state->drive + (place - DRIVE_RATES);
}

/* Rates [CONTINUOUS] and indicators [INDICATORS]. */
static void equations(const model *m, double rates[], double indicators[])
{
    real every[RATES], signs[INDICATORS];
    const model now = begun(m);
    const element_inputs inputs = inputs_of(&now);
    element_rates(now.state, &inputs, every, signs);
    for (int i = 0; rates != NULL && i < CONTINUOUS; i++)
        rates[i] = every[STATE_PLACES[i]];
    for (int i = 0; indicators != NULL && i < INDICATORS; i++)
        indicators[i] = signs[i];
}

void model_states(const model *m, double states[])
{
    model now = begun(m);
    for (int i = 0; i < CONTINUOUS; i++)
        states[i] = *at(&now.state, STATE_PLACES[i]);
}

void model_set_states(model *m, const double states[])
{
    for (int i = 0; i < CONTINUOUS; i++)
        *at(&m->state, STATE_PLACES[i]) = (real)states[i];
}

void model_rates(const model *m, double rates[])
{
    equations(m, rates, NULL);
}

void model_indicators(const model *m, double indicators[])
{
    equations(m, NULL, indicators);
}

void model_nominals(double nominals[])
{
    for (int i = 0; i < CONTINUOUS; i++)
        nominals[i] = STATE_NOMINALS[i];
}

/* The value of any variable; those from VARIABLES on are computed, as the force is. */
static double value_of(const model *m, unsigned variable)
{
    double found[RATES + INDICATORS];
    const int solved = (int)variable - VARIABLES;
    if (solved < 0)
        return variable == FORCE ? force_of(m) : m->values[variable];
    if (solved >= 2 * CONTINUOUS) {
        model_indicators(m, found);
        return found[solved - 2 * CONTINUOUS];
    }
    if (solved % 2 == 0)
        model_states(m, found);
    else
        model_rates(m, found);
    return found[solved / 2];
}

const char *model_get(const model *m, const unsigned variables[], size_t count, double values[])
{
    for (size_t i = 0; i < count; i++) {
        if (variables[i] >= VARIABLES + 2 * CONTINUOUS + INDICATORS)
            return "there is no variable of this value reference";
        values[i] = value_of(m, variables[i]);
    }
    return NULL;
}

static const char *set_one(model *m, unsigned variable, double value)
{
    if (variable >= VARIABLES || variable == FORCE || variable == TIME)
        return "no variable of this value reference can be set";
    if (!isfinite(value))
        return "a value must be finite";
    if (m->running && (variable == INITIAL_FORCE || variable == ZERO))
        return "a parameter can be set before the simulation only";
    m->values[variable] = value;
    m->rates[variable] = 0.0;
    if (variable == DISPLACEMENT)
        m->travel = 0.0;
    return NULL;
}

const char *model_set(model *m, const unsigned variables[], size_t count, const double values[])
{
    const char *wrong = NULL;
    for (size_t i = 0; i < count && wrong == NULL; i++)
        wrong = set_one(m, variables[i], values[i]);
    return wrong;
}

static int is_input(unsigned variable)
{
    return variable < VARIABLES && variable != FORCE && variable != TIME && variable != INITIAL_FORCE && variable != ZERO;
}

const char *model_set_rates(model *m, const unsigned variables[], size_t count, const int order[], const double rates[])
{
    for (size_t i = 0; i < count; i++) {
        if (!is_input(variables[i]) || order[i] != 1)
            return "inputs alone take a derivative, and the first alone";
        if (!isfinite(rates[i]))
            return "a value must be finite";
        m->rates[variables[i]] = rates[i];
    }
    return NULL;
}

static int is_state(unsigned variable)
{
    const int solved = (int)variable - VARIABLES;
    return solved >= 0 && solved < 2 * CONTINUOUS && solved % 2 == 0;
}

static int is_computed(unsigned variable)
{
    return variable == FORCE || is_state(variable - 1); /* a rate stands behind its state */
}

static void nudge(model *m, unsigned variable, double by)
{
    if (is_state(variable))
        *at(&m->state, STATE_PLACES[(variable - VARIABLES) / 2]) += (real)by;
    else
        m->values[variable] += by;
}

/* Derivative of the force or of a rate by an input or a state, by a central difference over a millionth of its size. */
static double slope_of(const model *m, unsigned unknown, unsigned known)
{
    const double usual = is_state(known)         ? 1e-3 * STATE_NOMINALS[(known - VARIABLES) / 2]
                         : known == DISPLACEMENT ? 1e-3 /* [m] */
                         : known == VELOCITY     ? 1e-2 /* [m/s] */
                                                 : 1.0;
    model above = begun(m), below = above;
    const double half = 1e-6 * fmax(fabs(value_of(&above, known)), usual);
    nudge(&above, known, half);
    nudge(&below, known, -half);
    return (value_of(&above, unknown) - value_of(&below, unknown)) / (2.0 * half);
}

const char *model_derivative(const model *m, const unsigned unknowns[], size_t count, const unsigned knowns[],
                             size_t directions, const double seed[], double found[])
{
    for (size_t i = 0; i < count; i++) {
        if (!is_computed(unknowns[i]))
            return "the force and the rates of the states alone have derivatives";
        found[i] = 0.0;
        for (size_t n = 0; n < directions; n++) {
            if (!is_input(knowns[n]) && !is_state(knowns[n]))
                return "there are derivatives by inputs and states alone";
            found[i] += seed[n] * slope_of(m, unknowns[i], knowns[n]);
        }
    }
    return NULL;
}

/* The displacement goes with the velocity, whatever rate of its own it was given. */
const char *model_step(model *m, double time, double step)
{
    if (!(step > 0.0) || !isfinite(step) || !isfinite(time))
        return "a step must be finite and above 0";
    const element_inputs start = inputs_of(m);
    m->travel += (m->values[VELOCITY] + 0.5 * m->rates[VELOCITY] * step) * step;
    for (unsigned i = 0; i < VARIABLES; i++)
        m->values[i] += i != DISPLACEMENT && is_input(i) ? m->rates[i] * step : 0.0;
    const element_inputs end = inputs_of(m);
    m->state = element_after(m->state, &start, &end, step);
    m->values[TIME] = time + step;
    return NULL;
}

const char *model_keep(const model *m, void **state)
{
    if (*state == NULL)
        *state = malloc(sizeof *m);
    if (*state == NULL)
        return "there is no memory for the state";
    memcpy(*state, m, sizeof *m);
    return NULL;
}

const char *model_write(const void *state, void *bytes, size_t size)
{
    if (size < sizeof(model))
        return "the state does not fit";
    memcpy(bytes, state, sizeof(model));
    return NULL;
}

const char *model_read(const void *bytes, size_t size, void **state)
{
    model read;
    if (size != sizeof read)
        return "this is no state of it";
    memcpy(&read, bytes, sizeof read);
    return model_keep(&read, state);
}

void model_take(model *m, const void *state)
{
    memcpy(m, state, sizeof *m);
}

void model_free(void **state)
{
    free(*state);
    *state = NULL;
}
