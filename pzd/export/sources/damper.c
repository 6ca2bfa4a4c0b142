#include "damper.h"

#include <math.h>

#include "damper_data.h"

/* An interval of rising nodes and the share of it that lies below a value. */
struct place {
    int low;
    int high;
    float share;
};

static float clamped(float value, float low, float high)
{
    return fminf(fmaxf(value, low), high);
}

static struct place place_of(const float *nodes, int count, float value)
{
    struct place at = {0, 0, 0.0f};
    for (int i = 1; i < count - 1; i++)
        at.low += value >= nodes[i] ? 1 : 0;
    if (count > 1) {
        at.high = at.low + 1;
        at.share = (value - nodes[at.low]) / (nodes[at.high] - nodes[at.low]);
    }
    return at;
}

static struct place place_of_temperature(float temperature)
{
    struct place at = place_of(TEMPERATURES, DAMPER_TEMPERATURES, temperature);
    at.share = clamped(at.share, 0.0f, 1.0f);
    return at;
}

static struct place place_of_speed(float velocity)
{
    struct place at = place_of(SPEEDS, DAMPER_SPEEDS, fabsf(velocity));
    if (DAMPER_HELD)
        at.share = fminf(at.share, 1.0f);
    return at;
}

static float between(float low, float high, float share)
{
    return low + share * (high - low);
}

/* Force [N] at a node of the control signal; the branches of rebound and compression are never mixed. */
static float at_node(struct place warm, int signal, struct place fast, int compression)
{
    const float *cold = FORCES[warm.low][signal][compression];
    const float *hot = FORCES[warm.high][signal][compression];
    return between(between(cold[fast.low], cold[fast.high], fast.share),
                   between(hot[fast.low], hot[fast.high], fast.share), warm.share);
}

static int side_of(float velocity)
{
    return signbit(velocity) != 0 ? 1 : 0;
}

float damper_force(float temperature, float signal, float velocity)
{
    const struct place warm = place_of_temperature(temperature), fast = place_of_speed(velocity);
    const struct place at = place_of(SIGNALS, DAMPER_SIGNALS, signal);
    const int side = side_of(velocity);
    return between(at_node(warm, at.low, fast, side), at_node(warm, at.high, fast, side),
                   clamped(at.share, 0.0f, 1.0f));
}

void damper_range(float temperature, float velocity, float *low, float *high)
{
    const struct place warm = place_of_temperature(temperature), fast = place_of_speed(velocity);
    const int side = side_of(velocity);
    *low = *high = at_node(warm, 0, fast, side);
    for (int i = 1; i < DAMPER_SIGNALS; i++) {
        const float force = at_node(warm, i, fast, side);
        *low = fminf(*low, force);
        *high = fmaxf(*high, force);
    }
}

float damper_signal(float temperature, float force, float velocity)
{
    const struct place warm = place_of_temperature(temperature), fast = place_of_speed(velocity);
    const int side = side_of(velocity);
    float before = at_node(warm, 0, fast, side);
    float found = SIGNALS[0], nearest = fabsf(force - before);
    for (int i = 1; i < DAMPER_SIGNALS; i++) {
        const float after = at_node(warm, i, fast, side);
        const float reached = clamped(force, fminf(before, after), fmaxf(before, after));
        const float miss = fabsf(force - reached);
        if (miss < nearest) {
            const float share = after != before ? (reached - before) / (after - before) : 0.0f;
            nearest = miss;
            found = between(SIGNALS[i - 1], SIGNALS[i], share);
        }
        before = after;
    }
    return found;
}

/* The forces within the box that bring D^T T nearest to a wanted value by the same share of each damper's range. */
static void by_share(float share, const float low[2], const float high[2], float force[2])
{
    for (int i = 0; i < 2; i++)
        force[i] = FORCE_TO_COMFORT[i] >= 0.0f ? between(low[i], high[i], share) : between(high[i], low[i], share);
}

/* The point of the segment a_K = 0 that the tie-break picks; i is the damper with the smaller |D|. */
static void on_segment(float a0, const float low[2], const float high[2], float force[2])
{
    const float *D = FORCE_TO_COMFORT;
    const int i = fabsf(D[0]) <= fabsf(D[1]) ? 0 : 1, j = 1 - i;
    float first = low[i], last = high[i];
    if (D[i] != 0.0f) {
        const float one = (-a0 - D[j] * low[j]) / D[i], other = (-a0 - D[j] * high[j]) / D[i];
        first = fmaxf(first, fminf(one, other));
        last = fminf(last, fmaxf(one, other));
    }
    if (first > last)
        first = last = 0.5f * (first + last);
    if (DAMPER_TIE_BREAK == DAMPER_LARGEST) {
        const float by_first = hypotf(first, (-a0 - D[i] * first) / D[j]);
        const float by_last = hypotf(last, (-a0 - D[i] * last) / D[j]);
        force[i] = by_first >= by_last ? first : last;
    } else {
        force[i] = clamped(-a0 * D[i] / (D[0] * D[0] + D[1] * D[1]), first, last);
    }
    force[j] = clamped((-a0 - D[i] * force[i]) / D[j], low[j], high[j]);
}

void damper_comfort(float temperature, const float deflection[2], const float rate[2], float force[2], float signal[2])
{
    const float *D = FORCE_TO_COMFORT;
    float low[2], high[2], a0 = 0.0f, least = 0.0f, most = 0.0f;
    for (int i = 0; i < 2; i++) {
        damper_range(temperature, MOTION_RATIO[i] * rate[i], &low[i], &high[i]);
        low[i] *= DAMPERS[i] * MOTION_RATIO[i];
        high[i] *= DAMPERS[i] * MOTION_RATIO[i];
        a0 += D[i] * SPRING_STIFFNESS[i] * deflection[i];
        least += fminf(D[i] * low[i], D[i] * high[i]);
        most += fmaxf(D[i] * low[i], D[i] * high[i]);
    }
    if (-a0 <= least)
        by_share(0.0f, low, high, force);
    else if (-a0 >= most)
        by_share(1.0f, low, high, force);
    else if (DAMPER_TIE_BREAK == DAMPER_EQUAL_SHARE)
        by_share((-a0 - least) / (most - least), low, high, force);
    else
        on_segment(a0, low, high, force);
    for (int i = 0; i < 2; i++)
        signal[i] = damper_signal(temperature, force[i] / (DAMPERS[i] * MOTION_RATIO[i]), MOTION_RATIO[i] * rate[i]);
}
