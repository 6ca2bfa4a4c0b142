/* FMI 2.0 for co-simulation; see https://fmi-standard.org. */
#include <stdlib.h>
#include <string.h>

#include "element_data.h"
#include "model.h"

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define EXPORT __attribute__((visibility("default")))
#else
#define EXPORT
#endif

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
    void (*logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

typedef struct {
    model damper;
    const fmi2CallbackFunctions *callbacks;
} instance;

static fmi2Status checked(const instance *self, const char *wrong)
{
    if (wrong == NULL)
        return fmi2OK;
    if (self->callbacks != NULL && self->callbacks->logger != NULL)
        self->callbacks->logger(self->callbacks->componentEnvironment, "damper", fmi2Error, "logStatusError", "%s", wrong);
    return fmi2Error;
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
    if (type != fmi2CoSimulation || guid == NULL || strcmp(guid, TOKEN) != 0)
        return NULL;
    self = calloc(1, sizeof *self);
    if (self != NULL) {
        model_reset(&self->damper);
        self->callbacks = callbacks;
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
    ((instance *)c)->damper.values[TIME] = start;
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    return fmi2OK;
}

EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    model_start(&((instance *)c)->damper);
    return fmi2OK;
}

EXPORT fmi2Status fmi2Terminate(fmi2Component c)
{
    return fmi2OK;
}

EXPORT fmi2Status fmi2Reset(fmi2Component c)
{
    model_reset(&((instance *)c)->damper);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t count, fmi2Real value[])
{
    fmi2Status status = fmi2OK;
    for (size_t i = 0; i < count && status == fmi2OK; i++)
        status = checked(c, model_get(&((instance *)c)->damper, vr[i], &value[i]));
    return status;
}

EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t count, const fmi2Real value[])
{
    fmi2Status status = fmi2OK;
    for (size_t i = 0; i < count && status == fmi2OK; i++)
        status = checked(c, model_set(&((instance *)c)->damper, vr[i], value[i]));
    return status;
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
    if (*state == NULL)
        *state = malloc(sizeof(model));
    if (*state == NULL)
        return checked(c, "there is no memory for the state");
    *(model *)*state = ((instance *)c)->damper;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    ((instance *)c)->damper = *(const model *)state;
    return fmi2OK;
}

EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    free(*state);
    *state = NULL;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    *size = sizeof(model);
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    if (size < sizeof(model))
        return checked(c, "the state does not fit");
    memcpy(bytes, state, sizeof(model));
    return fmi2OK;
}

EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    const fmi2Status status = size == sizeof(model) ? fmi2GetFMUstate(c, state) : checked(c, "this is no state of it");
    if (status == fmi2OK)
        memcpy(*state, bytes, sizeof(model));
    return status;
}

EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t unknowns,
                                               const fmi2ValueReference known[], size_t knowns, const fmi2Real by[],
                                               fmi2Real of[])
{
    return checked(c, "it has no directional derivatives");
}

EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                              const fmi2Integer order[], const fmi2Real value[])
{
    return checked(c, "inputs are held over a step");
}

EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                               const fmi2Integer order[], fmi2Real value[])
{
    return checked(c, "it has no derivatives of its output");
}

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean keeps)
{
    return checked(c, model_step(&((instance *)c)->damper, time, step));
}

EXPORT fmi2Status fmi2CancelStep(fmi2Component c)
{
    return checked(c, "no step is pending");
}

EXPORT fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    return fmi2Discard;
}

EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    if (kind != fmi2LastSuccessfulTime)
        return fmi2Discard;
    *value = ((instance *)c)->damper.values[TIME];
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    return fmi2Discard;
}

EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    if (kind != fmi2Terminated)
        return fmi2Discard;
    *value = 0;
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    return fmi2Discard;
}
