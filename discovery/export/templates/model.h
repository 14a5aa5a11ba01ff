@TITLE@ *
 * @PREFIX@_start once with the first inputs, then @PREFIX@_step every @STEP@ s.
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

typedef struct {
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

/* Outputs of the present state under inputs u, without a step. */
void @PREFIX@_outputs(const @PREFIX@_state *s, const @PREFIX@_real u[], @PREFIX@_real y[]);

#endif
