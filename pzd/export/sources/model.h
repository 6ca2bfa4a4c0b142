/* The damper as variables with numbers, which both versions of FMI set, get and step. */
#ifndef MODEL_H
#define MODEL_H

#include "element.h"

enum { DISPLACEMENT, VELOCITY, SIGNAL, TEMPERATURE, FORCE, INITIAL_FORCE, ZERO, TIME, VARIABLES };

typedef struct {
    double values[VARIABLES];
    double travel; /* since the displacement was set [m] */
    element_state state;
    int running; /* whether the start values are settled */
} model;

/* Each of these gives NULL, or what is wrong. */
const char *model_get(const model *m, unsigned variable, double *value);
const char *model_set(model *m, unsigned variable, double value);
const char *model_step(model *m, double time, double step);

void model_reset(model *m);
void model_start(model *m);

#endif
