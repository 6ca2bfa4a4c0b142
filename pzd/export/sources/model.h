/* The damper as variables with numbers, `VARIABLES` of `element_data.h`, which both versions of FMI set, get and step. */
#ifndef MODEL_H
#define MODEL_H

#include <stddef.h>

#include "element.h"
#include "element_data.h"

typedef struct {
    double values[VARIABLES];
    double rates[VARIABLES]; /* of inputs that go linearly over a step; 0 for one that is held */
    double travel;           /* since the displacement was set [m] */
    element_state state;
    int exchanged;  /* whether a solver integrates it */
    double branched; /* displacement up to which the branches followed, for a solver alone [m] */
    int running; /* whether the start values are settled */
} model;

/* Each of these gives NULL, or what is wrong. */
const char *model_get(const model *m, const unsigned variables[], size_t count, double values[]);
const char *model_set(model *m, const unsigned variables[], size_t count, const double values[]);
const char *model_set_rates(model *m, const unsigned variables[], size_t count, const int order[], const double rates[]);
const char *model_derivative(const model *m, const unsigned unknowns[], size_t count, const unsigned knowns[],
                             size_t directions, const double seed[], double found[]);
const char *model_step(model *m, double time, double step);

/* For a solver: the continuous states, their rates, and what changes sign where an equation does. Value references from
 * VARIABLES on are these: each state and its rate in turn, then the indicators. */
void model_states(const model *m, double states[]);
void model_set_states(model *m, const double states[]);
void model_rates(const model *m, double rates[]);
void model_indicators(const model *m, double indicators[]);
void model_nominals(double nominals[]);

/* Keeps what the branches remember of the way so far: where a step of the solver is complete, and at an event. */
void model_remember(model *m);

/* A state is a copy of the whole model, of its size in memory and in bytes; none is made where `*state` is one. */
const char *model_keep(const model *m, void **state);
const char *model_write(const void *state, void *bytes, size_t size);
const char *model_read(const void *bytes, size_t size, void **state);

void model_take(model *m, const void *state);
void model_free(void **state);
void model_reset(model *m, int exchanged);
void model_start(model *m);

#endif
