"""The known fixture taken out of a record: tare and moving mass from the force, the frame from the displacement."""

from __future__ import annotations

from dataclasses import dataclass

from pzd.quantities import DISPLACEMENT, FORCE, TIME
from pzd.record import Array
from pzd.rig.config import Fixture
from pzd.rig.files.splitting import Test
from pzd.signals.cycles import cycles
from pzd.signals.kinematics import kinematics


@dataclass(frozen=True, eq=False)
class Freed:
    """Displacement and force of the damper alone, and what was taken out."""

    displacement: Array
    force: Array
    said: str
    on_the_damper: bool = True
    """Whether the displacement was recorded on the damper itself, no frame in between."""


def damper_alone(test: Test, fixture: Fixture | None) -> Freed:
    """Displacement and force of the damper alone, of a test behind a fixture; None where nothing is known of one."""
    time, displacement, force = (test.channels[quantity] for quantity in (TIME, DISPLACEMENT, FORCE))
    if fixture is None:
        return Freed(displacement, force, "")
    return free(fixture, time, displacement, force, test.force_sign)


def free(fixture: Fixture, time: Array, displacement: Array, force: Array, sign: int = 1) -> Freed:
    """Displacement and force of the damper alone.

    Equation: F = s (F_cell - F_tare) - m a, x = x_rig - F / k_frame
              Source: equilibrium of the mass, springs in series

    Parameters
    ----------
    fixture : what is known of it
    time : (n,) [s]
    displacement : (n,) as the rig measures it [m]
    force : (n,) as the cell measures it, times its sign: s F_cell [N]
    sign : s, -1 where the cell counts compression positive

    Returns
    -------
    both without the fixture, and a sentence that says so
    """
    said: list[str] = []
    force = force - sign * fixture.tare_N
    if fixture.tare_N:
        said.append(f"tare of {fixture.tare_N:g} N")
    if fixture.mass_kg:
        motion = kinematics(time, displacement, cycles(time, displacement))
        force = force - fixture.mass_kg * motion.acceleration
        said.append(f"inertia of {fixture.mass_kg:g} kg")
    if fixture.stiffness_N_per_m:
        displacement = displacement - force / fixture.stiffness_N_per_m
        said.append(f"give of the frame at {fixture.stiffness_N_per_m:g} N/m")
    return Freed(displacement, force, ", ".join(said), on_the_damper=not fixture.stiffness_N_per_m)
