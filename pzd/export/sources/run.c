/* The damper along a sampled motion: reads lines of numbers, prints the force [N] at each.
 *
 * The first line is the start: x v a signal temperature. Each further line is one step: its length [s], the velocity at
 * its start and at its end [m/s], then x v a signal temperature at its end. To build:
 * cc -std=c99 -O2 run.c element.c laws.c -o run -lm
 */
#include <stdio.h>

#include "element.h"
#include "element_data.h"

static int inputs_read(element_inputs *inputs)
{
    double x, v, a, signal, temperature;
    if (scanf("%lf %lf %lf %lf %lf", &x, &v, &a, &signal, &temperature) != 5)
        return 0;
    inputs->displacement = (real)x - START_ZERO;
    inputs->velocity = (real)v;
    inputs->acceleration = (real)a;
    inputs->signal = (real)signal;
    inputs->temperature = (real)temperature;
    return 1;
}

int main(void)
{
    element_inputs before, now;
    element_state state;
    double step, first, last;
    if (!inputs_read(&before))
        return 1;
    state = element_start(&before, R(0.0));
    printf("%.17g\n", (double)element_force(state, &before));
    while (scanf("%lf %lf %lf", &step, &first, &last) == 3 && inputs_read(&now)) {
        element_inputs start = before, end = now;
        start.velocity = (real)first;
        end.velocity = (real)last;
        state = element_after(state, &start, &end, (real)step);
        printf("%.17g\n", (double)element_force(state, &now));
        before = now;
    }
    return 0;
}
