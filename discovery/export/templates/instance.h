/* One running unit and what both versions of the standard do with it. Whoever includes this says what a
 * reference is (`reference`). References count: inputs, outputs of the model, offsets, gain, model parameters,
 * limits and rates of the offsets; then, of type Boolean, the quality of each input, enable, part done, acknowledge
 * and the options guards, limits, fade; then, of type Integer, status word and state. */
#include "@PREFIX@.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define TOKEN "@GUID@"
#define INPUTS @UP@_INPUTS
#define OUTPUTS @UP@_OUTPUTS
#define OFFSETS @UP@_OFFSETS
#define PARAMETERS @PARAMETERS@
#define FIRST_OUTPUT INPUTS
#define FIRST_OFFSET (FIRST_OUTPUT + OUTPUTS)
#define GAIN (FIRST_OFFSET + OFFSETS)
#define FIRST_PARAMETER (GAIN + 1)
#define FIRST_LIMIT (FIRST_PARAMETER + PARAMETERS)
#define FIRST_RATE (FIRST_LIMIT + OFFSETS)
#define FIRST_QUALITY (FIRST_RATE + OFFSETS)
#define SWITCHES (FIRST_QUALITY + INPUTS) /* enable, part done, acknowledge, guards, limits, fade */
#define STATUS_WORD (SWITCHES + 6)
#define STATE_WORD (STATUS_WORD + 1)

enum phase { SET_UP, INITIALISING, RUNNING, TERMINATED };

typedef struct {
    double start_time;
    double time;
    double u[INPUTS + 1];
    double y[OUTPUTS + 1];
    int good[INPUTS + 1];
    int on[3]; /* enable, part done, acknowledge */
    uint32_t ticks;
    enum phase phase;
    @PREFIX@_compensator c;
} instance;

static const double start_inputs[] = {@START@ 0.0};

static void set_up(instance *m)
{
    int i;
    memset(m, 0, sizeof *m);
    memcpy(m->u, start_inputs, sizeof(double) * INPUTS);
    for (i = 0; i < INPUTS; ++i) { m->good[i] = 1; }
    m->on[0] = 1;
    @PREFIX@_begin(&m->c);
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

/* Outputs at the start, as the inputs are now. */
static int initialise(instance *m)
{
    const @PREFIX@_parameters k = m->c.model.k;
    if (@PREFIX@_start_with(&m->c.model, &k, m->u) != 0) { return 1; }
    @PREFIX@_outputs(&m->c.model, m->u, m->y);
    return 0;
}

static int begin(instance *m, double start)
{
    if (m->phase != SET_UP) { return 1; }
    m->start_time = start;
    m->time = start;
    m->phase = INITIALISING;
    return 0;
}

static int run(instance *m)
{
    if (m->phase != INITIALISING || initialise(m) != 0) { return 1; }
    m->phase = RUNNING;
    return 0;
}

static int terminate(instance *m)
{
    if (m->phase != RUNNING) { return 1; }
    m->phase = TERMINATED;
    return 0;
}

static int steps_until(instance *m, double time)
{
    const double due = floor((time - m->start_time) / @UP@_STEP_S + 1e-6);
    @PREFIX@_reading in[INPUTS + 1];
    int i;
    if (m->phase != RUNNING) { return 1; }
    while ((double)m->ticks < due) {
        for (i = 0; i < INPUTS; ++i) { in[i].value = m->u[i]; in[i].age = 0.0; in[i].good = m->good[i]; }
        @PREFIX@_tick(&m->c, in, m->on[0], m->on[1], m->on[2]);
        ++m->ticks;
        if (m->c.has_y) { memcpy(m->y, m->c.y, sizeof(double) * OUTPUTS); }
    }
    m->time = time;
    (void)i; (void)in;
    return 0;
}

static double *real_at(instance *m, reference r)
{
    if (r < FIRST_OUTPUT) { return &m->u[r]; }
    if (r < FIRST_OFFSET) { return &m->y[r - FIRST_OUTPUT]; }
    if (r < GAIN) { return &m->c.offset[r - FIRST_OFFSET]; }
    if (r == GAIN) { return &m->c.gain; }
    if (r < FIRST_LIMIT) { return (double *)(void *)&m->c.model.k + (r - FIRST_PARAMETER); }
    if (r < FIRST_RATE) { return &m->c.set.limit[r - FIRST_LIMIT]; }
    if (r < FIRST_QUALITY) { return &m->c.set.rate_of_offset[r - FIRST_RATE]; }
    return NULL;
}

static int *boolean_at(instance *m, reference r)
{
    if (r < FIRST_QUALITY || r >= STATUS_WORD) { return NULL; }
    if (r < SWITCHES) { return &m->good[r - FIRST_QUALITY]; }
    switch (r - SWITCHES) {
    case 0: case 1: case 2: return &m->on[r - SWITCHES];
    case 3: return &m->c.set.guards;
    case 4: return &m->c.set.limits;
    default: return &m->c.set.fade;
    }
}

static int get(instance *m, const reference vr[], size_t n, double value[])
{
    size_t k;
    if (m->phase == INITIALISING && initialise(m) != 0) { return 1; }
    for (k = 0; k < n; ++k) {
        const double *at = real_at(m, vr[k]);
        if (at == NULL) { return 1; }
        value[k] = *at;
    }
    return 0;
}

/* A value that is no number is the guards' affair; a parameter must be one. */
static int set(instance *m, const reference vr[], size_t n, const double value[])
{
    size_t k;
    for (k = 0; k < n; ++k) {
        double *at = real_at(m, vr[k]);
        if (at == NULL || (vr[k] >= FIRST_OUTPUT && (vr[k] <= GAIN || !(fabs(value[k]) < 1e30)))) { return 1; }
        *at = value[k];
    }
    return 0;
}

static int integer(const instance *m, reference r, int *value)
{
    if (r != STATUS_WORD && r != STATE_WORD) { return 1; }
    *value = r == STATUS_WORD ? m->c.status : m->c.mode;
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
