"""Every fixed threshold by which an effect is tried, adopted, refused or removed, and a verdict reached.

The thresholds that a user may change are fields of `DiagnoseConfig` with defaults of their own: `significance`,
`visible`, `negligible`, `unexplained_share`, `adopt_bic`, `rival_bic`, `most_effects` and `most_added`. These here are
fixed. Each says what it decides, then why it has this value. "Benchmark" is `pzd blind` on configs/blind.yaml: 1500
cases with a hidden effect, with none, or with one that is not in the library. "Not tuned" is a round number that no
case is known to depend on; `make sensitivity` prints what halving and doubling each of them changes.
"""

from __future__ import annotations

# Which effects are tried, and how far each is searched (search/candidates.py)

MOVING_VOLTAGE = 0.02
"""A voltage moves in a test if its range there exceeds this share of the rig's scale.

Reason: the share that the records themselves are parted by, see `CONSTANT_SHARE` in `pzd/record.py`."""
FIRST_EVALUATIONS = 6
"""Evaluations after which the candidates are compared for the first time; the better ones go on.

Reason: time. What is still far from its optimum then is kept by the room that `WORTH_SEARCHING` leaves; not tuned."""
WORTH_SEARCHING = 0.5
"""A candidate that pays less than this share of what the best pays is not searched on.

Reason: time; not tuned."""
MOST_EVALUATIONS_OF_BEST = 100
"""Evaluations after which even a converged optimum is left as it is.

Reason: five times those of any other fit; not tuned."""
NEARLY_AS_GOOD = 0.95
"""Candidates that pay at least this share of what the chosen one pays are searched to the end like it.

Reason: two effects that explain alike have to be compared at their optima, or the one searched longer wins."""
STARTS_TRIED = 2
"""Starting values tried before fainter ones.

Reason: time. The starts are sorted by what a linearised step promises; not tuned."""
FAINTER_STARTS = (0.3, 0.1, 0.03, 0.01)
"""Shares of the way from no effect to the most promising starting values, tried where the search got stuck.

Reason: in half decades down to a hundredth, below which an effect at its usual size is not visible."""
WORSE_THAN_CONTAINED = 1.0
"""A model that holds another one is worse than it by more [in squares of noise] only where its search got stuck.

Reason: at its optimum it is never worse; one square of noise is far below what `adopt_bic` asks for."""
AT_EDGE = 0.01
"""A searched variable that ends so near to a limit ends at it.

Reason: 1 % of a parameter that is searched by its logarithm; not tuned."""
FAINT = 0.1
"""Share of the way to its starting values at which an effect that noise nearly hides is linearised.

Reason: there a law is still nearly linear in its parameter; the starting values themselves are tried beside it."""
FAINTEST = 0.01
"""Where an effect is looked for from none on, it is linearised over so much of its scale.

Reason: a hundredth of the largest force, or of its like, where such effects are linear in their parameter."""
LEAST_PROMISE = 15.0
"""An effect that promises to lower the misfit by less is not searched for where noise explains what is left.

Reason: to pay it must lower the misfit by -`adopt_bic` + ln n, twice this; a linearised promise is not exact."""
SLIGHT_PROMISE = 3.0
"""Nor is one searched for that promises less than this where something is missing.

Reason: a fifth of `LEAST_PROMISE`. Of 24 cases of the benchmark (seed 1) the searches that were promised least reached
4.5 (relief_valve) and 4.7 times (sensor_delay) what was promised."""
WORTH_FITTING = 0.02
"""Nor is one that promises less than this share of what the best one promises.

Reason: at five times its promise it would still pay a tenth of the best, and no rival does that; not tuned."""

MOST_TIME_CONSTANTS = 3.0
"""Time constants C/k of an element that fit into one sample at most; a faster element is not looked for.

Reason: after three the element is at rest but for 5 %, so that samples cannot tell it from a faster one."""

# When an effect is adopted or refused (search/acceptance.py)

LEAST_CLOSED = 0.2
"""An effect closes at least this share of the gap (mean square), each test counted by its own peak or all by force.

Reason: what is real is not one of many small corrections. Tests of small force may keep a gap of another kind, as
those at 0 A of configs/utfpr.yaml do, and would hide what the others show: hence the two counts."""
TRIVIAL_SIZE = {("preload_offset", "F_0"): 0.01, ("sensor_delay", "tau"): 1e-3, ("valve_lag", "tau"): 1e-3}
"""A common offset [share of the lowest peak], delay or lag [s] below which it counts as nothing missing.

Reason: twice the prior of a test's own offset and delay (`NuisanceConfig`): what is smaller may be the rig's."""
OF_EACH_TEST = frozenset(effect for effect, _ in TRIVIAL_SIZE)
"""The effects that each test may have a little of for itself."""
STOP_BEGINS = 0.4
"""No end stop begins within this share of the half stroke about its middle.

Reason: stops act over the last 10 to 30 % of the stroke, a soft rubber one over half of it."""
STOP_OTHER_SIDE = 0.1
"""Share of its force at one end of the stroke that a stop has to reach at the other end.

Reason: a stop at one end alone cannot be told from a stroke that is recorded off its middle; not tuned."""
HALVES_SIGNIFICANCE = 0.001
"""Halves of the tests disagree about a parameter where chance alone would let them so seldom.

Reason: the level of `significance`; the limit on the misfit is twice the quantile of chi-square, for two halves."""
HALVES_LOSE = 0.05
"""Nor do they where a half loses less with the other's values than this share of what the effect explains in all.

Reason: of a parameter that enters linearly a fifth of its value; an effect that explains much tells halves apart by
what gains and clocks of a stand make of it. Not tuned."""
HALVES_ALIKE = 0.1
"""Values from either half within this ratio of one another agree, whatever their intervals.

Reason: the intervals of quiet tests are narrower than what the gains of a rig make of a parameter; not tuned."""

