// The machine's state, and how it moves: on the way it may stop where a limit ends.

const SAMPLES = 24, BISECTIONS = 30;
const everyHome = () => machine.axes.map(axis => axis.home);
let homeSide = measureSide(stateAtPose(everyHome(), machine.mode, null));
let current = stateAtPose(begin, signs ?? machine.mode, null);
const options = {stops: true};
let stoppedBy = null; // why the last move ended early, as text
let unreached = null; // the pose and signs that were to be shown, where they are out of reach: limits are told of these
const listeners = [];
let stopPlaying = () => {}; // the player's; what a hand moves is not played on

function announce() {
  for (const listener of listeners) listener();
}

function setState(state, reason = null, missed = null) {
  current = state;
  stoppedBy = reason;
  unreached = missed;
  announce();
}

const nameLimit = i => machine.limits[i].name;

// Why a state must not be entered: a broken limit, or a singularity that was passed; null if it may be.
function findObstacle(state, side) {
  const broken = findBroken(marginsAt(state));
  if (broken >= 0) return nameLimit(broken);
  return measureSide(state) * side > 0 ? null : "parallel singularity";
}

function describeUnreached(pose, signs) {
  const broken = findUnreached(pose, signs);
  return broken < 0 ? "out of reach" : nameLimit(broken);
}

// Stay where a pose is out of reach.
function missPose(pose, signs) {
  setState(current, describeUnreached(pose, signs), {pose, signs});
}

// Go on from share 0 towards 1 as far as there is no obstacle; tryShare returns one, or null where it went there.
function goOn(tryShare) {
  let low = 0, high = 1, reason = null;
  const goTo = share => {
    const obstacle = tryShare(share);
    if (obstacle === null) low = share;
    else [high, reason] = [share, obstacle];
    return obstacle === null;
  };
  for (let k = 1; k <= SAMPLES && goTo(k / SAMPLES); k++);
  for (let k = 0; reason !== null && k < BISECTIONS && high - low > 1e-9; k++) goTo(0.5 * (low + high));
  return {reason, low};
}

const isGuarded = (state, side) => options.stops && findObstacle(state, side) === null;

// Move towards a pose on a straight line of poses.
function moveToPose(pose) {
  stopPlaying();
  const from = current, side = measureSide(from);
  if (!isGuarded(from, side)) {
    const state = stateAtPose(pose, from.signs, from);
    return state ? setState(state) : missPose(pose, from.signs);
  }
  let state = from;
  const {reason} = goOn(share => {
    const between = from.pose.map((value, i) => value + share * (pose[i] - value));
    const next = stateAtPose(between, from.signs, state);
    const obstacle = next ? findObstacle(next, side) : describeUnreached(between, from.signs);
    if (obstacle === null) state = next;
    return obstacle;
  });
  setState(state, reason);
}

// Move towards joints on their straight line, the legs closed all the way.
function moveToJoints(joints) {
  stopPlaying();
  const from = current, side = measureSide(from);
  const guarded = isGuarded(from, side), moved = joints.map((q, i) => q !== from.joints[i]);
  let reason = null, state = from;
  for (let k = 0; k < BISECTIONS; k++) {
    const goal = k === 0 ? joints : state.joints.map((q, i) => moved[i] ? 0.5 * (q + joints[i]) : q);
    let met = false; // an obstacle, on this way
    const way = followJoints(state, goal, next => {
      const obstacle = guarded ? findObstacle(next, side) : null;
      if (obstacle !== null) {
        [reason, met] = [obstacle, true];
        joints = next.joints;
      }
      return obstacle === null;
    });
    state = way.state;
    if (!way.complete && !met) reason ??= "parallel singularity";
    if (!met && (k === 0 || !way.complete) || !guarded) break; // a way ends next to a singularity
    if (joints.every((q, i) => !moved[i] || abs(q - state.joints[i]) < 1e-9)) break;
  }
  setState(state, reason);
}

// Choose the other branch of one leg, or of the wrist, at the same pose.
function switchSign(i) {
  stopPlaying();
  const signs = current.signs.map((sign, j) => j === i ? -sign : sign);
  const state = stateAtPose(current.pose, signs, current);
  setState(state ?? current, state ? null : "no such working mode here");
}

function goHome() {
  stopPlaying();
  const state = stateAtPose(everyHome(), machine.mode, null); // none where sizes were dragged so far that home is out of reach
  setState(state ?? current, state ? null : `home: ${describeUnreached(everyHome(), machine.mode)}`);
}

// Numbers in [0, 1), the same each time.
function makeRandom(seed) {
  return () => {
    seed = (seed + 0x6d2b79f5) | 0;
    let t = Math.imul(seed ^ (seed >>> 15), 1 | seed);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

// Search for poses of the current joints from many starts; it proves nothing.
function searchAssemblies(starts = 300) {
  const random = makeRandom(1), states = [current];
  for (let k = 0; k < starts; k++) {
    const near = machine.axes.map(axis => axis.unit === "rad"
      ? (random() - 0.5) * TURN : axis.home + (random() - 0.5) * 2 * machine.size);
    const root = findRoot(near, current.joints);
    if (!root) continue;
    const pose = nearTurns(root.pose, current.pose);
    if (states.some(state => describesSame(state.pose, pose))) continue;
    const state = {pose, joints: current.joints, signs: findSigns(pose, current.joints, current.signs)};
    if (abs(measureSide(state)) > 1e-6 * abs(homeSide)) states.push(state);
  }
  return states;
}

function describesSame(one, other) {
  const frames = [one, other].map(pose => model.placePoints(pose, current.joints));
  return frames[0].every((value, i) => !(abs(value - frames[1][i]) > 1e-4));
}

let assemblies = [], assemblyNumber = 0;

function showNextAssembly() {
  stopPlaying();
  const known = assemblies.length && assemblies[0].joints.every((q, i) => abs(q - current.joints[i]) < 1e-9);
  if (!known) [assemblies, assemblyNumber] = [searchAssemblies(), 0];
  assemblyNumber = (assemblyNumber + 1) % assemblies.length;
  setState(assemblies[assemblyNumber], assemblies.length === 1 ? "no other assembly was found" : null);
}
