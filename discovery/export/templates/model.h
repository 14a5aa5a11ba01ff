@TITLE@ *
 * On a machine: @PREFIX@_begin once, then @PREFIX@_tick every @STEP@ s with readings; it guards its inputs and
 * limits its offsets. The model alone: @PREFIX@_start once with the first inputs, then @PREFIX@_step every @STEP@ s.
 * Compile with -DDISCOVERY_FLOAT for float; never with -ffast-math, which would undo the compensated sums.
 */
#ifndef @UP@_H
#define @UP@_H

#include <stdint.h>

#ifdef DISCOVERY_FLOAT
typedef float @PREFIX@_real;
#else
typedef double @PREFIX@_real;
#endif

@SIZES@
#define @UP@_STEP_S @STEP_S@

@PLACES@

/* Parameters of the model. Those of the state may be changed while it runs@FIXED@. */
typedef struct {
@PARAMETERS@
} @PREFIX@_parameters;
extern const @PREFIX@_parameters @PREFIX@_defaults;

typedef struct {
    @PREFIX@_parameters k;
    @PREFIX@_real x[@UP@_STATES + 1];        /* states */
    @PREFIX@_real c[@UP@_STATES + 1];        /* what rounding left over of their sums */
    @PREFIX@_real d[@UP@_DELAYS + 1];        /* delayed inputs */
    @PREFIX@_real p[@UP@_PLAYS + 1];         /* plays */
    @PREFIX@_real ring[@UP@_RING + 1];       /* past inputs */
    uint32_t position[@UP@_DELAYS + 1];
    uint32_t count;                    /* steps since the start */
} @PREFIX@_state;

/* Both return 0 when done, 1 where a number is not finite; then nothing has changed. */
int @PREFIX@_start(@PREFIX@_state *s, const @PREFIX@_real u[]);
int @PREFIX@_step(@PREFIX@_state *s, const @PREFIX@_real u[], @PREFIX@_real y[]);

/* As @PREFIX@_start, with other parameters than the defaults. */
int @PREFIX@_start_with(@PREFIX@_state *s, const @PREFIX@_parameters *k, const @PREFIX@_real u[]);

/* Outputs of the present state under inputs u, without a step. */
void @PREFIX@_outputs(const @PREFIX@_state *s, const @PREFIX@_real u[], @PREFIX@_real y[]);

/* ---- compensation: guarded inputs, limited offsets ---- */

typedef struct {
    @PREFIX@_real value; /* NaN: no reading */
    @PREFIX@_real age;   /* s since it was measured */
    int good;            /* 0: its source marks it as bad */
} @PREFIX@_reading;

/* Settings of a compensation; they may be changed while it runs. */
typedef struct {
    int guards; /* 1: bad inputs are replaced by their last good value; 0: any finite number is taken */
    int limits; /* 1: offsets are limited in size and rate; 0: they are not */
    int fade;   /* 1: the gain falls where an input is far outside of its training; 0: it is 1 */
@SETTINGS@
} @PREFIX@_settings;
extern const @PREFIX@_settings @PREFIX@_default_settings;

/* Modes, the low byte of the status word. */
enum { @UP@_OFF, @UP@_COLD, @UP@_WARM, @UP@_ACTIVE, @UP@_DEGRADED, @UP@_FROZEN, @UP@_FAULT };
/* Further bits: why an input is replaced, gain falling, at the limit, at the rate. */
enum {
    @UP@_NOT_FINITE = 1 << 8, @UP@_QUALITY = 1 << 9, @UP@_AGE = 1 << 10, @UP@_IMPLAUSIBLE = 1 << 11,
    @UP@_JUMP = 1 << 12, @UP@_UNTRAINED = 1 << 13, @UP@_LIMITED = 1 << 18, @UP@_RATED = 1 << 19
};

/* What is compensated: place of each offset among the outputs. */
@OFFSET_PLACES@

typedef struct {
    @PREFIX@_settings set;
    @PREFIX@_state model;                       /* parameters in model.k */
    @PREFIX@_real offset[@UP@_OFFSETS + 1];     /* to add to the position, minus the predicted error */
    @PREFIX@_real y[@UP@_OUTPUTS + 1];          /* outputs of the model */
    @PREFIX@_real gain;
    int mode;
    int status;
    int fault[@UP@_INPUTS + 1];                 /* why an input is replaced, 0: it is not */
    /* what follows is memory */
    @PREFIX@_real held[@UP@_INPUTS + 1], held_age[@UP@_INPUTS + 1], seen[@UP@_INPUTS + 1], unseen[@UP@_INPUTS + 1];
    @PREFIX@_real mean[@UP@_INPUTS + 1], used[@UP@_INPUTS + 1];
    @PREFIX@_real still_for[@UP@_INPUTS + 1], waiting[@UP@_INPUTS + 1], gap[@UP@_INPUTS + 1], stayed[@UP@_INPUTS + 1];
    int has_held[@UP@_INPUTS + 1], has_seen[@UP@_INPUTS + 1], fresh[@UP@_INPUTS + 1], waits[@UP@_INPUTS + 1];
    @PREFIX@_real good_s, fail_s, started_s;
    int settling, running, has_y, ticked;
} @PREFIX@_compensator;

/* Defaults, nothing known yet. Change settings and model.k after it, if at all. */
void @PREFIX@_begin(@PREFIX@_compensator *c);

/* One tick, every @STEP@ s. enabled 0: offsets go to zero. part_done 1: offsets that are held because the model
 * failed may be let go. acknowledge 1: an operator has looked; steps that wait are accepted, a fault ends. */
void @PREFIX@_tick(@PREFIX@_compensator *c, const @PREFIX@_reading in[], int enabled, int part_done, int acknowledge);

#endif
