"""Newton's method on the legs' closures, many poses side by side: the general direct problem.

A block ends when its slowest lane has converged, but every lane decides for itself which matrix it keeps and where it
stops, so an answer does not depend on the rows that share its block. A lane's matrix is made anew only while that still
matters; its last steps keep it. Where all lanes of a block do, a step is only the closures and a substitution. Rows are
exchanged lane by lane.

With more closures than coordinates it is the Gauss-Newton method: steps end where what is left of the closures is at
right angles to all that the coordinates can change. That is a root only where nothing is left.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from .elementary import Lane, Lanes
from .factoring import Factors, MatrixShape, factor_matrix, solve_factored
from .lane_program import Columns, Program
from .operations import evaluate
from .tape import NewtonTapes
from .tape_rows import find_positive, find_spoiled

CLOSE = 1e-6  # mm: from a closure this good one more step ends below rounding
WORTH = 1e-4  # mm: where a step will end no worse than this, the matrix at hand serves on
SLOW = 0.05  # a kept matrix that gains less than this a step is made anew
FINE = 1e-12  # mm: where the next step is predicted to end, it is the last
DOUBLE = 0.2  # a new matrix that leaves more than this a step is beside a double root, where each leaves a quarter


class NewtonShape(NamedTuple):
    """What the program of Newton's method depends on besides its tapes.

    coordinates, joints, near, answer : how many numbers they have
    near_role : "rows", or "shared" where all begin from one
    sides : the determinants whose sign to end with: "rows", "shared", or "start" for each start's own
    """

    coordinates: int
    joints: int
    near: int
    answer: int
    near_role: str
    sides: str


class NewtonNumbers(NamedTuple):
    """The numbers of :class:`~.batch.NewtonSteps` and its settling, one for all lanes.

    size, most, closed : of the legs, steps, the greatest closure of a root
    turned, steady, steps : of :class:`~.batch.Settling`
    caps : (m) of each coordinate
    """

    size: Lane
    most: Lane
    closed: Lane
    turned: Lane
    steady: Lane
    steps: Lane
    caps: Sequence[Lane]


class NewtonState(NamedTuple):
    """What a step leaves to the next one.

    point : the coordinates
    factors : of each lane's matrix
    first : the determinant of the first matrix
    worst : the greatest closure that the last step could close: of all, as they are as many as the coordinates
    residual : the greatest closure
    renews : wants a new matrix
    last, done : takes one more step; takes none
    steps : taken by the lane
    number : of this step
    """

    point: list[Lane]
    factors: Factors
    first: Lane
    worst: Lane
    residual: Lane
    renews: Lane
    last: Lane
    done: Lane
    steps: Lane
    number: Lane

    def flatten(self) -> list[Lane]:
        return [*self.point, *self.factors.matrix, *self.factors.exchanged, self.factors.determinant, *self[2:]]


def _gather_state(lanes: Sequence[Lane], shape: MatrixShape) -> NewtonState:
    """Gather the state from its lanes in a row."""
    m = shape.columns
    factors = lanes[m : m + shape.factor_entries + shape.exchanges + 1]
    return NewtonState(list(lanes[:m]), _gather_factors(factors, shape), *lanes[m + len(factors) :])


def _gather_factors(lanes: Sequence[Lane], shape: MatrixShape) -> Factors:
    """Gather a matrix's factors from their lanes in a row."""
    return Factors(list(lanes[: shape.factor_entries]), list(lanes[shape.factor_entries : -1]), lanes[-1])


def _evaluate_closures(
    lanes: Lanes, tapes: NewtonTapes, state: NewtonState, joints: Sequence[Lane]
) -> tuple[list[Lane], Factors]:
    """Evaluate the closures, and the matrix anew in the lanes that want it; returns both."""
    shape, old, inputs = tapes.matrix_shape, state.factors, [*state.point, *joints]

    def renew() -> list[Lane]:
        outputs = evaluate(lanes, tapes.closures_and_slopes, inputs)
        new = factor_matrix(lanes, outputs[shape.rows :], shape)
        pairs = zip([*new.matrix, *new.exchanged], [*old.matrix, *old.exchanged], strict=True)
        chosen = [lanes.select(state.renews, one, other) for one, other in pairs]
        return [*outputs[: shape.rows], *chosen, lanes.select(state.renews, new.determinant, old.determinant)]

    def keep() -> list[Lane]:
        return [*evaluate(lanes, tapes.closures, inputs), *old.matrix, *old.exchanged, old.determinant]

    result = lanes.branch(state.renews, renew, keep)
    return result[: shape.rows], _gather_factors(result[shape.rows :], shape)


def _measure_greatest(lanes: Lanes, closures: Sequence[Lane]) -> Lane:
    """Measure the greatest closure; NaN where one is."""
    worst = lanes.constant(0.0)
    for closure in closures:
        size = abs(closure)
        worst = lanes.select((size > worst) | (closure != closure), size, worst)
    return worst


