"""Fixed thresholds by which an effect is tried, adopted, refused or removed, and a verdict reached.

The thresholds that a user may change are fields of `DiagnoseConfig` with defaults of their own: `significance`,
`visible`, `negligible`, `unexplained_share`, `adopt_bic`, `rival_bic`, `most_effects` and `most_added`. These here are
fixed. Each says what it decides, then why it has this value. "Benchmark" is `pzd blind` on configs/blind.yaml: 1500
cases with a hidden effect, with none, or with one that is not in the library. "Not tuned" is a round number that no
case is known to depend on; `make sensitivity` prints what halving and doubling each of them changes.
"""

from __future__ import annotations

from pzd.signals.measures import VISIBLE

# --- Which effects are tried, and how far each is searched (search/candidates.py)

FIRST_EVALUATIONS = 6
"""Evaluations after which the candidates are compared for the first time; the better ones are searched on.

Reason: time. What is still far from its optimum then is kept by the margin of `SHARE_WORTH_SEARCHING`; not tuned."""
SHARE_WORTH_SEARCHING = 0.5
"""Share of the best improvement of the criterion below which a candidate is not searched on.

Reason: time; not tuned."""
MOST_EVALUATIONS_OF_BEST = 100
"""Evaluations after which the search for the chosen optimum ends.

Reason: five times those of any other fit; not tuned."""
NEARLY_AS_GOOD = 0.95
"""Share of the chosen improvement from which other candidates are searched to their optimum as well.

Reason: two effects that explain the same have to be compared at their optima, or the one searched longer wins."""
STARTS_TRIED = 2
"""Starting values tried before smaller ones.

Reason: time. The starts are sorted by what a linearised step promises; not tuned."""
SMALLER_STARTS = (0.3, 0.1, 0.03, 0.01)
"""Shares of the way from no effect to the most promising starting values, tried where the search got stuck.

Reason: in half decades down to a hundredth, below which an effect at its usual size is not visible."""
STUCK_MISFIT = 1.0
"""Excess misfit [squares of noise] over a nested model from which a search counts as stuck.

Reason: at its optimum a model is never worse than one that it contains; one square of noise is far below what
`adopt_bic` asks for."""
COMPLIANCES_TRIED = (1.0, 3.0, 5.0)
"""Coordinates of 1/k [see `pzd.fit.element_coordinates`] from which a softer oil spring is searched.

Reason: it gives by 1e-5, 1e-4 and 7e-4 of the stroke, a flank of less than a sample, of one or two, and of several."""
SEARCH_LIMIT_MARGIN = 0.01
"""Distance from a limit within which a search variable counts as ending at it.

Reason: 1 % of a parameter that is searched by its logarithm; not tuned."""
LINEARISED_SHARE = 0.1
"""Share of the way to its starting values at which an effect that noise nearly hides is linearised.

Reason: there a law is still nearly linear in its parameter; the starting values themselves are tried beside it."""
LINEARISED_FROM_ZERO = 0.01
"""Share of its scale at which an effect that starts from zero is linearised.

Reason: a hundredth of the largest force, or of its like, where such effects are linear in their parameter."""
LEAST_DROP_IN_NOISE = 15.0
"""Promised drop of the misfit below which an effect is not fitted where noise explains what is left.

Reason: to pay it must lower the misfit by -`adopt_bic` + ln n, twice this; a linearised promise is not exact."""
LEAST_DROP_IN_GAP = 3.0
"""Promised drop of the misfit below which an effect is not fitted where a gap is left.

Reason: a fifth of `LEAST_DROP_IN_NOISE`. Of 24 cases of the benchmark (seed 1) the searches that were promised least
reached 4.5 (relief_valve) and 4.7 times (sensor_delay) what was promised."""
SHARE_WORTH_FITTING = 0.02
"""Share of the best promised drop below which an effect is not fitted.

Reason: at five times its promise it would still pay a tenth of the best, and no rival does that; not tuned."""

# --- When an effect is accepted (search/acceptance.py)

