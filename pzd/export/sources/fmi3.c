/* FMI 3.0 for co-simulation and model exchange; see https://fmi-standard.org. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "element_data.h"
#include "export.h"
#include "model.h"

typedef void *fmi3Instance, *fmi3InstanceEnvironment, *fmi3FMUState;
typedef uint32_t fmi3ValueReference, fmi3UInt32;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef uint8_t fmi3UInt8, fmi3Byte;
typedef int16_t fmi3Int16;
typedef uint16_t fmi3UInt16;
typedef int32_t fmi3Int32;
typedef int64_t fmi3Int64;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean, fmi3Clock;
typedef const char *fmi3String;
typedef const fmi3Byte *fmi3Binary;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum { fmi3Independent, fmi3Constant, fmi3Fixed, fmi3Tunable, fmi3Discrete, fmi3Dependent } fmi3DependencyKind;
typedef enum { fmi3IntervalNotYetKnown, fmi3IntervalUnchanged, fmi3IntervalChanged } fmi3IntervalQualifier;
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64, fmi3Boolean, fmi3Boolean,
                                               fmi3Boolean, fmi3Boolean, fmi3Boolean *, fmi3Float64 *);
typedef void (*fmi3LockPreemptionCallback)(void);
typedef void (*fmi3UnlockPreemptionCallback)(void);

typedef struct {
    model damper;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
} instance;

static const char *const ONE_VALUE = "every variable has one value";

static fmi3Status checked(const instance *self, const char *wrong)
{
    if (wrong == NULL)
        return fmi3OK;
    if (self->log != NULL)
        self->log(self->environment, fmi3Error, "logStatusError", wrong);
    return fmi3Error;
}

static model *damper_of(fmi3Instance c)
{
    return &((instance *)c)->damper;
}

EXPORT const char *fmi3GetVersion(void)
{
    return "3.0";
}

EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t count, const fmi3String categories[])
{
    return fmi3OK;
}

static fmi3Instance begun(fmi3String token, int exchanged, fmi3InstanceEnvironment environment,
                          fmi3LogMessageCallback log)
{
    instance *self;
    if (token == NULL || strcmp(token, TOKEN) != 0)
        return NULL;
    self = calloc(1, sizeof *self);
    if (self != NULL) {
        model_reset(&self->damper, exchanged);
        self->environment = environment;
        self->log = log;
    }
    return self;
}

EXPORT fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                                fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean eventMode,
                                                fmi3Boolean earlyReturn, const fmi3ValueReference intermediate[],
                                                size_t count, fmi3InstanceEnvironment environment,
                                                fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update)
{
    return begun(token, 0, environment, log);
}

EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                                 fmi3Boolean visible, fmi3Boolean logging,
                                                 fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)
{
    return CONTINUOUS == 0 ? NULL : begun(token, 1, environment, log);
}

EXPORT fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                                      fmi3Boolean visible, fmi3Boolean logging,
                                                      fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                                      fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock,
                                                      fmi3UnlockPreemptionCallback unlock)
{
    return NULL;
}

EXPORT void fmi3FreeInstance(fmi3Instance c)
{
    free(c);
}

EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                              fmi3Float64 start, fmi3Boolean stopDefined, fmi3Float64 stop)
{
    damper_of(c)->values[TIME] = start;
    return fmi3OK;
}

EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance c)
{
    model_start(damper_of(c));
    return fmi3OK;
}

EXPORT fmi3Status fmi3Terminate(fmi3Instance c)
{
    return fmi3OK;
}

EXPORT fmi3Status fmi3Reset(fmi3Instance c)
{
    model_reset(damper_of(c), damper_of(c)->exchanged);
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t count, fmi3Float64 values[],
                                 size_t size)
{
    return checked(c, count == size ? model_get(damper_of(c), vr, count, values) : ONE_VALUE);
}

EXPORT fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t count,
                                 const fmi3Float64 values[], size_t size)
{
    return checked(c, count == size ? model_set(damper_of(c), vr, count, values) : ONE_VALUE);
}

EXPORT fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t count,
                                               const fmi3ValueReference knowns[], size_t directions,
                                               const fmi3Float64 seed[], size_t seeds, fmi3Float64 sensitivity[],
                                               size_t size)
{
    if (count != size || directions != seeds)
        return checked(c, ONE_VALUE);
    return checked(c, model_derivative(damper_of(c), unknowns, count, knowns, directions, seed, sensitivity));
}

EXPORT fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 step, fmi3Boolean keeps,
                             fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation,
                             fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime)
{
    const fmi3Status status = checked(c, model_step(damper_of(c), time, step));
    *eventHandlingNeeded = *terminateSimulation = *earlyReturn = false;
    *lastSuccessfulTime = damper_of(c)->values[TIME];
    return status;
}

EXPORT fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state)
{
    return checked(c, model_keep(damper_of(c), state));
}

EXPORT fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state)
{
    model_take(damper_of(c), state);
    return fmi3OK;
}

EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state)
{
    model_free(state);
    return fmi3OK;
}

EXPORT fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size)
{
    *size = sizeof(model);
    return fmi3OK;
}

EXPORT fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    return checked(c, model_write(state, bytes, size));
}

EXPORT fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    return checked(c, model_read(bytes, size, state));
}

/* Model exchange. */
static const char *const NO_SUCH_COUNT = "this is not the number of states or indicators";

