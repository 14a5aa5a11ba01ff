/* One running unit and what both versions of the standard do with it. Whoever includes this says what a
 * reference is: its type `reference` counts the inputs, then the outputs. */
#include "@PREFIX@.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define TOKEN "@GUID@"
#define VARIABLES (@UP@_INPUTS + @UP@_OUTPUTS)

typedef struct {
    double start_time;
    double time;
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

static instance *instantiate(const char *token)
{
    instance *m;
    if (token == NULL || strcmp(token, TOKEN) != 0) { return NULL; }
    m = (instance *)malloc(sizeof *m);
    if (m != NULL) { set_up(m); }
    return m;
}

/* What follows returns 0 when done, 1 when not. */

static int initialise(instance *m)
{
    if (@PREFIX@_start(&m->state, m->u) != 0) { return 1; }
    @PREFIX@_outputs(&m->state, m->u, m->y);
    return 0;
}

static int steps_until(instance *m, double time)
{
    const double due = floor((time - m->start_time) / @UP@_STEP_S + 1e-6);
    while ((double)m->state.count < due) {
        if (@PREFIX@_step(&m->state, m->u, m->y) != 0) { return 1; }
    }
    m->time = time;
    return 0;
}

static int get(const instance *m, const reference vr[], size_t n, double value[])
{
    size_t k;
    for (k = 0; k < n; ++k) {
        if (vr[k] < @UP@_INPUTS) { value[k] = m->u[vr[k]]; }
        else if (vr[k] < VARIABLES) { value[k] = m->y[vr[k] - @UP@_INPUTS]; }
        else { return 1; }
    }
    return 0;
}

static int set(instance *m, const reference vr[], size_t n, const double value[])
{
    size_t k;
    for (k = 0; k < n; ++k) {
        if (vr[k] >= @UP@_INPUTS || !(fabs(value[k]) < 1e30)) { return 1; }
        m->u[vr[k]] = value[k];
    }
    return 0;
}

/* A copy of an instance, in room made for it where there is none. */
static int copied(void **copy, const void *from)
{
    if (*copy == NULL) { *copy = malloc(sizeof(instance)); }
    if (*copy == NULL) { return 1; }
    memcpy(*copy, from, sizeof(instance));
    return 0;
}