LEAST_CLOSED = 0.2
"""Share of the gap (mean square) that an effect must close, each test counted by its own peak or all by force.

Reason: what is real is not one of many small corrections. Tests of small force may keep a gap of another kind, as those
at 0 A of configs/utfpr.yaml do, and would hide what the others show: hence the two counts."""
ROWS_INSTEAD = 0.5
"""Share of what a drift with the temperature leaves below which T0, C and k at each temperature take its place.

Reason: rows have more numbers and leave less in any case; half of it no number more does by chance."""
TRIVIAL_SIZE = {("preload_offset", "F_0"): 0.01, ("sensor_delay", "tau"): 1e-3, ("valve_lag", "tau"): 1e-3}
"""Common offset [share of the lowest peak], delay or lag [s] below which it counts as nothing missing.

Reason: twice the prior of a test's own offset and delay (`NuisanceConfig`): what is smaller may be the rig's."""
NUISANCE_EFFECTS = frozenset(effect for effect, _ in TRIVIAL_SIZE)
"""Effects of which each test may have a little for itself."""
SAME_FORCE = 1e-3
"""Share of what an effect does to the residuals (sum of squares), below which the difference of another law with more
parameters counts as none.

Reason: 3 % as r.m.s.: a law comes so near another one in its limit alone. Where noise makes an effect of its own size
uncertain, two laws that it does not tell apart differ by more. Not tuned."""
LIMIT_CASE = 0.02
"""Share, as a mean square, by which an adopted effect's force may differ from that of a law with fewer parameters:
it is then a rival, whatever the likelihood says.

Reason: 14 % as r.m.s., about what the smoothing of a displacement makes of the corner of a play: 1 % in a swept test
whose lash passed for a hardening frame."""
LAW_ERROR = 0.05
"""Share of the gap, as a mean square, by which the law of a real effect may depart from the library's.

Reason: 22 % as r.m.s.: soft knees of valves, other roots for a rounded yield and rubber on the faces of a play left
1 to 4 % for a second law of the same place (five rigs by a simulator of other authorship)."""
LAGS_TRIED = (0.01, 0.03, 0.1)
"""C/k of the oil spring behind a branch that takes the friction over, as shares of stroke over speed.

Reason: a fit gives a friction that turns at once a spring that is far too stiff, whatever that of the oil; each of
these is within a factor of two of every lag between."""
GIVES_TRIED = (1e-4, 1e-2)
"""Way of such a branch until it slips, as shares of the stroke.

Reason: of a seal that turns at once, and of one that gives by a tenth of a millimetre; not tuned."""
END_STOP_BEGINS = 0.4
"""Share of the half stroke about its middle within which no end stop begins.

Reason: stops act over the last 10 to 30 % of the stroke, a soft rubber one over half of it."""
END_STOP_BEGINS_BY = 0.95
"""Largest displacement at which an end stop begins, as a share of half the stroke of the tests.

Reason: on the last twentieth alone every law of a reversal acts, such as the rise of a friction at rest: a stop stood
in for that, and "moved" with the amplitude of the test. Not tuned."""
LONE_END_STOP_BEGINS_BY = 0.9
"""The same where one motion alone reaches the stop.

Reason: a friction that gives by a twentieth of the stroke before it slips looks like such a stop."""
OTHER_MOTION = 0.05
"""Difference of amplitude or peak speed, as a share, from which two motions are not one.

Reason: far above how well a stand repeats a motion; not tuned."""
HALVES_SIGNIFICANCE = 0.001
"""Probability by chance below which halves of the tests disagree about a parameter.

Reason: the level of `significance`; the limit on the misfit is twice the quantile of chi-square, for two halves."""
HALVES_LOSS = 0.05
"""The two halves of the tests agree where the parameters fitted to one raise the misfit of the other by less than this
share of what the effect explains in all.

Reason: of a parameter that enters linearly a fifth of its value; an effect that explains much tells halves apart by
what gains and clocks of a stand make of it. Not tuned."""
HALVES_ALIKE = 0.1
"""Ratio within which values from either half agree, whatever their intervals.

Reason: the intervals of quiet tests are narrower than what the gains of a rig make of a parameter; not tuned."""

# --- When an optimum or an effect is given up (search/forward_selection.py, cross_validation.py)

LARGEST_GAP_GROWTH = 1.1
"""Factor by which an optimum may widen the gap over where its search began.

Reason: weights by noise may bend a fit away from the force; up to 10 % is the play of rounding. Not tuned."""
CONVERGED_CHANGE = 0.2
"""Change of a parameter, as a share of its standard error, below which reweighting ends.

Reason: it widens an interval by 2 % (root of 1 + 0.2^2), less than anything the intervals promise."""
MOST_REWEIGHTINGS = 5
"""Times that the tests are reweighted at the end, at most.

Reason: time; what swings between two optima would never end."""

