"""The virtual rotary table: every number of the plant in one readable table.

Five thermally uniform bodies stand on a machine bed and are flooded from a sump:

    C_i T_i' = sum_j G_ij (T_j - T_i) + hA_i (T_env - T_i) + a_i P_fric(n) + c_i P_mot(n)
               + g_i (T_cool - T_i) + pump A_i h(n, h_nozzle) (T_fluid - T_i)
    C_f T_f' = pump (P_pump + sum_i A_i h (T_i - T_f)) - UA_f (T_f - T_env)
    T_bed'   = (T_env - T_bed)/tau_bed

Sources: [S] Mayr et al., "Compensation of cutting fluid influences on five axis machine tools".
[J] judgement, chosen so that a 72 h cycle has the uncompensated errors of that paper's Table 3. They are
plausible, not identified from the real machine.
"""

from __future__ import annotations

from typing import NamedTuple

BODIES = ("table", "c_body_1", "c_body_2", "b_body_1", "b_body_2")
ERRORS = ("E_Y0C", "E_Z0T", "E_R0T", "E_A0C")

Five = tuple[float, float, float, float, float]


class Machine(NamedTuple):
    """Parameters of the plant in SI units (speed in rpm); a named tuple: the compiled kernel reads it."""

    #                   table    c_body_1 c_body_2 b_body_1 b_body_2
    capacity: Five = (44.7e3, 62.4e3, 81.6e3, 165.0e3, 240.0e3)  # J/K           [J] mass x specific heat
    air: Five = (4.16, 1.68, 2.88, 6.72, 8.64)  # W/K   [J] area x 16 (spinning table) or 4.8 W/m2K
    friction_share: Five = (0.06, 0.42, 0.52, 0.0, 0.0)  # 1             [J] bearings
    motor_share: Five = (0.05, 0.10, 0.85, 0.0, 0.0)  # 1             [J] direct drive
    cooling_ua: Five = (0.0, 30.0, 113.0, 0.0, 0.0)  # W/K           [J] jacket, at unlimited coolant flow
    wet_area: Five = (
        0.0757,
        0.0224,
        0.0,
        0.0,
        0.0,
    )  # m2    [J] x h(600 rpm) = 220 and 65 W/K; [S] which two bodies
    length_z: Five = (0.064, 0.151, 0.180, 0.149, 0.0)  # m             [J] lever of E_Z0T
    length_y: Five = (0.0, 0.155, 0.080, 0.480, 0.252)  # m             [J] lever of E_Y0C
    tilt: Five = (
        0.0,
        5.83,
        2.87,
        -6.29,
        -2.41,
    )  # um/m/K        [J] of E_A0C; sums to 0: uniform growth tilts nothing

    # conduction, W/K [J]
    G_table_c1: float = 24.0
    G_c1_c2: float = 25.0
    G_c1_b1: float = 29.0
    G_c2_b1: float = 11.0
    G_b1_b2: float = 13.0
    G_b2_bed: float = 9.6
    tau_bed: float = 108e3  # s [J] 30 h
    coolant_flow: float = 220.0  # W/K [J] mass flow x specific heat

    # expansion
    alpha_steel: float = 11.5  # um/m/K [J]
    alpha_cast: float = 10.8  # um/m/K [J]
    radius: float = 0.167  # m [J] measuring radius of E_R0T
    T_ref: float = 22.0  # degC, uniform temperature at which the errors are zero

    # drive: P_fric = (M_c + M_v (n/600)^(2/3)) w, P_mot = iron (n/600)^1.5 + copper (M/6.5 Nm)^2  [J]
    M_coulomb: float = 2.84  # Nm
    M_viscous: float = 2.72  # Nm at 600 rpm
    iron: float = 80.0  # W at 600 rpm
    copper: float = 40.0  # W at 6.5 Nm

    # film: eqs. (1) to (5) [S], numbers [J]
    nozzle: float = 0.010  # m, d_n
    disk_radius: float = 0.25  # m, r_d
    lambda_s: float = 45.0  # W/m/K, steel
    lambda_f: float = 0.58  # W/m/K, emulsion
    nu: float = 1.2e-6  # m2/s, kinematic: a dynamic viscosity has the wrong dimension in eq. (2)
    Re: float = 1000.0  # jet Reynolds number
    h_still: float = 300.0  # W/m2K, gravity film at standstill, where eq. (1) gives 0

    # sump [J]: 300 l
    sump_capacity: float = 1.2e6  # J/K
    pump_power: float = 635.0  # W
    sump_ua: float = 91.0  # W/K
    flow_exponent: float = 1.0  # wet conductance ~ flow^m; 1: proportional

    # what the drive power channel sees of friction that an effect adds: 0 nothing (concealed), 1 all
    power_seen: float = 0.0
