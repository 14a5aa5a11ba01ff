"""The simulation core against closed forms, LSODA and energy."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from discovery.virtual.kernel import vapour
from discovery.virtual.network import LEVEL, Form, Law, Network, Switch, heat, link, natural, stream
from discovery.virtual.physics import film, palmgren_power, viscous_shape
from discovery.virtual.simulate import Run, State, elimination, simulate

Array = NDArray[np.float64]


def constant(n: int, **values: float) -> dict[str, Array]:
    return {name: np.full(n, value) for name, value in values.items()}


def test_one_body_follows_its_exponential() -> None:
    network = Network({"body": 36e3}, (link("air", "body", "room", 10.0), heat("drive", "body", 1.0, "P")))
    run = simulate(network, constant(720, room=20.0, P=50.0), 10.0, 20.0)
    t = np.arange(721) * 10.0
    np.testing.assert_allclose(run.nodes[:, 0], 25.0 - 5.0 * np.exp(-t / 3600.0), atol=2e-6)


def test_two_bodies_reach_their_balance() -> None:
    """P = G_air (T_1 - T_room), and the second body stands between them."""
    laws = (link("air", "outer", "room", 4.0), link("joint", "inner", "outer", 8.0), heat("P", "inner", 40.0))
    run = simulate(Network({"inner": 1e3, "outer": 2e3}, laws), constant(2000, room=20.0), 10.0, 20.0)
    np.testing.assert_allclose(run.nodes[-1], [35.0, 30.0], atol=1e-6)


def every_form() -> tuple[Network, dict[str, Array]]:
    n = 360
    oil = viscous_shape(2 / 3)
    laws = (
        heat("drive", "a", 30.0, "P"),
        link("joint", "a", "b", 12.0),
        natural("air", "b", "room", 1.5, 0.25),
        Law("shine", Form.RADIATION, "b", "room", 0.4),
        Law("oil", Form.VISCOUS, "a", "a", 25.0, shape=oil),
        Law("mixed", Form.STRIBECK, "a", "b", 1.0, "n", (*oil, 0.05, 0.2)),
        Law("preload", Form.PRELOAD, "a", "b", 6.0, shape=(0.05, 0.8)),
        Law(
            "damp", Form.EVAPORATION, "b", "room", 8.0, None, (0.5,), "wet", -1e-6, ("wet", 0.02)
        ),
        Law("contact", Form.CONTACT, "b", "c", 5.0, shape=(0.4, 24.0, 3.0), leaves="c"),
        Law("melt", Form.MELTING, "share", "c", 1 / 600.0, shape=(24.0, 0.5), leaves="c", take=2000.0),
        Law("freeze", Form.LINK, "share", size=1 / 600.0, leaves="c", take=2000.0),
        heat("fed", "wet", 1e-4, "P"),
        Law("drains", Form.POWER, "wet", size=0.1, shape=(2.0,)),
        stream("carried", "c", "a", 3.0),
    )  # fmt: skip
    nodes = {"a": 3e3, "b": 6e3, "c": 4e3, "wet": LEVEL, "share": LEVEL}
    P = (np.arange(n) // 60 % 2).astype(float)
    return Network(nodes, laws), {"P": P, "n": 900.0 * P, "room": np.full(n, 20.0)}


def rate_of_every_form(x: Array, P: float) -> Array:
    """The same equations, written out."""
    a, b, c, wet, share = x
    room, k = 20.0, 804.0 * 2 / 3

    def oil(T: float) -> float:
        return float(np.exp(k / (T + 95.0) - k / 117.0))

    def kelvin(T: float) -> float:
        return T + 273.15

    v = 0.9 * P * oil(b)
    mixed = 900.0 * P * 2 * np.pi / 60 * (0.05 * np.exp(-v) + 0.2 * v ** (2 / 3))
    joint, damp = 12.0 * (b - a), 8.0 * wet / (wet + 0.02) * max(0.0, vapour(b) - 0.5 * vapour(room))
    contact = 5.0 * (1 + 0.4 * np.tanh(((b + c) / 2 - 24.0) / 3.0)) * (c - b)
    melt = (1 + np.tanh((c - 24.0) / 0.5)) / 2 / 600.0 - share / 600.0
    qa = 30.0 * P + joint + 25.0 * oil(a) + mixed + 6.0 * max(0.0, 1 + 0.05 * (a - b)) ** 0.8
    air = 1.5 * abs(room - b) ** 0.25 * (room - b)
    qb = -joint + air + 0.4 * 5.670374e-8 * (kelvin(room) ** 4 - kelvin(b) ** 4) - damp + contact
    qc = -contact - 2000.0 * melt + 3.0 * (a - c)
    return np.array([qa / 3e3, qb / 6e3, qc / 4e3, 1e-4 * P - 0.1 * wet**3 - 1e-6 * damp, melt])


def by_lsoda(inputs: dict[str, Array], step: float) -> Array:
    x = np.array([20.0, 20.0, 20.0, 0.0, 0.0])
    rows = [x]
    for P in inputs["P"]:

        def rate(_: float, y: Array, P: float = float(P)) -> Array:
            return rate_of_every_form(y, P)

        x = solve_ivp(rate, (0.0, step), x, method="LSODA", rtol=1e-9, atol=1e-9).y[:, -1]
        rows.append(x)
    return np.array(rows)


def test_every_form_against_lsoda() -> None:
    network, inputs = every_form()
    run = simulate(network, inputs, 30.0, 20.0)
    np.testing.assert_allclose(run.nodes[:, :3], by_lsoda(inputs, 30.0)[:, :3], atol=4e-3)
    np.testing.assert_allclose(run.nodes[:, 3:], by_lsoda(inputs, 30.0)[:, 3:], atol=5e-4)


def test_the_step_is_of_second_order() -> None:
    network, inputs = every_form()
    exact = by_lsoda(inputs, 30.0)
    errors = []
    for parts in (1, 2, 4):
        fine = {name: np.repeat(series, parts) for name, series in inputs.items()}
        run = simulate(network, fine, 30.0 / parts, 20.0)
        errors.append(np.abs(run.nodes[::parts, 0] - exact[:, 0]).max())
    assert errors[0] / errors[1] > 3.0
    assert errors[1] / errors[2] > 3.0


def test_a_node_far_faster_than_the_step_is_no_trouble() -> None:
    """A film of 4 J/K under 400 W/K: time constant 10 ms, step 10 s."""
    laws = (
        link("wet", "film", "body", 400.0),
        heat("P", "film", 100.0, "P"),
        link("air", "body", "room", 5.0),
    )
    P = (np.arange(500) // 50 % 2).astype(float)
    run = simulate(
        Network({"film": 4.0, "body": 10e3}, laws), {"P": P, "room": np.full(500, 20.0)}, 10.0, 20.0
    )
    np.testing.assert_allclose(run["film"][49], run["body"][49], atol=1e-6)
    np.testing.assert_allclose(run["film"][99] - run["body"][99], 0.25, atol=1e-3)


def stored(run: Run) -> float:
    C = np.array(list(run.network.nodes.values()))
    return float((run.nodes[-1] - run.nodes[0]) @ C)


def test_energy_closes() -> None:
    """Links, a cold loop of streams and a contact lose nothing: what is stored is what the drive brought."""
    laws = (
        heat("drive", "a", 80.0, "P"),
        link("joint", "a", "b", 15.0),
        Law("contact", Form.CONTACT, "b", "c", 9.0, shape=(0.5, 23.0, 2.0), leaves="c"),
        Law("shine", Form.RADIATION, "c", "a", 0.3, leaves="a"),
        Law("melt", Form.MELTING, "share", "c", 1 / 400.0, shape=(24.0, 0.5), leaves="c", take=5000.0),
        Law("freeze", Form.LINK, "share", size=1 / 400.0, leaves="c", take=5000.0),
        stream("loop", "b", "c", 20.0),
        stream("loop", "c", "b", 20.0),
    )
    nodes = {"a": 2e3, "b": 5e3, "c": 3e3, "share": LEVEL}
    P = (np.arange(600) // 40 % 2).astype(float)
    run = simulate(Network(nodes, laws), {"P": P}, 10.0, 20.0)
    latent = 5000.0 * float(run.nodes[-1, 3])
    assert stored(run) - run.nodes[-1, 3] + latent == pytest.approx(80.0 * P.sum() * 10.0, rel=1e-9)


def test_flows_are_the_rates() -> None:
    network, inputs = every_form()
    run = simulate(network, inputs, 1.0, 20.0)
    into_b = run.flow(lambda law: law.into == "b") - run.flow(lambda law: law.leaves == "b")
    np.testing.assert_allclose(np.diff(run.nodes[:, 1])[5:50], into_b[5:50] / 6e3, atol=2e-5)


def test_a_thermostat_keeps_its_band() -> None:
    laws = (Law("heater", Form.HEAT, "bed", size=300.0, switch="on"), link("air", "bed", "room", 3.0))
    network = Network({"bed": 1.5e3}, laws, {"on": Switch("bed", "target", 1.0, heats=True)})
    run = simulate(network, constant(3000, room=20.0, target=60.0), 1.0, 20.0)
    settled = run["bed"][600:]
    assert 58.7 < settled.min() < 59.0
    assert 61.0 < settled.max() < 61.3
    assert run.switches[600:, 0].mean() == pytest.approx(120.0 / 300.0, abs=0.02)  # what the air takes


def test_a_film_settles_where_it_drains_what_it_is_fed() -> None:
    """flow = drain m^3, and dries by a first-order lag afterwards."""
    laws = film("film", "pump", 1e-3, 0.1, 600.0)
    wet = simulate(Network({"film": LEVEL}, tuple(laws)), constant(500, pump=1.0), 10.0, 20.0)
    m = float(wet.nodes[-1, 0])
    assert pytest.approx(1e-3 / 0.1**3 * m**3 + m / 600.0, rel=1e-6) == 1e-3
    dry = simulate(
        Network({"film": LEVEL}, tuple(laws)), constant(500, pump=0.0), 10.0, State({"film": 1e-3}, {})
    )
    np.testing.assert_allclose(dry.nodes[60, 0] / dry.nodes[0, 0], np.exp(-1.0), rtol=1e-3)


def test_elimination_solves_what_a_dense_solver_solves() -> None:
    """Random networks of links: settled temperatures are those of numpy's solver."""
    rng = np.random.default_rng(0)
    names = [f"n{i}" for i in range(12)]
    pairs = [(int(i), int(j)) for i, j in rng.integers(0, 12, (25, 2)) if i != j]
    laws = [link("joint", names[i], names[j], rng.uniform(1, 9)) for i, j in pairs]
    laws += [link("air", name, "room", 0.5) for name in names] + [
        heat("P", "n3", 50.0),
        heat("P", "n7", 20.0),
    ]
    run = simulate(Network(dict.fromkeys(names, 100.0), tuple(laws)), constant(600, room=20.0), 60.0, 20.0)
    A, b = 0.5 * np.eye(12), np.zeros(12)
    for law, (i, j) in zip(laws, pairs, strict=False):
        A[[i, j], [i, j]] += law.size
        A[i, j] -= law.size
        A[j, i] -= law.size
    b[[3, 7]] = 50.0, 20.0
    np.testing.assert_allclose(run.nodes[-1] - 20.0, np.linalg.solve(A, b), rtol=1e-6)


def test_a_tree_is_eliminated_without_fill() -> None:
    network = Network({f"n{i}": 1.0 for i in range(30)}, ())
    chain = np.array([[0, i, i + 1, i + 1, -1, -1, 0] for i in range(29)], dtype=np.int64)
    order, start, later = elimination(len(network.nodes), chain)
    assert sorted(order) == list(range(30))
    assert np.diff(start).max() == 1
    assert len(later) == 29


def test_palmgren_by_hand() -> None:
    """d_m 100 mm, f_0 2, nu 25 mm2/s, 3000 rpm: 1e-7 * 2 * 75000^(2/3) * 1e6 N mm = 0.3557 Nm."""
    watts = float(palmgren_power(np.array([3000.0]), 100.0)[0])
    assert watts == pytest.approx(0.35569 * 314.159, rel=1e-4)
    assert palmgren_power(np.array([0.0]), 100.0)[0] == 0.0
