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

void model_reset(model *m)
{
    memset(m, 0, sizeof *m);
    m->values[SIGNAL] = START_SIGNAL;
    m->values[TEMPERATURE] = START_TEMPERATURE;
    m->values[ZERO] = START_ZERO;
}

void model_start(model *m)
{
    const element_inputs inputs = inputs_of(m);
    m->state = element_start(&inputs, m->values[INITIAL_FORCE]);
    m->running = 1;
}

static double force_of(const model *m)
{
    model now = *m;
    if (!now.running)
        model_start(&now);
    const element_inputs inputs = inputs_of(&now);
    return element_force(now.state, &inputs);
}

const char *model_get(const model *m, const unsigned variables[], size_t count, double values[])
{
    for (size_t i = 0; i < count; i++) {
        if (variables[i] >= VARIABLES)
            return "there is no variable of this value reference";
        values[i] = variables[i] == FORCE ? force_of(m) : m->values[variables[i]];
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

/* Derivative of the force by one input, by a central difference over a millionth of its size. */
static double slope_of(const model *m, unsigned input)
{
    const double usual = input == DISPLACEMENT ? 1e-3 : input == VELOCITY ? 1e-2 : 1.0; /* [m], [m/s] */
    const double half = 1e-6 * fmax(fabs(m->values[input]), usual);
    model above = *m, below = *m;
    above.values[input] += half;
    below.values[input] -= half;
    return (force_of(&above) - force_of(&below)) / (2.0 * half);
}

const char *model_derivative(const model *m, const unsigned unknowns[], size_t count, const unsigned knowns[],
                             size_t directions, const double seed[], double found[])
{
    double along = 0.0;
    for (size_t i = 0; i < directions; i++) {
        if (!is_input(knowns[i]))
            return "the force has derivatives by inputs alone";
        along += seed[i] * slope_of(m, knowns[i]);
    }
    for (size_t i = 0; i < count; i++) {
        if (unknowns[i] != FORCE)
            return "the force alone has derivatives";
        found[i] = along;
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
