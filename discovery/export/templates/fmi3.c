/* FMI 3.0 co-simulation of an exported model: inputs are held over a communication step, which takes as many fixed steps
 * of the model as fit. */
#include "fmi3Functions.h"

typedef fmi3ValueReference reference;

#include "instance.h"

#define STATUS(failed) ((failed) != 0 ? fmi3Error : fmi3OK)
#define TIME (STATE_WORD + 1) /* its reference is the next one */

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance i, fmi3Boolean on, size_t n, const fmi3String categories[])
{
    (void)i; (void)on; (void)n; (void)categories;
    return fmi3OK;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible,
                                          fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)
{
    (void)name; (void)token; (void)path; (void)visible; (void)logging; (void)environment; (void)log;
    return NULL;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
                                         const reference intermediate[], size_t n, fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update)
{
    (void)name; (void)path; (void)visible; (void)logging; (void)events; (void)early;
    (void)intermediate; (void)n; (void)environment; (void)log; (void)update;
    return instantiate(token);
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible,
                                               fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                               fmi3LogMessageCallback log, fmi3ClockUpdateCallback update,
                                               fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock)
{
    (void)name; (void)token; (void)path; (void)visible; (void)logging; (void)environment; (void)log;
    (void)update; (void)lock; (void)unlock;
    return NULL;
}

void fmi3FreeInstance(fmi3Instance i) { free(i); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance i, fmi3Boolean tolerance_defined, fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean stop_defined, fmi3Float64 stop)
{
    (void)tolerance_defined; (void)tolerance; (void)stop_defined; (void)stop;
    return STATUS(begin((instance *)i, start));
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance i) { return STATUS(run((instance *)i)); }

fmi3Status fmi3EnterEventMode(fmi3Instance i) { (void)i; return fmi3Error; }
fmi3Status fmi3Terminate(fmi3Instance i) { return STATUS(terminate((instance *)i)); }
fmi3Status fmi3Reset(fmi3Instance i) { set_up((instance *)i); return fmi3OK; }

fmi3Status fmi3GetFloat64(fmi3Instance i, const reference vr[], size_t n, fmi3Float64 value[], size_t values)
{
    instance *m = (instance *)i;
    size_t k;
    if (values != n) { return fmi3Error; }
    for (k = 0; k < n; ++k) {
        if (vr[k] == TIME) { value[k] = m->time; }
        else if (get(m, &vr[k], 1, &value[k]) != 0) { return fmi3Error; }
    }
    return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance i, const reference vr[], size_t n, const fmi3Float64 value[], size_t values)
{
    return STATUS(values != n || set((instance *)i, vr, n, value) != 0);
}

#define NONE(kind) \
    fmi3Status fmi3Get##kind(fmi3Instance i, const reference vr[], size_t n, fmi3##kind value[], size_t values) \
    { (void)i; (void)vr; (void)value; (void)values; return n == 0 ? fmi3OK : fmi3Error; } \
    fmi3Status fmi3Set##kind(fmi3Instance i, const reference vr[], size_t n, const fmi3##kind value[], size_t values) \
    { (void)i; (void)vr; (void)value; (void)values; return n == 0 ? fmi3OK : fmi3Error; }
NONE(Float32)
NONE(Int8)
NONE(UInt8)
NONE(Int16)
NONE(UInt16)
NONE(UInt32)
NONE(Int64)
NONE(UInt64)
NONE(String)

fmi3Status fmi3GetBoolean(fmi3Instance i, const reference vr[], size_t n, fmi3Boolean value[], size_t values)
{
    size_t k;
    if (values != n) { return fmi3Error; }
    for (k = 0; k < n; ++k) {
        const int *at = boolean_at((instance *)i, vr[k]);
        if (at == NULL) { return fmi3Error; }
        value[k] = *at != 0;
    }
    return fmi3OK;
}

fmi3Status fmi3SetBoolean(fmi3Instance i, const reference vr[], size_t n, const fmi3Boolean value[], size_t values)
{
    size_t k;
    if (values != n) { return fmi3Error; }
    for (k = 0; k < n; ++k) {
        int *at = boolean_at((instance *)i, vr[k]);
        if (at == NULL) { return fmi3Error; }
        *at = value[k] ? 1 : 0;
    }
    return fmi3OK;
}

