// Both problems on the machine's equations, the limits, and the singularities. A state is {pose, joints, signs}.

const TURN = 2 * PI, MOST_STEPS = 24, LEAST_STRIDE = 1e-4;
const axisNumbers = [...machine.axes.keys()];
const isTurning = machine.joints.map(joint => joint.unit === "rad");

const isFinitePose = values => values.every(Number.isFinite);

// Count turning joints on to the turn nearest to those before.
function unwind(joints, before) {
  return joints.map((q, i) => isTurning[i] ? q + TURN * Math.round((before[i] - q) / TURN) : q);
}

// The state at a pose in a working mode, its turns counted on from a state before; null out of reach.
function stateAtPose(pose, signs, before) {
  let joints = model.inverse(pose, signs);
  if (machine.wrist && before && model.freedom(pose)[0] < machine.wrist.free) {
    joints = model.inverseWithFirst(pose, signs, [before.joints[machine.wrist.first]]);
  }
  if (!isFinitePose(joints)) return null;
  return {pose: [...pose], joints: before ? unwind(joints, before.joints) : joints, signs};
}

// Newton's method on the closures from a pose, with more of these than freedoms that of Gauss and Newton; null where it
// finds no root within the tolerance.
function findRoot(near, joints) {
  const n = machine.caps.length;
  let y = model.begin(near, joints), residual = Infinity, determinant = 0;
  for (let step = 0; step < MOST_STEPS; step++) {
    const values = model.closures(y, joints), f = values.slice(0, values.length / (n + 1));
    const before = residual;
    residual = max(...f.map(abs));
    if (!Number.isFinite(residual)) return null;
    if (residual <= machine.tolerance && residual >= 0.1 * before || residual === 0) break;
    const solved = solveLeastSquares(values.slice(f.length), f, n);
    determinant = solved.determinant;
    let shrink = 1;
    solved.x.forEach((change, i) => { shrink = min(shrink, machine.caps[i] / abs(change)); });
    y = y.map((value, i) => value - shrink * solved.x[i]);
  }
  if (!(residual <= machine.tolerance)) return null;
  const pose = model.end(y, joints);
  return isFinitePose(pose) ? {pose, determinant} : null;
}

// Bring a pose's turns near to those of another one.
function nearTurns(pose, near) {
  return pose.map((value, i) => machine.axes[i].unit === "rad"
    ? value + TURN * Math.round((near[i] - value) / TURN) : value);
}

// The working mode in which the joints stand at a pose: the one before, or the one whose inverse is nearest to them.
function findSigns(pose, joints, signs) {
  const own = [...signs];
  for (let i = 0; i < own.length; i++) {
    const other = own.map((sign, j) => j === i ? -sign : sign);
    if (compareJoints(model.inverse(pose, other), joints) < compareJoints(model.inverse(pose, own), joints) - 1e-9) {
      own[i] = -own[i];
    }
  }
  return own;
}

function compareJoints(one, other) {
  return one.reduce((sum, q, i) => {
    const off = isTurning[i] ? machine.size * (q - other[i] - TURN * Math.round((q - other[i]) / TURN)) : q - other[i];
    return sum + (Number.isFinite(off) ? abs(off) : 1e9);
  }, 0);
}

// Of more drives than freedoms those that stand follow the others, and as little as they can.
const FOLLOWS = 1e-3, DIFFERENCE = 1e-4; // what their ways count; mm between poses that tell rates, a turn on the size
const SETTLED = 1e-4; // mm: a step as small as this is the last where steps do not become smaller quickly

