@TITLE@ */
#include "@PREFIX@.h"

#include <math.h>

typedef @PREFIX@_real real;

#ifdef DISCOVERY_FLOAT
#define R(number) number##f
#define R_POW powf
#define R_EXP expf
#define R_LOG logf
#define R_SQRT sqrtf
#define R_TANH tanhf
#define R_ABS fabsf
#define R_HUGE HUGE_VALF
#else
#define R(number) number
#define R_POW pow
#define R_EXP exp
#define R_LOG log
#define R_SQRT sqrt
#define R_TANH tanh
#define R_ABS fabs
#define R_HUGE HUGE_VAL
#endif

#define N @STATES@
#define A @NONZEROS@
#define H @STEP@

const @PREFIX@_parameters @PREFIX@_defaults = {
@DEFAULTS@
};

@START_VALUES@
@RATES@
@OUTPUTS@
/* w = A v */
static void product(const real a[], const real v[], real w[])
{
@PRODUCT@
    (void)a; (void)v; (void)w;
}

/* z = h phi1(h A) f; 1 where A is too stiff or not finite */
static int increment(const real a[], const real f[], real z[])
{
    real norm = R(0.0);
    real sum = R(0.0);
    real v[N + 1];
    real w[N + 1];
    real tau;
    int substeps = 1;
    int i, j, k;
@SUMS@
    norm = norm * H / @LARGEST_NORM@;
    if (!(norm < @LARGEST_SUBSTEPS@)) { return 1; }
    while ((real)substeps < norm) { ++substeps; }
    tau = H / (real)substeps;
    for (i = 0; i < N; ++i) { z[i] = R(0.0); }
    for (k = 0; k < substeps; ++k) {
        product(a, z, v);
        for (i = 0; i < N; ++i) { v[i] = (v[i] + f[i]) * tau; z[i] += v[i]; }
        for (j = 2; j <= @ORDER@; ++j) {
            product(a, v, w);
            for (i = 0; i < N; ++i) { v[i] = w[i] * (tau / (real)j); z[i] += v[i]; }
        }
    }
    (void)a; (void)f; (void)sum;
    return 0;
}

/* Start values for inputs u, with the parameters that the state holds. */
static int restart(@PREFIX@_state *s, const real u[])
{
    real x[N + 1];
    real moved[@UP@_PLAYS + 1];
    int i;
@COUNTER@    start_values(&s->k, s->x, u, s->d, s->p, R(0.0), x, moved);
    for (i = 0; i < N; ++i) { if (!(R_ABS(x[i]) < R(1e30))) { return 1; } }
    for (i = 0; i < @UP@_PLAYS; ++i) { if (!(R_ABS(moved[i]) < R(1e30))) { return 1; } }
    for (i = 0; i < N; ++i) { s->x[i] = x[i]; s->c[i] = R(0.0); }
    for (i = 0; i < @UP@_PLAYS; ++i) { s->p[i] = moved[i]; }
@FIRST@
    s->count = 0;
    return 0;
}

int @PREFIX@_start_with(@PREFIX@_state *s, const @PREFIX@_parameters *k, const real u[])
{
    s->k = *k;
    return restart(s, u);
}

int @PREFIX@_start(@PREFIX@_state *s, const real u[]) { return @PREFIX@_start_with(s, &@PREFIX@_defaults, u); }

void @PREFIX@_outputs(const @PREFIX@_state *s, const real u[], real y[])
{
    real moved[@UP@_PLAYS + 1];
    outputs(&s->k, s->x, u, s->d, s->p, (real)s->count * H, y, moved);
}

int @PREFIX@_step(@PREFIX@_state *s, const real u[], real y[])
{
    real d[@UP@_DELAYS + 1] = {R(0.0)}; /* without a delay nothing is written into it */
    real f[N + 1];
    real a[A + 1];
    real moved[@UP@_PLAYS + 1];
    real settled[@UP@_PLAYS + 1];
    real z[N + 1];
    real x[N + 1];
    real c[N + 1];
    real out[@UP@_OUTPUTS + 1];
    int i;
@HERE@@DELAYED@
    rates(&s->k, s->x, u, d, s->p, (real)s->count * H, f, a, moved);
    if (increment(a, f, z) != 0) { return 1; }
    for (i = 0; i < N; ++i) {
        const real step = z[i] - s->c[i];
        x[i] = s->x[i] + step;
        c[i] = (x[i] - s->x[i]) - step;
        if (!(R_ABS(x[i]) < R(1e30))) { return 1; }
    }
    outputs(&s->k, x, u, d, moved, (real)(s->count + 1u) * H, out, settled);
    for (i = 0; i < @UP@_OUTPUTS; ++i) { if (!(R_ABS(out[i]) < R(1e30))) { return 1; } }
    for (i = 0; i < N; ++i) { s->x[i] = x[i]; s->c[i] = c[i]; }
    for (i = 0; i < @UP@_PLAYS; ++i) { s->p[i] = settled[i]; }
    for (i = 0; i < @UP@_OUTPUTS; ++i) { y[i] = out[i]; }
@MOVED_ON@
    ++s->count;
    return 0;
}

@GUARD@