fmi3Status fmi3GetInt32(fmi3Instance i, const reference vr[], size_t n, fmi3Int32 value[], size_t values)
{
    size_t k;
    if (values != n) { return fmi3Error; }
    for (k = 0; k < n; ++k) {
        int found;
        if (integer((const instance *)i, vr[k], &found) != 0) { return fmi3Error; }
        value[k] = found;
    }
    return fmi3OK;
}

fmi3Status fmi3SetInt32(fmi3Instance i, const reference vr[], size_t n, const fmi3Int32 value[], size_t values)
{ (void)i; (void)vr; (void)value; (void)values; return n == 0 ? fmi3OK : fmi3Error; }

fmi3Status fmi3GetBinary(fmi3Instance i, const reference vr[], size_t n, size_t sizes[], fmi3Binary value[], size_t values)
{ (void)i; (void)vr; (void)sizes; (void)value; (void)values; return n == 0 ? fmi3OK : fmi3Error; }
fmi3Status fmi3SetBinary(fmi3Instance i, const reference vr[], size_t n, const size_t sizes[], const fmi3Binary value[], size_t values)
{ (void)i; (void)vr; (void)sizes; (void)value; (void)values; return n == 0 ? fmi3OK : fmi3Error; }
fmi3Status fmi3GetClock(fmi3Instance i, const reference vr[], size_t n, fmi3Clock value[])
{ (void)i; (void)vr; (void)value; return n == 0 ? fmi3OK : fmi3Error; }
fmi3Status fmi3SetClock(fmi3Instance i, const reference vr[], size_t n, const fmi3Clock value[])
{ (void)i; (void)vr; (void)value; return n == 0 ? fmi3OK : fmi3Error; }

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance i, reference vr, size_t *n)
{ (void)i; (void)vr; (void)n; return fmi3Error; }
fmi3Status fmi3GetVariableDependencies(fmi3Instance i, reference dependent, size_t elements[], reference independents[],
                                       size_t others[], fmi3DependencyKind kinds[], size_t n)
{ (void)i; (void)dependent; (void)elements; (void)independents; (void)others; (void)kinds; (void)n; return fmi3Error; }

fmi3Status fmi3GetFMUState(fmi3Instance i, fmi3FMUState *state) { return STATUS(copied(state, i)); }
fmi3Status fmi3SetFMUState(fmi3Instance i, fmi3FMUState state) { memcpy(i, state, sizeof(instance)); return fmi3OK; }

fmi3Status fmi3FreeFMUState(fmi3Instance i, fmi3FMUState *state)
{
    (void)i;
    free(*state);
    *state = NULL;
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance i, fmi3FMUState state, size_t *size)
{
    (void)i; (void)state;
    *size = sizeof(instance);
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance i, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    (void)i;
    if (size != sizeof(instance)) { return fmi3Error; }
    memcpy(bytes, state, size);
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance i, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    (void)i;
    if (size != sizeof(instance)) { return fmi3Error; }
    return STATUS(copied(state, bytes));
}

#define DERIVATIVE(name) \
    fmi3Status name(fmi3Instance i, const reference unknown[], size_t unknowns, const reference known[], size_t knowns, \
                    const fmi3Float64 seed[], size_t seeds, fmi3Float64 out[], size_t outs) \
    { (void)i; (void)unknown; (void)unknowns; (void)known; (void)knowns; (void)seed; (void)seeds; (void)out; (void)outs; return fmi3Error; }
DERIVATIVE(fmi3GetDirectionalDerivative)
DERIVATIVE(fmi3GetAdjointDerivative)

fmi3Status fmi3EnterConfigurationMode(fmi3Instance i) { (void)i; return fmi3Error; }
fmi3Status fmi3ExitConfigurationMode(fmi3Instance i) { (void)i; return fmi3Error; }

