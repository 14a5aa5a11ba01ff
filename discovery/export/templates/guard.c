/* ---- compensation: guarded inputs, limited offsets ---- */

const @PREFIX@_settings @PREFIX@_default_settings = {
    1, 1, 1,
@SETTINGS@
};
static const int place[@UP@_OFFSETS + 1] = {@PLACES@0};

static real larger(real a, real b) { return a > b ? a : b; }
static real smaller(real a, real b) { return a < b ? a : b; }

/* How far a value is outside of its training, in spans of it. */
static real outside(const @PREFIX@_settings *g, int i, real v)
{
    return larger(larger(g->low[i] - v, v - g->high[i]), R(0.0)) / g->span[i];
}

static real gain_of(const @PREFIX@_settings *g, int i, real v)
{
    return smaller(R(1.0), larger(R(0.0), (@FADE_TO@ - outside(g, i, v)) / (@FADE_TO@ - @FADE_FROM@)));
}

/* 1 where a value steps away and has not yet stayed for long enough. */
static int steps_away(@PREFIX@_compensator *c, int i, real v, int had, real before, real elapsed, int together)
{
    const @PREFIX@_settings *g = &c->set;
    const int held_input = g->step[i] < R(0.0); /* it may switch inside of its training at will */
    int away, steady = 1, allowed = 1;
    real needed;
    if (held_input) {
        const real was = c->has_held[i] ? outside(g, i, c->held[i]) : R(0.0);
        away = outside(g, i, v) > larger(@FADE_FROM@, @FURTHER@ * was);
    } else {
        const real usual = g->step[i] + g->rate[i] * (c->waits[i] ? c->gap[i] : c->held_age[i]);
        away = c->has_held[i] && !c->fresh[i] && R_ABS(v - c->held[i]) > usual;
        steady = had && R_ABS(v - before) <= g->step[i] + g->rate[i] * elapsed;
        allowed = !c->has_held[i] || g->sudden[i] < R(0.0) || R_ABS(v - c->held[i]) <= g->sudden[i];
    }
    if (!away) {
        c->waits[i] = 0;
        c->stayed[i] = held_input ? larger(R(0.0), c->stayed[i] - @LEAK@ * elapsed) : R(0.0);
        return 0;
    }
    if (!c->waits[i]) {
        c->gap[i] = c->held_age[i];
        steady = steady && held_input; /* a temperature begins to stay with the value after its step */
    }
    c->stayed[i] = steady ? c->stayed[i] + elapsed : R(0.0);
    c->waiting[i] = v;
    c->waits[i] = 1;
    needed = (allowed ? @CONFIRM_S@ : @FAR_S@) * (together && allowed ? @TOGETHER@ : R(1.0));
    if (c->stayed[i] < needed) { return 1; }
    c->waits[i] = 0;
    c->stayed[i] = held_input ? smaller(c->stayed[i], R(2.0) * @CONFIRM_S@) : R(0.0);
    return 0;
}

static int judged(@PREFIX@_compensator *c, int i, const @PREFIX@_reading *in, int together)
{
    const @PREFIX@_settings *g = &c->set;
    const real v = in->value, before = c->seen[i], elapsed = smaller(c->unseen[i], g->age[i]);
    const int had = c->has_seen[i];
    if (!(R_ABS(v) < R_HUGE)) { return @UP@_NOT_FINITE; }
    if (!g->guards) { return 0; }
    if (!in->good) { return @UP@_QUALITY; }
    if (!(R_ABS(in->age) <= g->age[i])) { return @UP@_AGE; }
    if (v < g->plausible_low[i] || v > g->plausible_high[i]) { return @UP@_IMPLAUSIBLE; }
    if (!had || v != before || c->fresh[i]) { c->still_for[i] = R(0.0); }
    c->seen[i] = v;
    c->has_seen[i] = 1;
    c->unseen[i] = R(0.0);
    if (g->still[i] >= R(0.0) && c->still_for[i] > g->still[i]) { return @UP@_AGE; }
    return steps_away(c, i, v, had, before, elapsed, together) ? @UP@_JUMP : 0;
}

/* Check all inputs; 1 where each has a value to go on with. */
static int check(@PREFIX@_compensator *c, const @PREFIX@_reading in[])
{
    int way[@UP@_INPUTS + 1];
    int i, j, all = 1;
    for (i = 0; i < @UP@_INPUTS; ++i) {
        way[i] = 0;
        if (c->waits[i] && c->has_held[i] && c->set.step[i] >= R(0.0)) {
            way[i] = c->waiting[i] > c->held[i] ? 1 : -1;
        }
    }
    c->gain = R(1.0);
    for (i = 0; i < @UP@_INPUTS; ++i) {
        int together = 0;
        for (j = 0; j < @UP@_INPUTS; ++j) {
            if (j != i && way[i] != 0 && way[j] == way[i]) { together = 1; }
        }
        c->fault[i] = judged(c, i, &in[i], together);
        if (c->fault[i] == 0) {
            const real passed = smaller(c->held_age[i], c->set.age[i]);
            c->mean[i] = c->has_held[i] ? c->mean[i] + (in[i].value - c->mean[i]) * passed / (@MEAN_S@ + passed)
                                        : in[i].value;
            c->held[i] = in[i].value;
            c->held_age[i] = R(0.0);
            c->has_held[i] = 1;
            c->fresh[i] = 0;
        }
        /* an input that switches is better described by its mean than by the moment in which it was lost */
        c->used[i] = c->set.step[i] < R(0.0) && c->held_age[i] > c->set.age[i] ? c->mean[i] : c->held[i];
        if (!c->has_held[i]) {
            c->fault[i] = @UP@_NOT_FINITE;
            all = 0;
        } else if (c->set.fade) {
            const real gain = gain_of(&c->set, i, c->held[i]);
            if (gain != R(1.0)) { c->fault[i] |= @UP@_UNTRAINED; }
            c->gain = smaller(c->gain, gain);
        }
    }
    (void)in; (void)j; (void)way;
    return all;
}

