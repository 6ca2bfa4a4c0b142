"""The car of Makowski and Knap 2021, section 5.

Mass and springs are the paper's. It leaves a1, a2, J_y and x_K out: these were chosen so that the
peaks of Figure 19 come near (wheelbase 2.96 m, J_y / (m a1 a2) = 0.80, K beside the driver).
"""

from pzd.simulate.vehicle.car import HalfCar

CAR = HalfCar(
    name="makowski2021",
    mass=1200.0,
    pitch_inertia=2005.0,
    distances=(1.794, 1.161),
    stiffnesses=(47500.0, 47500.0),
    comfort_point=-0.833,
)