def _choose_next_matrix(state: NewtonState, worst: Lane, limits: NewtonNumbers) -> tuple[Lane, Lane, Lane]:
    """Choose for each lane whether its next matrix is a new one, and whether it stops: renews, last, done.

    A lane whose closures are NaN stops. One whose last step did not close the legs goes on.
    """
    new, before = state.renews, state.worst
    slow, double = worst > SLOW * before, (worst > DOUBLE * before) & (worst > limits.closed)
    anew = (new & ((worst * worst > WORTH * limits.size) | double)) | (~new & slow)
    enough = (new & (worst < CLOSE) & ~double) | (~new & (worst * worst < FINE * before) & ~slow)
    going = ~state.done & (~state.last | (worst > limits.closed)) & (worst == worst)
    return going & anew, going & enough, ~going


def _take_step(lanes: Lanes, state: NewtonState, step: Sequence[Lane], stays: Lane, caps: Sequence[Lane]) -> list[Lane]:
    """Take a step from the point, shrunk where a coordinate would change by too much; none in lanes that stay."""
    shrink = lanes.select(stays, lanes.constant(0.0), 1.0)
    for change, cap in zip(step, caps, strict=True):
        over = abs(change) * shrink
        shrink = lanes.select(over > cap, shrink * (cap / over), shrink)
    return [lanes.select(shrink > 0.0, y - shrink * change, y) for y, change in zip(state.point, step, strict=True)]


def find_root(
    lanes: Lanes, tapes: NewtonTapes, limits: NewtonNumbers, point: Sequence[Lane], joints: Sequence[Lane]
) -> NewtonState:
    """Run Newton's method from the coordinates of a point to the root."""
    shape, zero, infinite = tapes.matrix_shape, lanes.constant(0.0), lanes.constant(float("inf"))
    yes, no = zero == 0.0, zero != 0.0
    factors = Factors([zero] * shape.factor_entries, [no] * shape.exchanges, zero)
    begin = NewtonState(list(point), factors, zero, infinite, infinite, yes, no, no, zero, zero)

    def step(given: list[Lane]) -> tuple[list[Lane], Lane]:
        state = _gather_state(given, shape)
        closures, factors = _evaluate_closures(lanes, tapes, state, joints)
        first = lanes.select(state.number == 0.0, factors.determinant, state.first)
        change, closable = solve_factored(lanes, factors, closures, shape)
        worst, residual = (_measure_greatest(lanes, each) for each in (closable, closures))
        steps = lanes.select(state.done, state.steps, state.number)
        renews, last, done = _choose_next_matrix(state, worst, limits)
        if not shape.is_square:  # what is left is at right angles to the columns of its own place
            renews = renews | last
        moved = _take_step(lanes, state, change, done | (worst < FINE), limits.caps)
        after = NewtonState(moved, factors, first, worst, residual, renews, last, done, steps, state.number + 1.0)
        return after.flatten(), ~done & (state.number < limits.most)

    return _gather_state(lanes.repeat(begin.flatten(), step), shape)


def write_newton(tapes: NewtonTapes, shape: NewtonShape) -> Program:
    """Write the program near, joints, step limits, sides -> the fields of :class:`~.batch.Roots`."""
    own_sides = [] if shape.sides == "start" else [Columns(1, shape.sides)]
    given = [Columns(shape.near, shape.near_role), Columns(shape.joints), Columns(6 + shape.coordinates, "shared")]

    def compute(lanes: Lanes, inputs: Sequence[Sequence[Lane]]) -> Sequence[Sequence[Lane]]:
        near, joints, (size, most, closed, turned, steady, steps, *caps), *sides = inputs
        limits = NewtonNumbers(size, most, closed, turned, steady, steps, caps)
        state = find_root(lanes, tapes, limits, evaluate(lanes, tapes.begin, [*near, *joints]), joints)
        wanted = [*state.point, *joints, *near][: tapes.end.inputs]
        outputs = evaluate(lanes, tapes.end, wanted)
        bad = find_spoiled([*(near if shape.near_role == "rows" else []), *joints, *outputs[: shape.answer]])
        residual, determinant = state.residual + bad, state.factors.determinant
        product = determinant * (sides[0][0] if sides else state.first)
        settled = find_positive(lanes, outputs[shape.answer :]) & (residual <= limits.closed)
        settled = settled & (product > limits.turned) & (state.steps <= limits.steps)
        settled = settled & (abs(determinant - state.first) <= limits.steady * abs(state.first))
        return [[lane + bad for lane in outputs[: shape.answer]], [residual], [state.steps], [product], [settled]]

    made = (Columns(shape.answer), Columns(1), Columns(1, kind="int32"), Columns(1), Columns(1, kind="bool"))
    rows, columns = tapes.matrix_shape
    length = sum(len(tape.code) for tape in tapes) + 2 * rows * columns**2
    return Program((*given, *own_sides), made, compute, length)
