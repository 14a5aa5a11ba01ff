/* FMI 2.0 co-simulation of an exported model: inputs are held over a communication step, which takes as many fixed steps
 * of the model as fit. */
#include "fmi2Functions.h"

typedef fmi2ValueReference reference;

#include "instance.h"

#define STATUS(failed) ((failed) != 0 ? fmi2Error : fmi2OK)

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
    (void)name; (void)location; (void)functions; (void)visible; (void)logging;
    return type == fmi2CoSimulation ? instantiate(guid) : NULL;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean stop_defined, fmi2Real stop)
{
    (void)tolerance_defined; (void)tolerance; (void)stop_defined; (void)stop;
    if (((instance *)c)->phase != SET_UP) { return fmi2Error; }
    ((instance *)c)->start_time = start;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    instance *m = (instance *)c;
    return STATUS(begin(m, m->start_time));
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return STATUS(run((instance *)c)); }

fmi2Status fmi2Terminate(fmi2Component c) { return STATUS(terminate((instance *)c)); }
fmi2Status fmi2Reset(fmi2Component c) { set_up((instance *)c); return fmi2OK; }

fmi2Status fmi2GetReal(fmi2Component c, const reference vr[], size_t n, fmi2Real value[])
{
    return STATUS(get((instance *)c, vr, n, value));
}

fmi2Status fmi2SetReal(fmi2Component c, const reference vr[], size_t n, const fmi2Real value[])
{
    return STATUS(set((instance *)c, vr, n, value));
}

#define NONE(kind) \
    fmi2Status fmi2Get##kind(fmi2Component c, const reference vr[], size_t n, fmi2##kind value[]) \
    { (void)c; (void)vr; (void)value; return n == 0 ? fmi2OK : fmi2Error; } \
    fmi2Status fmi2Set##kind(fmi2Component c, const reference vr[], size_t n, const fmi2##kind value[]) \
    { (void)c; (void)vr; (void)value; return n == 0 ? fmi2OK : fmi2Error; }
NONE(String)

fmi2Status fmi2GetBoolean(fmi2Component c, const reference vr[], size_t n, fmi2Boolean value[])
{
    size_t k;
    for (k = 0; k < n; ++k) {
        const int *at = boolean_at((instance *)c, vr[k]);
        if (at == NULL) { return fmi2Error; }
        value[k] = *at ? fmi2True : fmi2False;
    }
    return fmi2OK;
}

fmi2Status fmi2SetBoolean(fmi2Component c, const reference vr[], size_t n, const fmi2Boolean value[])
{
    size_t k;
    for (k = 0; k < n; ++k) {
        int *at = boolean_at((instance *)c, vr[k]);
        if (at == NULL) { return fmi2Error; }
        *at = value[k] != fmi2False;
    }
    return fmi2OK;
}

fmi2Status fmi2GetInteger(fmi2Component c, const reference vr[], size_t n, fmi2Integer value[])
{
    size_t k;
    for (k = 0; k < n; ++k) {
        int found;
        if (integer((const instance *)c, vr[k], &found) != 0) { return fmi2Error; }
        value[k] = found;
    }
    return fmi2OK;
}

fmi2Status fmi2SetInteger(fmi2Component c, const reference vr[], size_t n, const fmi2Integer value[])
{ (void)c; (void)vr; (void)value; return n == 0 ? fmi2OK : fmi2Error; }

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) { return STATUS(copied(state, c)); }
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
    return STATUS(copied(state, bytes));
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const reference unknown[], size_t unknowns,
                                        const reference known[], size_t knowns, const fmi2Real seed[], fmi2Real out[])
{
    (void)c; (void)unknown; (void)unknowns; (void)known; (void)knowns; (void)seed; (void)out;
    return fmi2Error;
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const reference vr[], size_t n, const fmi2Integer order[],
                                       const fmi2Real value[])
{
    (void)c; (void)vr; (void)order; (void)value;
    return n == 0 ? fmi2OK : fmi2Error;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const reference vr[], size_t n, const fmi2Integer order[],
                                        fmi2Real value[])
{
    (void)c; (void)vr; (void)order; (void)value;
    return n == 0 ? fmi2OK : fmi2Error;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real size, fmi2Boolean no_set_state)
{
    (void)no_set_state;
    return STATUS(steps_until((instance *)c, time + size));
}

fmi2Status fmi2CancelStep(fmi2Component c) { (void)c; return fmi2Error; }

#define PENDING(kind, type) \
    fmi2Status fmi2Get##kind(fmi2Component c, const fmi2StatusKind s, type *value) \
    { (void)c; (void)s; (void)value; return fmi2Discard; }
PENDING(Status, fmi2Status)
PENDING(RealStatus, fmi2Real)
PENDING(IntegerStatus, fmi2Integer)
PENDING(BooleanStatus, fmi2Boolean)
PENDING(StringStatus, fmi2String)