/* The model gave no number: hold, then ramp out; in FAULT it starts anew in the end. */
static void fails(@PREFIX@_compensator *c, int part_done)
{
    if (c->mode == @UP@_FAULT) {
        if (c->fail_s > c->set.freeze_limit_s) { c->running = 0; c->fail_s = R(0.0); }
        return;
    }
    if (c->mode != @UP@_FROZEN) { c->mode = @UP@_FROZEN; c->fail_s = R(0.0); }
    if (part_done || c->fail_s > c->set.freeze_limit_s) { c->mode = @UP@_FAULT; c->fail_s = R(0.0); }
}

static void change_mode(@PREFIX@_compensator *c, int failed, real dt, int enabled, int part_done, int hurry)
{
    const @PREFIX@_settings *g = &c->set;
    int i, replaced = 0, good, settled;
    real held = R(0.0);
    for (i = 0; i < @UP@_INPUTS; ++i) {
        if ((c->fault[i] & ~@UP@_UNTRAINED) != 0) { replaced = 1; }
        held = larger(held, c->held_age[i]);
    }
    if (replaced || failed) { c->good_s = R(-1.0); }
    else { c->good_s = c->good_s < R(0.0) ? R(0.0) : c->good_s + dt; }
    good = c->good_s >= R(0.0) && (hurry || c->good_s >= g->recover_s);
    settled = c->started_s < g->settle_s ? c->settling : @UP@_ACTIVE;
    if (!enabled) { c->mode = @UP@_OFF; }
    else if (!c->running) { return; }
    else if (failed) { fails(c, part_done); }
    else if (replaced && held > g->hold_limit_s) {
        if (c->mode != @UP@_FAULT) { c->fail_s = R(0.0); }
        c->mode = @UP@_FAULT;
    } else if (c->mode == @UP@_FAULT && good) {
        c->settling = @UP@_WARM;
        c->started_s = R(0.0);
        c->mode = g->settle_s > R(0.0) ? @UP@_WARM : @UP@_ACTIVE;
    } else if (c->mode != @UP@_FAULT) {
        const int recovering = (c->mode == @UP@_DEGRADED || c->mode == @UP@_FROZEN) && !good;
        c->mode = replaced || recovering ? @UP@_DEGRADED : settled;
    }
}

/* Move the offsets towards their targets, as far as limit and rate allow. */
static int move(@PREFIX@_compensator *c, real dt)
{
    int k, flags = 0;
    for (k = 0; k < @UP@_OFFSETS; ++k) {
        real target = c->offset[k];
        if (c->mode == @UP@_OFF || c->mode == @UP@_FAULT) { target = R(0.0); }
        else if (c->mode != @UP@_FROZEN && c->has_y) { target = -(c->gain * c->y[place[k]]); }
        if (!(R_ABS(target) < R_HUGE)) { target = c->offset[k]; }
        if (c->set.limits) {
            const real limit = c->set.limit[k], most = c->set.rate_of_offset[k] * dt;
            if (R_ABS(target) > limit) { target = target < R(0.0) ? -limit : limit; flags |= @UP@_LIMITED; }
            if (R_ABS(target - c->offset[k]) > most) {
                target = c->offset[k] + (target < c->offset[k] ? -most : most);
                flags |= @UP@_RATED;
            }
        }
        c->offset[k] = target;
    }
    return flags;
}

void @PREFIX@_begin(@PREFIX@_compensator *c)
{
    static const @PREFIX@_compensator nothing;
    int i;
    *c = nothing;
    c->set = @PREFIX@_default_settings;
    c->model.k = @PREFIX@_defaults;
    c->gain = R(1.0);
    c->good_s = R(-1.0);
    c->settling = @UP@_COLD;
    for (i = 0; i < @UP@_INPUTS; ++i) { c->fresh[i] = 1; c->unseen[i] = R(1e30); }
}

void @PREFIX@_tick(@PREFIX@_compensator *c, const @PREFIX@_reading in[], int enabled, int part_done, int acknowledge)
{
    const real dt = c->ticked ? H : R(0.0);
    int i, failed = 0;
    c->ticked = 1;
    c->fail_s += dt;
    c->started_s += dt;
    for (i = 0; i < @UP@_INPUTS; ++i) {
        c->held_age[i] += dt;
        c->unseen[i] += dt;
        c->still_for[i] += dt;
        if (acknowledge) { c->fresh[i] = 1; c->waits[i] = 0; c->stayed[i] = R(0.0); }
    }
    if (check(c, in)) {
        if (!c->running) {
            failed = restart(&c->model, c->used) != 0;
            if (!failed) { c->running = 1; c->started_s = R(0.0); c->settling = @UP@_COLD; }
        }
        if (c->running) {
            failed = @PREFIX@_step(&c->model, c->used, c->y) != 0;
            if (!failed) { c->has_y = 1; }
        }
    }
    change_mode(c, failed, dt, enabled, part_done, acknowledge);
    c->status = c->mode | move(c, dt);
    for (i = 0; i < @UP@_INPUTS; ++i) { c->status |= c->fault[i]; }
}
