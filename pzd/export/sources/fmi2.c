/* FMI 2.0 for co-simulation and model exchange; see https://fmi-standard.org. */
#include <stdlib.h>
#include <string.h>

#include "element_data.h"
#include "export.h"
#include "model.h"

typedef void *fmi2Component, *fmi2ComponentEnvironment, *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer, fmi2Boolean;
typedef const char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef struct {
    fmi2Boolean newDiscreteStatesNeeded, terminateSimulation, nominalsOfContinuousStatesChanged;
    fmi2Boolean valuesOfContinuousStatesChanged, nextEventTimeDefined;
    fmi2Real nextEventTime;
} fmi2EventInfo;
typedef struct {
    void (*logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

typedef struct {
    model damper;
    const fmi2CallbackFunctions *callbacks;
    char name[];
} instance;

static fmi2Status checked(const instance *self, const char *wrong)
{
    if (wrong == NULL)
        return fmi2OK;
    if (self->callbacks != NULL && self->callbacks->logger != NULL)
        self->callbacks->logger(self->callbacks->componentEnvironment, self->name, fmi2Error, "logStatusError", wrong);
    return fmi2Error;
}

static model *damper_of(fmi2Component c)
{
    return &((instance *)c)->damper;
}

EXPORT const char *fmi2GetTypesPlatform(void)
{
    return "default";
}

EXPORT const char *fmi2GetVersion(void)
{
    return "2.0";
}

EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t count, const fmi2String categories[])
{
    return fmi2OK;
}

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                     const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging)
{
    instance *self;
    if ((type != fmi2CoSimulation && CONTINUOUS == 0) || name == NULL || guid == NULL || strcmp(guid, TOKEN) != 0)
        return NULL;
    self = calloc(1, sizeof *self + strlen(name) + 1);
    if (self != NULL) {
        model_reset(&self->damper, type == fmi2ModelExchange);
        self->callbacks = callbacks;
        strcpy(self->name, name);
    }
    return self;
}

EXPORT void fmi2FreeInstance(fmi2Component c)
{
    free(c);
}

EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real start,
                                      fmi2Boolean stopDefined, fmi2Real stop)
{
    damper_of(c)->values[TIME] = start;
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    return fmi2OK;
}

EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    model_start(damper_of(c));
    return fmi2OK;
}

EXPORT fmi2Status fmi2Terminate(fmi2Component c)
{
    return fmi2OK;
}

EXPORT fmi2Status fmi2Reset(fmi2Component c)
{
    model_reset(damper_of(c), damper_of(c)->exchanged);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t count, fmi2Real value[])
{
    return checked(c, model_get(damper_of(c), vr, count, value));
}

EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t count, const fmi2Real value[])
{
    return checked(c, model_set(damper_of(c), vr, count, value));
}

#define NO_VARIABLES(type)                                                                                       \
    EXPORT fmi2Status fmi2Get##type(fmi2Component c, const fmi2ValueReference vr[], size_t count, fmi2##type v[]) \
    {                                                                                                            \
        return checked(c, count > 0 ? "every variable is a Real" : NULL);                                           \
    }                                                                                                            \
    EXPORT fmi2Status fmi2Set##type(fmi2Component c, const fmi2ValueReference vr[], size_t count,                \
                                    const fmi2##type v[])                                                        \
    {                                                                                                            \
        return checked(c, count > 0 ? "every variable is a Real" : NULL);                                           \
    }

NO_VARIABLES(Integer)
NO_VARIABLES(Boolean)
NO_VARIABLES(String)

EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    return checked(c, model_keep(damper_of(c), state));
}

EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    model_take(damper_of(c), state);
    return fmi2OK;
}

EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    model_free(state);
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    *size = sizeof(model);
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    return checked(c, model_write(state, bytes, size));
}

EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    return checked(c, model_read(bytes, size, state));
}

EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t unknowns,
                                               const fmi2ValueReference known[], size_t knowns, const fmi2Real by[],
                                               fmi2Real of[])
{
    return checked(c, model_derivative(damper_of(c), unknown, unknowns, known, knowns, by, of));
}

EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                              const fmi2Integer order[], const fmi2Real value[])
{
    return checked(c, model_set_rates(damper_of(c), vr, count, order, value));
}

EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                               const fmi2Integer order[], fmi2Real value[])
{
    return checked(c, "it has no derivatives of its output");
}

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean keeps)
{
    return checked(c, model_step(damper_of(c), time, step));
}

EXPORT fmi2Status fmi2CancelStep(fmi2Component c)
{
    return checked(c, "no step is pending");
}

/* What can be told of a step, which is never pending. */
#define STATUS(name, type, asked, told)                                                       \
    EXPORT fmi2Status fmi2Get##name(fmi2Component c, const fmi2StatusKind kind, type *value) \
    {                                                                                         \
        if (kind != asked)                                                                    \
            return fmi2Discard;                                                               \
        *value = told;                                                                        \
        return fmi2OK;                                                                        \
    }
#define NO_STATUS(name, type)                                                                 \
    EXPORT fmi2Status fmi2Get##name(fmi2Component c, const fmi2StatusKind kind, type *value) \
    {                                                                                         \
        return fmi2Discard;                                                                   \
    }

STATUS(RealStatus, fmi2Real, fmi2LastSuccessfulTime, damper_of(c)->values[TIME])
STATUS(BooleanStatus, fmi2Boolean, fmi2Terminated, 0)
NO_STATUS(Status, fmi2Status)
NO_STATUS(IntegerStatus, fmi2Integer)
NO_STATUS(StringStatus, fmi2String)

/* Model exchange. */
static const char *const NO_SUCH_COUNT = "this is not the number of states or indicators";

EXPORT fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    return fmi2OK;
}

EXPORT fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    const fmi2EventInfo nothing = {0, 0, 0, 0, 0, 0.0};
    model_remember(damper_of(c));
    *info = nothing;
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    return fmi2OK;
}

EXPORT fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean keeps, fmi2Boolean *event, fmi2Boolean *ends)
{
    model_remember(damper_of(c));
    *event = *ends = 0;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    damper_of(c)->values[TIME] = time;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real states[], size_t count)
{
    if (count != CONTINUOUS)
        return checked(c, NO_SUCH_COUNT);
    model_set_states(damper_of(c), states);
    return fmi2OK;
}

#define SOLVED(name, expected, filled)                                           \
    EXPORT fmi2Status fmi2Get##name(fmi2Component c, fmi2Real found[], size_t count) \
    {                                                                            \
        if (count != expected)                                                   \
            return checked(c, NO_SUCH_COUNT);                                    \
        filled;                                                                  \
        return fmi2OK;                                                           \
    }

SOLVED(ContinuousStates, CONTINUOUS, model_states(damper_of(c), found))
SOLVED(Derivatives, CONTINUOUS, model_rates(damper_of(c), found))
SOLVED(EventIndicators, INDICATORS, model_indicators(damper_of(c), found))
SOLVED(NominalsOfContinuousStates, CONTINUOUS, model_nominals(found))
