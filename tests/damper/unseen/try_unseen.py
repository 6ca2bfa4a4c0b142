"""Put effects through all that an effect acts on: run by test_unseen_effects.py in a copy of pzd that holds them.

python try_unseen.py acts         what each changes, and how well it is solved, as JSON
python try_unseen.py named NAME   a benchmark case that hides one effect, and what the diagnosis says of it
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from pzd.artefacts import Diagnosed, ForceRow, Table, TableNotes
from pzd.blind.benchmark import Methods, diagnose_case
from pzd.blind.case import COST, CaseFiles
from pzd.blind.hide import BenchmarkSetup, hide
from pzd.blind.plan import PlannedCase, hideable
from pzd.config import load
from pzd.damper.compose import respond, steady_force
from pzd.damper.effects import library
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.rig.stand.frame import force_in_frame
from pzd.simulate.config import SimulateConfig
from pzd.simulate.stage import simulate

VALUES = {
    "choked_port": {"q": 8000.0},
    "hardening_spring": {"c": 2.0e4},
    "slew_limit": {"R": 800.0},
    "detent": {"F_d": 80.0},
    "dahl_friction": {"F_c": 120.0},
}
PLAIN = Damper(
    base=(
        BaseRow(voltage_V=0.0, T0_N=300.0, C_Ns_per_m=2700.0, k_N_per_m=2e5),
        BaseRow(voltage_V=150.0, T0_N=1300.0, C_Ns_per_m=2500.0, k_N_per_m=4e5),
    )
)
TIME = np.arange(600) * 1e-3
OMEGA = 2.0 * np.pi * 3.0
X, V, A = 0.02 * np.sin(OMEGA * TIME), 0.02 * OMEGA * np.cos(OMEGA * TIME), -0.02 * OMEGA**2 * np.sin(OMEGA * TIME)
MOVING = 75.0 + 60.0 * np.sin(2.0 * np.pi * 6.0 * TIME)
MOTION = Motion(TIME, X, V, A, MOVING)
FRAME = 2.0e6


def independent(name: str, frame: float | None = None) -> np.ndarray:
    """Force by a solver of another kind, from the laws written out by hand."""
    values = VALUES[name]
    q, c, F_d = values.get("q", 0.0), values.get("c", 0.0), values.get("F_d", 0.0)
    F_c = values.get("F_c", 0.0)

    def speed(force: float, T0: float, C: float) -> float:
        over = max(abs(force) - T0, 0.0)
        w = over / C
        if q and w > 0.15:  # q d^2 + C d = over - 0.15 C, d = w - 0.15
            w = 0.15 + 2.0 * (over - 0.15 * C) / (C + np.sqrt(C * C + 4.0 * q * (over - 0.15 * C)))
        return float(np.copysign(w, force))

    def deflection(total: float, k: float) -> float:
        """Return the part of a deflection that the oil stiffness has, which shares it with a linear frame."""
        if frame is None:
            return total
        e = total
        for _ in range(50):
            e -= (e + k * (e + c * e**3) / frame - total) / (1.0 + k * (1.0 + 3.0 * c * e * e) / frame)
        return e

    voltage = MOVING if name != "slew_limit" else None

    def parameters(t: float) -> tuple[float, float, float]:
        share = (effective(t) if voltage is None else np.interp(t, TIME, voltage)) / 150.0
        return 300.0 + 1000.0 * share, 2700.0 - 200.0 * share, 2e5 + 2e5 * share

    def effective(t: float) -> float:
        return float(np.interp(t, FINE, SLEWED))

    def force(t: float, e: float) -> float:
        e = deflection(e, parameters(t)[2])
        return parameters(t)[2] * (e + c * e**3)

    def rate(t: float, e: np.ndarray) -> list[float]:
        T0, C, _ = parameters(t)
        v = OMEGA * 0.02 * np.cos(OMEGA * t)
        return [v - speed(force(t, e[0]), T0, C), (v * F_c - e[1] * abs(v)) / 5e-4]

    run = solve_ivp(rate, (0.0, TIME[-1]), [0.0, 0.0], "RK45", TIME, rtol=1e-8, atol=1e-12, max_step=2.5e-4)
    found = np.array([force(t, e) for t, e in zip(TIME, run.y[0], strict=True)]) + run.y[1]
    return found + F_d * np.sin(2.0 * np.pi * X / 0.015)


def slewed() -> tuple[np.ndarray, np.ndarray]:
    """The voltage behind a supply that is limited to 800 V/s, in steps a twentieth as long."""
    fine = np.arange(600 * 20) * 5e-5
    given = np.interp(fine, TIME, MOVING)
    out = [given[0]]
    for now in given[1:]:
        out.append(out[-1] + float(np.clip(now - out[-1], -800.0 * 5e-5, 800.0 * 5e-5)))
    return fine, np.array(out)


FINE, SLEWED = slewed()


def ridden(damper: Damper) -> tuple[np.ndarray, float]:
    """Largest acceleration and energy error of every ride on a damper."""
    rows = tuple(
        ForceRow(temperature_degC=None, voltage_V=u, velocity_m_per_s=v, force_N=force, inside=1)
        for u in (0.0, 150.0)
        for v in (-1.0, -0.3, -0.0, 0.0, 0.3, 1.0)
        for force in [float(steady_force(damper, u, None, v))]
    )
    table = Table(rows, (), TableNotes(outside="model", reached_m_per_s=1.0, lost=(), not_monotone=()))
    settings = SimulateConfig.model_validate({"duration_s": 3.0, "settle_s": 0.1, "fidelities": ("dynamic",)})
    summary = simulate(settings, Diagnosed.undiagnosed(damper), table, 1, Path()).summary
    return np.array([row.peak_abs_aK_m_per_s2 for row in summary]), max(abs(row.energy_error) for row in summary)


def plain_force() -> dict[str, float]:
    """Sum and peak of the plain damper's force, to the last bit."""
    force = respond(PLAIN, MOTION)
    return {"sum": float(np.sum(force)), "peak": float(np.max(force))}


