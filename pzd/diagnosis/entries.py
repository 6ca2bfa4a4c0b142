"""What diagnose writes of a selection: ranking, parameters with 95 % intervals, and the gap on held-out samples."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pzd.artefacts import (
    Gap,
    ParameterRow,
    Ranked,
    Value,
)
from pzd.artefacts.diagnosis import Verdict
from pzd.damper.effect import NODE_VOLTAGES, Parameter
from pzd.damper.effects import library
from pzd.damper.effects.accumulator import EXPONENTS, other_gas
from pzd.damper.model import Damper
from pzd.diagnosis.campaign import Evidence
from pzd.diagnosis.cross_validation import CrossValidation
from pzd.diagnosis.fit.least_squares import base_half_widths, plain_fit, refit, standard_errors
from pzd.diagnosis.gap import held_out_criterion
from pzd.diagnosis.roles import TRAINING
from pzd.diagnosis.search.acceptance import Selection
from pzd.fit.intervals import LEVEL
from pzd.identification.bingham_fit import Bingham
from pzd.identification.condition import misses, parameter_row
from pzd.identification.trust import (
    NOT_CONVERGED,
    OF_THE_MODEL,
    PARAMETER_NAMES,
    ParameterEvidence,
    parameter_scales,
    stiffness_veto,
)
from pzd.quantities import Control
from pzd.signals.measures import rms


def ranking_of(selection: Selection, evidence: Evidence) -> tuple[Ranked, ...]:
    """List every candidate at the step that decided on it, best first, adopted ones in front, as they are handed on.

    `gap_after` is criterion (4) on the samples seen, the tests' nuisances left in; its standard error is that of the
    scatter between tests.
    """
    rows: dict[str, Ranked] = {}
    for step in selection.steps:
        for c in step.tried:
            if step.tried is not selection.deciding(c.effect):
                continue
            reason = "does not pay" if c.delta_bic > 0.0 else "explains less"
            reason = selection.reasons.get(c.effect, reason if c.searched else "promises too little to be searched for")
            # A later step, an exchange or the last descent moved what was adopted from where its own step left it.
            damper = (selection.fitted if c.effect in selection.adopted else c.fitted).damper
            values: dict[str, Any] = dict(damper.effects[c.effect])
            left, error = evidence.criterion(damper)
            rows[c.effect] = Ranked(
                effect=c.effect,
                gap_after=left,
                gap_standard_error=error,
                delta_bic=round(c.delta_bic, 3),
                at_voltage_V=values.pop(NODE_VOLTAGES, None),
                parameters=values,
                reason="rival" if c.effect in selection.rivals else reason,
            )
    # Candidates that explain nothing tie but for rounding, which differs between machines: there the name decides.
    return tuple(sorted(rows.values(), key=lambda r: (r.effect not in selection.adopted, round(r.delta_bic), r.effect)))


def parameters_of(selection: Selection, control: Control) -> dict[str, dict[str, Value]]:
    """Return the parameters of the adopted effects with 95 % intervals, in units of this control signal."""
    damper, errors = selection.fitted.damper, standard_errors(selection.fitted)
    found: dict[str, dict[str, Value]] = {}
    for name in selection.adopted:
        nodes = damper.effects[name].get(NODE_VOLTAGES)
        for parameter in library()[name].parameters:
            mine = [
                (u.value_in(damper), float(error))
                for u, error in zip(selection.fitted.unknowns, errors, strict=True)
                if (u.effect, u.parameter.name) == (name, parameter.name)
            ]
            found.setdefault(name, {})[parameter.name] = _value(mine, parameter, nodes, control)
    for (name, parameter_name), sign in CONSTANT_FORCES.items():
        if name in found:
            found[name][parameter_name] = _of_seal_or_valve(found[name][parameter_name], damper, sign)
    if {"accumulator", "preload_offset"} <= found.keys():
        found["accumulator"], found["preload_offset"] = _of_any_gas(found["accumulator"], found["preload_offset"])
    return found


def may_be_none(selection: Selection, control: Control) -> list[str]:
    """Return the adopted effects whose strength, the first parameter, may be none by the interval that is told."""
    strengths = {name: library()[name].parameters[0] for name in selection.adopted}
    found = parameters_of(selection, control)
    return [name for name, p in strengths.items() if found[name][p.name].may_be(p.neutral)]


def _of_any_gas(gas: dict[str, Value], preload: dict[str, Value]) -> tuple[dict[str, Value], dict[str, Value]]:
    """Return a gas and the preload beside it with intervals that hold those of a gas of any exponent.

    What is constant of the one the other takes up: these tests tell no exponent.
    """
    force, length, beside = gas["F_g"], gas["L"], preload["F_0"]
    if not (isinstance(force.value, float) and isinstance(length.value, float) and isinstance(beside.value, float)):
        return gas, preload
    factors = [(1.0, 1.0), *(other_gas(exponent) for exponent in EXPONENTS)]
    of_force = [(factor - 1.0) * force.value for factor, _ in factors]
    of_length = [(factor - 1.0) * length.value for _, factor in factors]
    return (
        {"F_g": _widened(force, of_force), "L": _widened(length, of_length)},
        {"F_0": _widened(beside, of_force)},
    )


def _widened(value: Value, moves: Sequence[float]) -> Value:
    """Return a value with an interval that holds itself moved by each of some amounts."""
    low, high = value.low95, value.high95
    if not (isinstance(low, float) and isinstance(high, float)):
        return value
    return value.model_copy(update={"low95": low + min(moves), "high95": high + max(moves)})


CONSTANT_FORCES = {("preload_offset", "F_0"): 1.0, ("accumulator", "F_g"): -1.0}
"""Forces that do not change with the motion, by effect and parameter, with their sign in the force of the damper."""


def _of_seal_or_valve(value: Value, damper: Damper, sign: float) -> Value:
    """Return a constant force with an interval that holds it also where the friction is the other kind.

    A friction T0 (1 + alpha sign F) has a mean of alpha T0, which one the same both ways, as of a seal, leaves to the
    constant force: at one T0 no test tells them apart.
    """
    uneven = damper.effects.get("asymmetry", {}).get("alpha", 0.0)
    even = damper.effects.get("viscous_asymmetry", {}).get("alpha_C", 0.0)
    if not (isinstance(uneven, float) and isinstance(even, float)):
        return value
    return _widened(value, (0.0, sign * (uneven - even) * min(row.T0_N for row in damper.base)))


def _value(
    estimates: Sequence[tuple[float, float]],
    parameter: Parameter,
    nodes: float | tuple[float, ...] | None,
    control: Control,
) -> Value:
    """Return a parameter with its 95 % interval clipped to its limits.

    Parameters
    ----------
    estimates : value and standard error, one per voltage or a single one
    parameter : its unit and limits
    nodes : the voltages [V]; None for a single value
    control : whose unit stands in the place of V
    """
    unit = control.own_unit(parameter.unit)
    middle = tuple(value for value, _ in estimates)
    low = tuple(max(value - LEVEL * error, parameter.low) for value, error in estimates)
    high = tuple(min(value + LEVEL * error, parameter.high) for value, error in estimates)
    if not isinstance(nodes, tuple):
        return Value(value=middle[0], low95=low[0], high95=high[0], unit=unit)
    return Value(value=middle, low95=low, high95=high, unit=unit, at_voltage_V=nodes)


DOUBTS: dict[Verdict, str] = {
    "unexplained": f"something is still missed: {OF_THE_MODEL}",
    "ambiguous": "a rival effect would leave other values",
}
"""Why no row is `ok` under a verdict."""
SHOWN = 1.0
"""Share of the force that a parameter moves, for its status: what the tests do not show has a wide interval here."""


def base_parameters(selection: Selection, verdict: Verdict, setting: str | None) -> tuple[ParameterRow, ...]:
    """Return T0, C and k fitted with the effects, judged by their 95 % intervals as identify judges its own.

    An interval allows for noise, for the sensors' priors, and for how far the tests disagree; it holds the damper's own
    parameters where the adopted effects are all that there is.

    Parameters
    ----------
    selection : effects adopted
    verdict : of the diagnosis
    setting : of the rig's settings, the one in use
    """
    fitted, whole = selection.fitted, selection.final_evidence.whole
    compared = [(o.base_row, o.measured, f) for o, f in zip(whole.observations, fitted.simulated, strict=True)]
    rows = []
    doubt = DOUBTS.get(verdict) if fitted.converged else NOT_CONVERGED
    half_widths = base_half_widths(fitted, whole.coordinates)
    for place, (row, widths) in enumerate(zip(fitted.damper.base, half_widths, strict=True)):
        mine = [(m, f) for at, m, f in compared if at == place] or [(m, f) for _, m, f in compared]
        measured = np.concatenate([m for m, _ in mine])
        residuals = measured - np.concatenate([f for _, f in mine])
        parameters = Bingham(row.T0_N, row.C_Ns_per_m, row.k_N_per_m)
        scales = parameter_scales(parameters, widths, rms(measured), whole.scales.speed).tolist()
        stiffest = 1.0 / (scales[2] + float(widths[2])) if scales[2] <= widths[2] else np.inf
        evidence = [
            ParameterEvidence(name, scale, width, width, SHOWN, veto, doubt)
            for name, scale, width, veto in zip(
                PARAMETER_NAMES, scales, widths.tolist(), (None, None, stiffness_veto(stiffest)), strict=True
            )
        ]
        labels = (setting, row.voltage_V, row.temperature_degC)
        rows.append(parameter_row(labels, parameters, widths, evidence, misses(residuals, measured), stiffest))
    return tuple(rows)


def held_out_gap(selection: Selection, validation: CrossValidation | None = None, plain: Evidence | None = None) -> Gap:
    """Compute criterion (4) on the held-out samples before and after, with nuisances at their prior mean.

    Both dampers are fitted to the training samples alone.

    Parameters
    ----------
    selection : effects adopted, and the evidence whose first half trains
    validation : the tests, where the adopted damper is fitted by criterion (4); None where it is by likelihood
    plain : evidence for the fit of the simple model, where the selection is beside another law
    """
    campaign, training = selection.initial_evidence.campaign, (plain or selection.initial_evidence).halves[0]
    baseline = plain_fit(training).damper
    before = held_out_criterion(campaign.held_out_checks(baseline), campaign.split)
    if not selection.adopted:
        return before
    not_training = [~mask for mask in campaign.in_role(TRAINING)]
    found = None if validation is None else validation.fit_by_criterion(selection.fitted.damper, not_training)
    training = selection.final_evidence.halves[0]
    adopted = found[1] if found else refit(training, selection.fitted.damper)
    after = held_out_criterion(campaign.held_out_checks(adopted.damper), campaign.split)
    return after.model_copy(update={"before": before.before})