# When an optimum or an effect is given up again (search/forward_selection.py, search/reweighting.py, missed.py)

WIDER = 1.1
"""An optimum that widens the gap by more than this factor over where its search began is not gone to.

Reason: weights by noise may bend a fit away from the force; up to 10 % is the play of rounding. Not tuned."""
AT_REST = 0.2
"""A parameter that moves by less than this share of its standard error stays where it is.

Reason: it widens an interval by 2 % (root of 1 + 0.2^2), less than anything the intervals promise."""
MOST_REWEIGHTINGS = 5
"""Times that the tests are weighed anew at the end, at most.

Reason: time; what swings between two optima would never end."""
PREDICTS_WORSE = 2.0
"""Standard errors of the paired difference over tests from which one damper predicts worse than another; of few tests
as many more as Student's t takes for the same confidence.

Reason: the customary 95 %."""

WORSE_BETWEEN = 1.5
"""W_s of a voltage left out, as a multiple of the plain damper's, from which effects are not handed on.

Reason: there the line between voltages misses more than any law, and with a true law, when T0 and C become those of the
damper, it may miss a little more than without; nor do the tests of one voltage, which all miss the same, tell chance.
7 % more was seen with a true name, 2.9 times with a wrong one; not tuned."""

# When an effect is added for what it predicts alone (added_by_prediction.py)

LEAST_CUT_IN_PREDICTION = 0.05
"""An effect lowers the pooled W_s of kept-back tests by at least this share.

Reason: less than a twentieth is no reason for a law more, however sure it is; not tuned."""
SCREENED = 5
"""Effects that are fitted, those that promise most of what a linearised step would reach.

Reason: time; on configs/utfsm.yaml the effect that predicts best is among the first three."""
PREDICTED_AT_ONCE = 3
"""Candidates of which kept-back tests are predicted, those that fit best.

Reason: time; each takes as many refits as there are folds."""
FARTHEST_HALF_WAY = 0.25
"""Of the difference between the forces at two neighbouring voltages, what the force half-way may lie off their mean.

Reason: a force that goes with the square of the voltage lies off by just that; with parameters on lines, and an effect
that the tests know at each voltage, it is a few hundredths. Not tuned."""

# What the tests' own gains, offsets and delays have in common (trends_of_tests.py)

FEWEST_FOR_A_TREND = 3
"""Degrees of freedom from which a trend over tests is looked for.

Reason: with fewer a single odd test makes any trend; at three Student's t still asks for ten times the error."""

# What the verdict adds (verdict.py, residual_check.py)

CYCLE_CHANGE_SIGNIFICANCE = 1e-4
"""A change from cycle to cycle counts in the gap where noise alone would show it less often than this.

Reason: a tenth of `significance`, since every test is asked; not tuned."""
LEAST_HUM = 5e-4
"""A line of the mains counts as a nuisance of its test from this share of the test's peak on.

Reason: a fifth of `visible`, below which no gap matters; not tuned."""
CONTRADICTS = 2.0
"""A remainder of so many times `visible` contradicts that these effects are all, whatever they closed.

Reason: a large effect may close all but a tenth of the gap, and the tenth be as large as a second one; not tuned."""

# How sure a verdict is (confidence.py, search/detection.py)

OUTSIDE_LIBRARY = 0.03
"""Share of cases in which something is missing that is not in the library, and that looks like one of its effects or
like nothing.

Reason: benchmark: with it 97.0 % were stated and 97.6 % hit in 710 cases of the highest confidence."""
LARGEST_GAP = 0.25
"""Largest gap [share of peak, r.m.s.] that a missing effect is expected to leave; the smallest is `visible`.

Reason: a quarter of the peak would be no extension of T0, C and k but another damper; it enters by its logarithm."""
SMALLEST_GAP = 0.01
"""Share of `visible` down to which an effect too small to count is expected.

Reason: as many decades below `visible` as lie above it; it enters by its logarithm."""
SIZES_AVERAGED = 400
"""Sizes of a gap over which a likelihood is averaged.

Reason: 1 % from one to the next, so that a gap known to 2 % is resolved."""
NOT_EXCLUDED = 0.05
"""From this probability on an effect is told as one that the tests do not exclude.

Reason: as much as a 95 % interval leaves outside; not tuned."""
LIKELIER_THAN_NOT = 0.5
"""Below this confidence what the tests do not exclude is told as possible, and the verdict is open.

Reason: something else is then likelier than what would be said."""
DOUBTFUL_BELOW = 0.9
"""Below this confidence a verdict tells what is not excluded, and one more test is proposed.

Reason: one such verdict in ten is wrong then, if the confidence is right; not tuned."""