EXPORT fmi3Status fmi3EnterEventMode(fmi3Instance c)
{
    return fmi3OK;
}

EXPORT fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *ends, fmi3Boolean *nominals,
                                           fmi3Boolean *states, fmi3Boolean *defined, fmi3Float64 *next)
{
    model_remember(damper_of(c));
    *again = *ends = *nominals = *states = *defined = false;
    *next = 0.0;
    return fmi3OK;
}

EXPORT fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c)
{
    return fmi3OK;
}

EXPORT fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean keeps, fmi3Boolean *event, fmi3Boolean *ends)
{
    model_remember(damper_of(c));
    *event = *ends = false;
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time)
{
    damper_of(c)->values[TIME] = time;
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 states[], size_t count)
{
    if (count != CONTINUOUS)
        return checked(c, NO_SUCH_COUNT);
    model_set_states(damper_of(c), states);
    return fmi3OK;
}

#define SOLVED(name, expected, filled)                                                 \
    EXPORT fmi3Status fmi3Get##name(fmi3Instance c, fmi3Float64 found[], size_t count) \
    {                                                                                  \
        if (count != expected)                                                         \
            return checked(c, NO_SUCH_COUNT);                                          \
        filled;                                                                        \
        return fmi3OK;                                                                 \
    }

SOLVED(ContinuousStates, CONTINUOUS, model_states(damper_of(c), found))
SOLVED(ContinuousStateDerivatives, CONTINUOUS, model_rates(damper_of(c), found))
SOLVED(EventIndicators, INDICATORS, model_indicators(damper_of(c), found))
SOLVED(NominalsOfContinuousStates, CONTINUOUS, model_nominals(found))

EXPORT fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *count)
{
    *count = CONTINUOUS;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *count)
{
    *count = INDICATORS;
    return fmi3OK;
}

/* What the standard has beyond it, and this damper does not. */
#define REFUSED(name, ...)                         \
    EXPORT fmi3Status name(fmi3Instance c, __VA_ARGS__) \
    {                                              \
        return checked(c, "it has no " #name);        \
    }
#define REFUSED_ALONE(name)                        \
    EXPORT fmi3Status name(fmi3Instance c)         \
    {                                              \
        return checked(c, "it has no " #name);        \
    }
#define REFERENCES const fmi3ValueReference vr[], size_t count
#define NO_VARIABLES(type)                                              \
    REFUSED(fmi3Get##type, REFERENCES, fmi3##type values[], size_t size) \
    REFUSED(fmi3Set##type, REFERENCES, const fmi3##type values[], size_t size)

NO_VARIABLES(Float32)
NO_VARIABLES(Int8)
NO_VARIABLES(UInt8)
NO_VARIABLES(Int16)
NO_VARIABLES(UInt16)
NO_VARIABLES(Int32)
NO_VARIABLES(UInt32)
NO_VARIABLES(Int64)
NO_VARIABLES(UInt64)
NO_VARIABLES(Boolean)
NO_VARIABLES(String)
REFUSED(fmi3GetBinary, REFERENCES, size_t sizes[], fmi3Binary values[], size_t size)
REFUSED(fmi3SetBinary, REFERENCES, const size_t sizes[], const fmi3Binary values[], size_t size)
REFUSED(fmi3GetClock, REFERENCES, fmi3Clock values[])
REFUSED(fmi3SetClock, REFERENCES, const fmi3Clock values[])
REFUSED(fmi3GetNumberOfVariableDependencies, fmi3ValueReference vr, size_t *count)
REFUSED(fmi3GetVariableDependencies, fmi3ValueReference dependent, size_t elements[], fmi3ValueReference independents[],
        size_t indices[], fmi3DependencyKind kinds[], size_t count)
REFUSED(fmi3GetAdjointDerivative, const fmi3ValueReference unknowns[], size_t n, const fmi3ValueReference knowns[],
        size_t m, const fmi3Float64 seed[], size_t seeds, fmi3Float64 sensitivity[], size_t size)
REFUSED(fmi3GetOutputDerivatives, REFERENCES, const fmi3Int32 orders[], fmi3Float64 values[], size_t size)
REFUSED(fmi3GetIntervalDecimal, REFERENCES, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
REFUSED(fmi3GetIntervalFraction, REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
        fmi3IntervalQualifier qualifiers[])
REFUSED(fmi3GetShiftDecimal, REFERENCES, fmi3Float64 shifts[])
REFUSED(fmi3GetShiftFraction, REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
REFUSED(fmi3SetIntervalDecimal, REFERENCES, const fmi3Float64 intervals[])
REFUSED(fmi3SetIntervalFraction, REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
REFUSED(fmi3SetShiftDecimal, REFERENCES, const fmi3Float64 shifts[])
REFUSED(fmi3SetShiftFraction, REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
REFUSED(fmi3ActivateModelPartition, fmi3ValueReference clock, fmi3Float64 time)
REFUSED_ALONE(fmi3EnterConfigurationMode)
REFUSED_ALONE(fmi3ExitConfigurationMode)
REFUSED_ALONE(fmi3EvaluateDiscreteStates)
REFUSED_ALONE(fmi3EnterStepMode)