// The state whose joints are those given in the least squares, from one next to it; those that follow are bound to no value, but
// move as little as they can in each step, whereby few steps are needed. Null where none is found.
function settleJoints(state, joints, counts) {
  const n = machine.axes.length, arms = machine.axes.map(axis => axis.unit === "rad" ? 1 / machine.size : 1);
  const weighs = machine.joints.map((joint, i) => counts[i] * (isTurning[i] ? machine.size : 1));
  let here = state, before = Infinity;
  for (let step = 0; step < MOST_STEPS; step++) {
    const beside = axisNumbers.map(k => stateAtPose(
      here.pose.map((value, i) => i === k ? value + DIFFERENCE * arms[k] : value), here.signs, here));
    if (beside.includes(null)) return null;
    const slopes = weighs.flatMap((weight, i) => beside.map(({joints}) => weight * (joints[i] - here.joints[i]) / DIFFERENCE));
    const off = weighs.map((weight, i) => counts[i] === FOLLOWS ? 0 : weight * (here.joints[i] - joints[i]));
    const {x} = solveLeastSquares(slopes, off, n), most = max(...x.map(abs));
    if (!Number.isFinite(most)) return null;
    const shrink = min(1, machine.size / 6 / most);
    here = stateAtPose(here.pose.map((value, i) => value - shrink * arms[i] * x[i]), here.signs, here);
    if (!here || most <= machine.tolerance || most < SETTLED && most >= 0.5 * before) return here;
    before = most;
  }
  return null;
}

// The state at joints next to a state; null where there is none on its side of the singularities.
function findBeside(state, joints, counts, side) {
  if (machine.redundant) {
    const reached = settleJoints(state, joints, counts);
    return reached && isNear(reached.pose, state.pose) ? reached : null;
  }
  const root = findRoot(state.pose, joints), pose = root && nearTurns(root.pose, state.pose);
  const reached = pose && {pose, joints, signs: findSigns(pose, joints, state.signs)};
  return reached && isNear(pose, state.pose) && measureSide(reached) * side > 0 ? reached : null;
}

// The direct problem, continued along the joints' straight line from a state. Calls visit with each state on the way
// and ends where that says false. Returns the last state, and whether it is the end.
function followJoints(from, joints, visit = () => true) {
  let state = from, share = 0, stride = 1 / 4;
  const side = measureSide(from), counts = joints.map((q, i) => q === from.joints[i] ? FOLLOWS : 1);
  while (share < 1 && stride > LEAST_STRIDE) {
    const next = min(1, share + stride);
    const given = from.joints.map((q, i) => q + next * (joints[i] - q));
    const reached = findBeside(state, given, counts, side);
    if (!reached) {
      stride /= 2;
      continue;
    }
    if (!visit(reached)) return {state, complete: false};
    state = reached;
    share = next;
    stride *= 2;
  }
  return {state, complete: share >= 1};
}

function isNear(pose, other) {
  return pose.every((value, i) => abs(value - other[i]) < (machine.axes[i].unit === "rad" ? 0.6 : 0.2 * machine.size)
    || machine.twist.includes("w1") && machine.axes[i].unit === "rad");
}

// det A of the unit wrenches: 0 at a parallel singularity; its sign tells the assembly mode.
function measureSide(state) {
  const rows = model.wrenches(state.pose, state.joints);
  return computeDeterminant(rows, machine.parallelColumns);
}

// The motion that is free at a parallel singularity: the tip's velocity and the small turn (3 each), of unit size.
function findFreeMotion(state) {
  const rows = model.wrenches(state.pose, state.joints), n = machine.parallelColumns;
  const vector = findNullVector(rows, n), motion = {velocity: [0, 0, 0], turn: [0, 0, 0]};
  machine.twist.slice(0, n).forEach((name, i) => {
    if (name.length === 1) motion.velocity["XYZ".indexOf(name)] = vector[i];
    else if ("xyz".includes(name[1])) motion.turn["xyz".indexOf(name[1])] = vector[i];
  });
  return motion;
}

const marginsAt = state => model.margins(state.pose, state.joints, state.signs);

// The first limit that is broken, as its number; -1 where all hold.
const findBroken = margins => margins.findIndex(margin => !(margin >= 0));

// The margins of a pose that may be out of reach: none of what can't be told there.
const marginsOfPose = (pose, signs) => model.margins(pose, model.inverse(pose, signs), signs);

// The limits that a pose out of reach breaks.
const findUnreached = (pose, signs) => findBroken(marginsOfPose(pose, signs));

// How near to its bound a limit is: 0 at it, 1 from a quarter of home's margin on.
function rateMargin(margin, i) {
  return margin >= 0 ? min(1, 4 * margin / machine.limits[i].atHome) : 0;
}