fmi3Status fmi3GetIntervalDecimal(fmi3Instance i, const reference vr[], size_t n, fmi3Float64 intervals[], fmi3IntervalQualifier q[])
{ (void)i; (void)vr; (void)n; (void)intervals; (void)q; return fmi3Error; }
fmi3Status fmi3GetIntervalFraction(fmi3Instance i, const reference vr[], size_t n, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                   fmi3IntervalQualifier q[])
{ (void)i; (void)vr; (void)n; (void)counters; (void)resolutions; (void)q; return fmi3Error; }
fmi3Status fmi3GetShiftDecimal(fmi3Instance i, const reference vr[], size_t n, fmi3Float64 shifts[])
{ (void)i; (void)vr; (void)n; (void)shifts; return fmi3Error; }
fmi3Status fmi3GetShiftFraction(fmi3Instance i, const reference vr[], size_t n, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
{ (void)i; (void)vr; (void)n; (void)counters; (void)resolutions; return fmi3Error; }
fmi3Status fmi3SetIntervalDecimal(fmi3Instance i, const reference vr[], size_t n, const fmi3Float64 intervals[])
{ (void)i; (void)vr; (void)n; (void)intervals; return fmi3Error; }
fmi3Status fmi3SetIntervalFraction(fmi3Instance i, const reference vr[], size_t n, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
{ (void)i; (void)vr; (void)n; (void)counters; (void)resolutions; return fmi3Error; }
fmi3Status fmi3SetShiftDecimal(fmi3Instance i, const reference vr[], size_t n, const fmi3Float64 shifts[])
{ (void)i; (void)vr; (void)n; (void)shifts; return fmi3Error; }
fmi3Status fmi3SetShiftFraction(fmi3Instance i, const reference vr[], size_t n, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
{ (void)i; (void)vr; (void)n; (void)counters; (void)resolutions; return fmi3Error; }

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance i) { (void)i; return fmi3Error; }
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance i, fmi3Boolean *needed, fmi3Boolean *terminate, fmi3Boolean *nominals,
                                    fmi3Boolean *changed, fmi3Boolean *defined, fmi3Float64 *time)
{ (void)i; (void)needed; (void)terminate; (void)nominals; (void)changed; (void)defined; (void)time; return fmi3Error; }
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance i) { (void)i; return fmi3Error; }
fmi3Status fmi3CompletedIntegratorStep(fmi3Instance i, fmi3Boolean no_set, fmi3Boolean *event, fmi3Boolean *terminate)
{ (void)i; (void)no_set; (void)event; (void)terminate; return fmi3Error; }
fmi3Status fmi3SetTime(fmi3Instance i, fmi3Float64 time) { (void)i; (void)time; return fmi3Error; }
fmi3Status fmi3SetContinuousStates(fmi3Instance i, const fmi3Float64 x[], size_t n) { (void)i; (void)x; (void)n; return fmi3Error; }
fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance i, fmi3Float64 x[], size_t n) { (void)i; (void)x; (void)n; return fmi3Error; }
fmi3Status fmi3GetEventIndicators(fmi3Instance i, fmi3Float64 e[], size_t n) { (void)i; (void)e; (void)n; return fmi3Error; }
fmi3Status fmi3GetContinuousStates(fmi3Instance i, fmi3Float64 x[], size_t n) { (void)i; (void)x; (void)n; return fmi3Error; }
fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance i, fmi3Float64 x[], size_t n) { (void)i; (void)x; (void)n; return fmi3Error; }
fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance i, size_t *n) { (void)i; (void)n; return fmi3Error; }
fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance i, size_t *n) { (void)i; (void)n; return fmi3Error; }
fmi3Status fmi3EnterStepMode(fmi3Instance i) { (void)i; return fmi3Error; }
fmi3Status fmi3GetOutputDerivatives(fmi3Instance i, const reference vr[], size_t n, const fmi3Int32 orders[], fmi3Float64 value[], size_t values)
{ (void)i; (void)vr; (void)n; (void)orders; (void)value; (void)values; return fmi3Error; }

fmi3Status fmi3DoStep(fmi3Instance i, fmi3Float64 time, fmi3Float64 size, fmi3Boolean no_set, fmi3Boolean *event,
                      fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last)
{
    instance *m = (instance *)i;
    (void)no_set;
    *event = fmi3False;
    *terminate = fmi3False;
    *early = fmi3False;
    if (steps_until(m, time + size) != 0) { return fmi3Error; }
    *last = m->time;
    return fmi3OK;
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance i, reference clock, fmi3Float64 time)
{ (void)i; (void)clock; (void)time; return fmi3Error; }
