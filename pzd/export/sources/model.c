#include "model.h"

#include <math.h>

#include "element_data.h"

static element_inputs inputs_of(const model *m)
{
    const element_inputs inputs = {m->values[DISPLACEMENT] + m->travel - m->values[ZERO], m->values[VELOCITY],
                                   m->values[SIGNAL], m->values[TEMPERATURE]};
    return inputs;
}

void model_reset(model *m)
{
    const model fresh = {{0.0}, 0.0, {0.0, 0.0}, 0};
    *m = fresh;
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

const char *model_get(const model *m, unsigned variable, double *value)
{
    if (variable >= VARIABLES)
        return "there is no variable of this value reference";
    *value = m->values[variable];
    if (variable == FORCE) {
        model now = *m;
        if (!now.running)
            model_start(&now);
        const element_inputs inputs = inputs_of(&now);
        *value = element_force(now.state, &inputs);
    }
    return 0;
}

const char *model_set(model *m, unsigned variable, double value)
{
    if (variable >= VARIABLES || variable == FORCE || variable == TIME)
        return "no variable of this value reference can be set";
    if (!isfinite(value))
        return "a value must be finite";
    if (m->running && (variable == INITIAL_FORCE || variable == ZERO))
        return "a parameter can be set before the simulation only";
    m->values[variable] = value;
    if (variable == DISPLACEMENT)
        m->travel = 0.0;
    return 0;
}

const char *model_step(model *m, double time, double step)
{
    if (!(step > 0.0) || !isfinite(step) || !isfinite(time))
        return "a step must be finite and above 0";
    const element_inputs inputs = inputs_of(m);
    m->state = element_after(m->state, &inputs, step);
    m->travel += m->values[VELOCITY] * step;
    m->values[TIME] = time + step;
    return 0;
}
