"""Every number that decides in a diagnosis, with its meaning in the model of `docs/mismatch.md`.

    C_i dx_i/dt = terms + sum_k z_k a_k phi_k(x, u; eta_k) + s_i(t) w_i(t)
    y_j         = output(x) + sensor effects + slow_j(t) + white noise

Evidence is integrated over the values of a table {value: weight}.

`python -m benchmarks.thresholds` shows the effect of each number on cases of several families of machines.
The numbers are priors, resolutions of integrals, and limits of probability. There are no other rules.
"""

from __future__ import annotations

# --- process noise: what a lumped model misses everywhere -------------------------------------------------
FLOOR = 0.02  # of the mean of the flows of a body and of the busiest, rms, at level one: unrecorded heat
AIR = 0.1  # K: the air at a body differs from what is measured, at level one; zeros of thermometers are off
LAYERS = 3 * AIR  # K: how much warmer than measured the air at a body may be all the time
LEVELS = {0.1: 0.15, 0.3: 0.35, 1.0: 0.3, 2.0: 0.12, 5.0: 0.06, 10.0: 0.02}  # of this heat, with weights
SHARES = {0.005: 0.2, 0.02: 0.4, 0.08: 0.28, 0.25: 0.1, 0.8: 0.02}  # of what flows, off from hour to hour
SHARE = max(share for share, weight in SHARES.items() if weight > 1 / len(SHARES))  # off by more: coarse
TIMES = {1.0: 0.5, 0.3: 0.3, 0.1: 0.2}  # its time constant, over the longest (3 h, where readings are usual)
FORMS = {(0.0, 0.0): 0.25, (0.0, 0.1): 0.25, (0.025, 0.1): 0.25, (0.08, 0.1): 0.15, (0.25, 0.25): 0.1}
# shares by which laws are off at an operating point, and of flows that enter the neighbours of a body
SLOW = {0.0: 0.35, 0.3: 0.35, 1.0: 0.2, 3.0: 0.08, 10.0: 0.02}  # slow noise of outputs, in reading noises
FORM = max(law for law, _ in FORMS)  # of the flow of a named effect, too: no law is quite that of nature

# --- effects ----------------------------------------------------------------------------------------------
BELIEF = 0.5  # log of the factor within which the start values of a hand-built model are believed
ODDS = 0.02  # prior odds of an effect of the catalogue to act, over all places; of an event in each recording
USUAL = 0.2  # median size of an effect: what it makes flow, as a share of the largest flow of the model
FACTOR = 3.0  # 68 % of sizes lie within this factor of their median (log-normal: zero at zero)
UNKNOWN_HEAT = tuple(FACTOR**k for k in (1, 2, 3))  # "none of these": times the unrecorded heat of a body ...
UNKNOWN_SHARES = (0.0, *(share for share in SHARES if share > SHARE))  # ... and of its flows; pairs alike

# --- what is said -----------------------------------------------------------------------------------------
SUREST = 0.98  # probability that is never exceeded: causes that nobody thought of; of tests by blocks, too
NAMED = 0.7  # probability from which an effect is named
MATTERS = 0.15  # reading noises, rms: what explains less of free runs (1 % of their rms) has no name
SHORT = 16.0  # log evidence that a name has to add, and that an unknown cause has to add to refute names
CHANCE = 1.5  # standard deviations of all log evidence that a name has to add: 7 % lie above by chance
MISSED = 2.0  # times what is expected of free runs (rms; mean square where fitted), and of their starts
RIVAL = 3.0  # log evidence within which another answer may as well be right
RIVALS_SHOWN = 12  # other answers in the document
DRAWS = 50  # bootstrap draws over blocks
BLOCKS = 36  # of time, over all recordings