MUCH_WORSE = 1.5
"""Ratio of W_s to the baseline's from which a damper with effects is refused: at a left-out voltage, or in any held-out
test where the gap has no name.

Reason: of a left-out voltage, the line between voltages misses more than any law, and with a true law, when T0 and C
become those of the damper, it may miss a little more than without; nor do the tests of one voltage, which all miss the
same, tell chance. 7 % more was seen with a true name, 2.9 times with a wrong one; not tuned. Of a test, beyond what its
own offset, gain and delay usually do."""

NEAR_LIMIT = 0.1
"""Distance from a limit of the search, in standard errors, within which a parameter ends at it.

Reason: so near, the tests do not tell the value from the limit; not tuned."""
NEAREST_LIMIT = 1e-3
"""Distance from a limit of the search that counts as at it whatever the error.

Reason: a thousandth of the scale of a parameter, or of its ratio; a search stays inside its limits. Not tuned."""
CANCELLED_SHARE = 0.1
"""Share of the smaller of two forces below which their sum counts as cancelled.

Reason: an error of a tenth in either is then as large as what both do together; not tuned."""

CONSTANT_WITHIN = 0.15
"""Standard deviation of a strength from test to test, as a share of it, up to which it counts as a constant.

Reason: what a further effect of `visible` size does to one of 2 % of peak in single tests; not tuned."""

# --- Which tests are held out together (cross_validation.py)

MORE_RESISTANCE = 0.1
"""Share by which T0 and C are raised to see whether a test shows them.

Reason: a test that is pulled harder than T0 by less hardly tells it; not tuned."""
RESISTANCE_SHOWN = VISIBLE
"""Change of the force by that, as a share of peak (r.m.s.), from which a test shows T0 and C.

Reason: what is visible at all; a test that slips all the way changes by twenty times as much, one that does not by
nothing."""

# --- When an effect is added for its prediction alone (predictive_search.py)

LEAST_PREDICTION_GAIN = 0.05
"""Share by which an added effect must lower the pooled W_s of held-out tests.

Reason: less than a twentieth is no reason for a law more, however sure it is; not tuned."""
SCREENED_EFFECTS = 5
"""Effects that are fitted: those with the largest promised drop of the misfit.

Reason: time; on configs/utfsm.yaml the effect that predicts best is among the first three."""
EXCHANGED_EFFECTS = 3
"""Effects that are fitted in the place of an adopted one: those with the largest promised drop of the misfit.

Reason: time; it is asked for every adopted effect. Not tuned."""
SCREENED_FOR_SEVERAL = 8
"""Effects that are fitted beside all others, to take the place of several.

Reason: more than elsewhere, since what two others keep out promises little beside both; on configs/utfsm.yaml one that
predicts held-out tests as well as three others comes after the fifth."""
FOR_SEVERAL = 3
"""Effects that are tried in the place of several: those that predict best to first order beside all of them.

Reason: time; each takes a refit for every effect, and again for every one that is left out. Not tuned."""
NO_WAY_BACK = 2.0
"""Ratio of W_s of held-out tests, to first order, from which on no further effect is left out in such a place.

Reason: what doubles the error is needed, and the next one would be compared beside what is missed then. Not tuned."""
CROSS_VALIDATED_CANDIDATES = 3
"""Candidates that are cross-validated: those that predict best to first order.

Reason: time; each takes as many refits as there are folds."""
INTERPOLATION_DEPARTURE = 0.25
"""Largest departure of the force half-way between two voltages from the mean of both, as a share of their difference.

Reason: a force that goes with the square of the voltage lies off by just that; with parameters on lines, and an effect
that the tests know at each voltage, it is a few hundredths. Not tuned."""

HARDLY_CLOSED = 2.0 / 3.0
"""Share of the gap that effects leave together, above which none of them is called certain.

Reason: what is missing is then mostly something else, and the nearest law of the library takes a part of anything: the
play of a rod end made a pocket that "certainly" closed a quarter of it. Not tuned."""

