"""Numbers behind the pictures: the gap of a record, spectra and quantiles of the residual, tests fitted alone."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.cleaned_records import clean
from pzd.diagnosis.fit.prediction import predicted_force
from pzd.record import Array, Record
from pzd.report.damper_models import DamperModels
from pzd.report.drawing import axes, encoded, styled
from pzd.report.plots.gap import held_out_records, record_gap
from pzd.report.plots.residuals import between_cycles, fit_alone, quantiles, spectra

RATE = 500.0


def sine(force: Array, frequency: float = 1.0, name: str = "sine") -> Record:
    """A record of that force in a sine of 20 mm."""
    time, w = np.arange(force.size) / RATE, 2.0 * np.pi * frequency
    x, v = 0.02 * np.sin(w * time), 0.02 * w * np.cos(w * time)
    return Record(name, None, time, x, v, -(w**2) * x, force, np.zeros(force.size))


def context_of(*records: Record, baseline: Array | float = 0.0, final: Array | float = 0.0) -> Any:
    """A context of some records and of the forces that its two dampers give in each of them."""
    damper = DamperModels(None, ())  # type: ignore[arg-type]  # forces are given, nothing is simulated
    for record in records:
        still = np.zeros(record.force.size)
        damper._forces[record.name] = (still + baseline, still + final)
    tests = SimpleNamespace(
        sampled=records, records=records, level=lambda _: 0.0, labels=lambda of: [record.name for record in of]
    )
    return SimpleNamespace(tests=tests, damper=damper, identified=SimpleNamespace(measures=()))


def test_a_force_that_differs_only_until_the_motion_has_turned_leaves_no_gap() -> None:
    time = np.arange(2000) / RATE
    force = 1000.0 * np.sign(np.cos(2.0 * np.pi * time))
    begun_elsewhere = np.where(time < 0.1, 0.0, force)
    record = sine(force)
    context = context_of(record, baseline=0.9 * force, final=begun_elsewhere)
    assert record_gap(context, record) == pytest.approx((0.01, 0.0), abs=1e-12)


def test_the_force_drawn_is_the_one_judged(rng: np.random.Generator) -> None:
    """Noise of 10 um through an oil spring of 3e6 N/m is a force of 30 N, which diagnose does not judge."""
    damper = Damper(base=(BaseRow(T0_N=300.0, C_Ns_per_m=1000.0, k_N_per_m=3e6),))
    still = sine(np.zeros(6000), frequency=2.0)
    truth = respond(damper, Motion.of(still), 0.0)
    noisy = still.displacement + 1e-5 * rng.standard_normal(still.time.size)
    velocity = np.gradient(noisy, still.time)
    recorded = replace(
        still, displacement=noisy, velocity=velocity, acceleration=np.gradient(velocity, still.time),
        force=truth + 2.0 * rng.standard_normal(truth.size),
    )  # fmt: skip
    diagnosed = SimpleNamespace(baseline=damper, damper=damper)
    drawn, _ = DamperModels(diagnosed, ()).simulated(recorded)  # type: ignore[arg-type]  # two dampers are all it asks
    (part,) = clean((recorded,))
    inside = np.isin(recorded.time, part.record.time)
    np.testing.assert_array_equal(drawn[inside], predicted_force(damper, part))
    assert np.std((drawn - truth)[500:-500]) < 5.0


def test_the_band_of_a_harmonic_holds_its_power() -> None:
    """A harmonic of 10 N at 3 Hz has 7.07 N in the band about 3 Hz, and half of it after diagnose."""
    force = 10.0 * np.sin(2.0 * np.pi * 3.0 * np.arange(8000) / RATE)
    record = sine(force)
    middles, before, after, _ = spectra(context_of(record, final=0.5 * force), [record])
    band = int(np.argmax(before))
    assert 2.6 < middles[band] < 3.4
    assert before[band] == pytest.approx(10.0 / np.sqrt(2.0), rel=0.02)
    assert np.sum(before**2) == pytest.approx(50.0, rel=0.01)
    assert after == pytest.approx(0.5 * before)


def test_what_repeats_is_no_noise_and_what_does_not_is_all_noise(rng: np.random.Generator) -> None:
    time = np.arange(8000) / RATE
    repeats = 10.0 * np.sin(2.0 * np.pi * 3.0 * time)
    noise = 4.0 * rng.standard_normal(time.size)
    displacement = 0.02 * np.sin(2.0 * np.pi * time)
    assert np.std(between_cycles(time, displacement, repeats)) < 0.01
    assert np.std(between_cycles(time, displacement, repeats + noise)) == pytest.approx(4.0, rel=0.05)
    assert between_cycles(time, np.cumsum(rng.standard_normal(time.size)), noise) is None


def test_quantiles_of_noise_lie_on_the_line_and_rare_large_residuals_leave_it(rng: np.random.Generator) -> None:
    noise = rng.standard_normal(20_000)
    normal, found = quantiles(context_of(sine(noise)), 0)
    assert np.max(np.abs(found - normal)) < 0.2
    jumps = np.where(rng.random(noise.size) < 0.02, 10.0, 1.0) * noise
    normal, found = quantiles(context_of(sine(jumps)), 0)
    assert found[-1] > 1.1 * normal[-1]
    assert found[-10] < 0.8 * normal[-10]


def test_each_test_fitted_alone_has_its_own_friction() -> None:
    """T0 that rises from test to test by a tenth, as an oil that cools or a stand that drifts would show it."""
    records = []
    for number in range(5):
        still = sine(np.zeros(1500), name=f"test {number}")
        row = BaseRow(T0_N=300.0 * 1.1**number, C_Ns_per_m=2700.0, k_N_per_m=2e5)
        records.append(sine(respond(Damper(base=(row,)), Motion.of(still)), name=still.name))
    found = fit_alone(context_of(*records))
    assert [test.over["order of the files"] for test in found] == [1.0, 2.0, 3.0, 4.0, 5.0]
    assert [test.row.T0_N for test in found] == pytest.approx(list(300.0 * 1.1 ** np.arange(5)), rel=0.01)


def test_names_of_sixty_letters_leave_room_for_the_plot_and_stay_apart() -> None:
    """A label as wide as the page gave axes of a negative width, and the report ended with a fault."""
    stems = [f"damper_12_after_endurance_run_at_the_second_stand_of_plant_{n}" for n in (1, 2, 3)]
    force = 1000.0 * np.sign(np.cos(2.0 * np.pi * np.arange(2000) / RATE))
    records = [sine(force, name=stem) for stem in stems]
    context = context_of(*records, baseline=0.9 * force, final=force)
    context.damper = SimpleNamespace(extended=True, residuals=context.damper.residuals)
    context.diagnosed = SimpleNamespace(diagnosis=SimpleNamespace(gap=SimpleNamespace(held_out=stems)))
    (panel,) = held_out_records(context)
    (ax,) = panel.figure.axes
    shown = [label.get_text() for label in ax.get_yticklabels()]
    assert len(set(shown)) == 3
    assert all(label.startswith("damper_12_") and label[-1] in "123" for label in shown)
    assert ax.get_position().width > 0.3
    assert encoded(panel).source.startswith("data:image/svg+xml")


@pytest.mark.parametrize("name", ["0", "cycles 1-20", "damper_12_after_endurance_run_one"])
def test_names_of_states_below_an_axis_and_its_label_lie_within_the_picture(name: str) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    with styled():
        figure, ax = axes("state", "T0 [N]", slanted=(name, name, name))
        ax.plot(range(3), range(3))
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        words = [*ax.get_xticklabels(), ax.xaxis.label]
        boxes = [word.get_window_extent(canvas.get_renderer()) for word in words]
        width, height = canvas.get_width_height()
    assert all(b.x0 >= 0.0 and b.y0 >= 0.0 and b.x1 <= width and b.y1 <= height for b in boxes)
