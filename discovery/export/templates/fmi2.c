/* FMI 2.0 co-simulation of an exported model: inputs are held over a communication step, which takes as many fixed steps
 * of the model as fit. */
#include "@PREFIX@.h"

#include "fmi2Functions.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define GUID "@GUID@"

typedef struct {
    double start_time;
    double u[@UP@_INPUTS + 1];
    double y[@UP@_OUTPUTS + 1];
    @PREFIX@_state state;
} instance;

static const double start_inputs[] = {@START@ 0.0};

static void set_up(instance *m)
{
    memset(m, 0, sizeof *m);
    memcpy(m->u, start_inputs, sizeof(double) * @UP@_INPUTS);
}

static fmi2Status steps_until(instance *m, double time)
{
    const double due = floor((time - m->start_time) / @UP@_STEP_S + 1e-6);
    while ((double)m->state.count < due) {
        if (@PREFIX@_step(&m->state, m->u, m->y) != 0) { return fmi2Error; }
    }
    return fmi2OK;
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[])
{
    (void)c; (void)on; (void)n; (void)categories;
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    instance *m;
    (void)name; (void)location; (void)functions; (void)visible; (void)logging;
    if (type != fmi2CoSimulation || guid == NULL || strcmp(guid, GUID) != 0) { return NULL; }
    m = (instance *)malloc(sizeof *m);
    if (m != NULL) { set_up(m); }
    return m;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean stop_defined, fmi2Real stop)
{
    (void)tolerance_defined; (void)tolerance; (void)stop_defined; (void)stop;
    ((instance *)c)->start_time = start;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    instance *m = (instance *)c;
    if (@PREFIX@_start(&m->state, m->u) != 0) { return fmi2Error; }
    @PREFIX@_outputs(&m->state, m->u, m->y);
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { set_up((instance *)c); return fmi2OK; }

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[])
{
    const instance *m = (const instance *)c;
    size_t k;
    for (k = 0; k < n; ++k) {
        if (vr[k] < @UP@_INPUTS) { value[k] = m->u[vr[k]]; }
        else if (vr[k] < @UP@_INPUTS + @UP@_OUTPUTS) { value[k] = m->y[vr[k] - @UP@_INPUTS]; }
        else { return fmi2Error; }
    }
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[])
{
    size_t k;
    for (k = 0; k < n; ++k) {
        if (vr[k] >= @UP@_INPUTS || !(fabs(value[k]) < 1e30)) { return fmi2Error; }
        ((instance *)c)->u[vr[k]] = value[k];
    }
    return fmi2OK;
}

#define NONE(kind) \
    fmi2Status fmi2Get##kind(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2##kind value[]) \
    { (void)c; (void)vr; (void)value; return n == 0 ? fmi2OK : fmi2Error; } \
    fmi2Status fmi2Set##kind(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2##kind value[]) \
    { (void)c; (void)vr; (void)value; return n == 0 ? fmi2OK : fmi2Error; }
NONE(Integer)
NONE(Boolean)
NONE(String)

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    if (*state == NULL) { *state = malloc(sizeof(instance)); }
    if (*state == NULL) { return fmi2Error; }
    memcpy(*state, c, sizeof(instance));
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) { memcpy(c, state, sizeof(instance)); return fmi2OK; }

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c; (void)state;
    *size = sizeof(instance);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    (void)c;
    if (size != sizeof(instance)) { return fmi2Error; }
    memcpy(bytes, state, size);
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    (void)c;
    if (size != sizeof(instance)) { return fmi2Error; }
    if (*state == NULL) { *state = malloc(sizeof(instance)); }
    if (*state == NULL) { return fmi2Error; }
    memcpy(*state, bytes, size);
    return fmi2OK;
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t unknowns,
                                        const fmi2ValueReference known[], size_t knowns, const fmi2Real seed[], fmi2Real out[])
{
    (void)c; (void)unknown; (void)unknowns; (void)known; (void)knowns; (void)seed; (void)out;
    return fmi2Error;
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[],
                                       const fmi2Real value[])
{
    (void)c; (void)vr; (void)order; (void)value;
    return n == 0 ? fmi2OK : fmi2Error;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[],
                                        fmi2Real value[])
{
    (void)c; (void)vr; (void)order; (void)value;
    return n == 0 ? fmi2OK : fmi2Error;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real size, fmi2Boolean no_set_state)
{
    (void)no_set_state;
    return steps_until((instance *)c, time + size);
}

fmi2Status fmi2CancelStep(fmi2Component c) { (void)c; return fmi2Error; }

#define STATUS(kind, type) \
    fmi2Status fmi2Get##kind(fmi2Component c, const fmi2StatusKind s, type *value) \
    { (void)c; (void)s; (void)value; return fmi2Discard; }
STATUS(Status, fmi2Status)
STATUS(RealStatus, fmi2Real)
STATUS(IntegerStatus, fmi2Integer)
STATUS(BooleanStatus, fmi2Boolean)
STATUS(StringStatus, fmi2String)