CERTAIN_FROM = 0.99
"""Probability from which an adopted effect is called certain; below `DOUBTFUL_BELOW` it is called open.

Reason: one such effect in a hundred predicts other tests no better, if the tests are like them; not tuned."""

# --- Trends of the nuisances over the tests (verdict.py)

FEWEST_FOR_A_TREND = 3
"""Degrees of freedom from which a trend over tests is estimated.

Reason: with fewer a single odd test makes any trend; at three Student's t still asks for ten times the error."""

# --- What is judged by itself (workflow.py)

MOST_ALONE = 2
"""Effects that were added for what they predict, up to which they are judged again by themselves.

Reason: three of them follow nearly anything."""
ALONE_LEAVES = 0.25
"""Ratio of W_s of kept-back tests, to the baseline, above which a law that takes part of much is not named alone.

Reason: half of the force error; a mount that sticks and slips, which is no branch, leaves more of it."""

# --- The knee law or effects beside T0, C and k (workflow.py)

BETTER_THAN_KNEE = 0.5
"""Ratio of W_s of kept-back tests below which a damper with effects is handed on in the place of the knee law.

Reason: the knee law leaves out one test at a time, effects whole folds; twice is beyond that. Not tuned."""

# --- Zeros of the load cell that differ from test to test (workflow.py)

LARGEST_ZERO = 0.03
"""Standard deviation of the offset of a test, as a share of its peak, that is allowed for where nothing else is left.

Reason: a cell of ten times the force, whose zero is good to 0.3 % of its range; not tuned."""
ZEROS_LEAVE = 0.7
"""Share of the gap that an offset of each test may leave, for the effects to be selected again with it.

Reason: it takes half of the squares; the fit that it had bent takes the rest, or the first selection stands. Not tuned.
"""

SEAL_LEAVES = 0.02
"""Largest gap, as a share of peak, beside which the friction of a seal is tried where effects leave something.

Reason: seals rub with 1 to 3 % of the peak force of a damper, and T0 takes most of it, but where the rod turns round;
what leaves more has another cause. Not tuned."""

# --- What counts as a gap, and when it contradicts a name (gap.py, verdict.py)

CYCLE_CHANGE_SIGNIFICANCE = 1e-4
"""Probability by noise alone below which a change from cycle to cycle counts in the gap.

Reason: a tenth of `significance`, since every test is asked; not tuned."""
LEAST_HUM = 5e-4
"""Amplitude of a mains line, as a share of the test's peak, from which it counts as a nuisance.

Reason: a fifth of `visible`, below which no gap matters; not tuned."""
LARGE_REMAINDER = 2.0
"""Multiple of `visible` from which a remaining gap contradicts that the adopted effects are all.

Reason: a large effect may close all but a tenth of the gap, and the tenth be as large as a second one; not tuned."""

# --- Confidence of a verdict (verdict.py, search/acceptance.py)

OUTSIDE_LIBRARY = 0.03
"""Share of cases in which something is missing that is not in the library, and that looks like one of its effects or
like nothing.

Reason: benchmark: with it 97.0 % were stated and 97.6 % hit in 710 cases of the highest confidence."""
LARGEST_GAP = 0.25
"""Largest gap [share of peak, r.m.s.] in the prior of a missing effect; the smallest is `visible`.

Reason: a quarter of the peak would be no extension of T0, C and k but another damper; it enters by its logarithm."""
SMALLEST_GAP = 0.01
"""Share of `visible` down to which the prior of an effect too small to count extends.

Reason: as many decades below `visible` as lie above it; it enters by its logarithm."""
SIZES_AVERAGED = 400
"""Sizes of a gap over which a likelihood is averaged.

Reason: 1 % from one to the next, so that a gap known to 2 % is resolved."""
NOT_EXCLUDED = 0.05
"""Probability from which an effect is reported as one that the tests do not exclude.

Reason: as much as a 95 % interval leaves outside; not tuned."""
LIKELIER_THAN_NOT = 0.5
"""Confidence below which what the tests do not exclude is reported as possible, and the verdict is ambiguous.

Reason: something else is then likelier than the verdict."""
DOUBTFUL_BELOW = 0.9
"""Confidence below which a verdict reports what is not excluded, and one more test is proposed.

Reason: one such verdict in ten is wrong then, if the confidence is right; not tuned."""