def acts() -> dict[str, dict[str, float]]:
    """What each effect changes, as shares of the plain damper's."""
    speeds = np.linspace(-0.6, 0.6, 13)
    plain, framed, steady = (
        respond(PLAIN, MOTION),
        force_in_frame(PLAIN, MOTION, FRAME),
        steady_force(PLAIN, 50.0, None, speeds),
    )
    rides, _ = ridden(PLAIN)
    found = {"plain": plain_force()}
    for name, values in VALUES.items():
        damper = PLAIN.with_effect(name, values)
        force, behind = respond(damper, MOTION), force_in_frame(damper, MOTION, FRAME)
        ride, energy = ridden(damper)
        truth = independent(name)
        found[name] = {
            "stand": float(np.max(np.abs(force - plain)) / np.max(np.abs(plain))),
            "frame": float(np.max(np.abs(behind - framed)) / np.max(np.abs(framed))),
            "steady": float(np.max(np.abs(steady_force(damper, 50.0, None, speeds) - steady)) / np.max(steady)),
            "ride": float(np.max(np.abs(ride - rides) / rides)),
            "energy": energy,
            "error": float(np.max(np.abs(force - truth)) / np.max(np.abs(truth))),
        }
        if name == "hardening_spring":
            truth = independent(name, FRAME)
            found[name]["frame_error"] = float(np.max(np.abs(behind - truth)) / np.max(np.abs(truth)))
    return found


CONFIG = """
rig:
  virtual:
    - damper:
        base:
          - {voltage_V: 0, T0_N: 301, C_Ns_per_m: 2720, k_N_per_m: 199000}
          - {voltage_V: 150, T0_N: 1325, C_Ns_per_m: 2560, k_N_per_m: 423000}
      voltages_V: [0, 150]
      rate_Hz: 500
      tests: [{waveform: {kind: sine, frequency_Hz: 1, amplitude_m: 0.02}}]
blind:
  seed: 5
  tuned_on: [1]
  base_spread: 0.1  # an oil spring that bends shows where the oil gives way
  sizes: [0.1, 0.1]
  force_noise: [0.005]
  noise_rho: [0.5]
  displacement_noise_m: [1.0e-6, 1.1e-6]
  warming_share: 0
  campaigns:
    - name: all
      tests:
        - {waveform: {kind: sine, frequency_Hz: 1, amplitude_m: 0.015}, cycles: 6}
        - {waveform: {kind: sine, frequency_Hz: 1, amplitude_m: 0.03}, cycles: 6}
        - {waveform: {kind: sine, frequency_Hz: 2.5, amplitude_m: 0.01}, cycles: 8}
        - {waveform: {kind: sine, frequency_Hz: 2.5, amplitude_m: 0.02}, cycles: 8}
        - waveform: {kind: sine, frequency_Hz: 1.3, amplitude_m: 0.025}
          cycles: 8
          voltages_V: [{kind: steps, voltages_V: [0, 150], dwell_s: 0.37}]
        - waveform: {kind: sine, frequency_Hz: 2.3, amplitude_m: 0.015}
          cycles: 12
          voltages_V: [{kind: steps, voltages_V: [0, 150], dwell_s: 0.23}]
"""


def named(name: str) -> dict[str, object]:
    """What was hidden, and what the diagnosis says of it."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "unseen.yaml"
        path.write_text(CONFIG, encoding="utf-8")
        config = load(path, ())
        setup = BenchmarkSetup(config.blind, config.rig.virtual[0], config.diagnose.nuisance, config.control.signal())
        places, planned = CaseFiles(Path(folder)), PlannedCase(0, "single", "all", (name,))
        hide(setup, planned, places)
        methods = Methods(config.identify, config.diagnose, config.rig.limits, setup.control, config.seed)
        diagnose_case(methods, places.case(planned.id))
        truth = json.loads(places.truth(planned.id).read_text(encoding="utf-8"))
        cost = json.loads((places.case(planned.id) / COST).read_text(encoding="utf-8"))
        diagnosis = json.loads((places.case(planned.id) / "diagnosis.json").read_text(encoding="utf-8"))
        return {
            "hideable": (name,) in hideable(setup.campaign("all"), "single"),
            "listed": name in library(),
            "size": truth["sizes"][name],
            "hidden": truth["damper"]["effects"][name],
            "failure": cost["failure"],
            "verdict": diagnosis["verdict"],
            "effects": diagnosis["effects"],
            "rivals": diagnosis["rivals"],
            "reason": diagnosis.get("reason"),
            "parameters": diagnosis["parameters"].get(name),
        }


if __name__ == "__main__":
    sys.stdout.write(json.dumps(acts() if sys.argv[1] == "acts" else named(sys.argv[2])))
