// The named sizes of the machine's file are inputs of its equations: the machine is another one while they are dragged.

const nominalSizes = machine.sizes.map(size => size.nominal);

// Read anew what follows from the sizes: home, the limits' bounds, the drives' ranges.
function readGiven() {
  const given = model.given(), axes = machine.axes.length, limits = machine.limits.length;
  machine.axes.forEach((axis, i) => { axis.home = given[i]; });
  machine.limits.forEach((limit, i) => { limit.bound = given[axes + i]; });
  machine.joints.forEach((joint, i) => {
    [joint.low, joint.high] = [0, 1].map(end => given[axes + limits + 2 * i + end]).map(end => Number.isFinite(end) ? end : null);
  });
  const home = stateAtPose(everyHome(), machine.mode, null);
  homeSide = home ? measureSide(home) : NaN;
}

function setSizes(sizes) {
  sizes.forEach((size, i) => { model.sizes[i] = size; });
  readGiven();
}

// The sizes where one of them has a value: those that the file calculates from it follow.
function followSize(number, value) {
  const sizes = [...model.sizes];
  sizes[number] = value;
  for (let i = number + 1; i < sizes.length; i++) sizes[i] += leadSize(i, sizes, model.sizes);
  return sizes;
}

// By how much a size follows others between two vectors of sizes.
const leadSize = (i, sizes, from) => machine.sizes[i].follows.reduce((sum, rate, j) => sum + rate * (sizes[j] - from[j]), 0);

// The sizes that have values of their own, not as in the file or as the file calculates them from others.
function listOwnSizes() {
  return machine.sizes.map((size, i) => ({...size, value: model.sizes[i]}))
    .filter(({nominal, value}, i) => abs(value - nominal - leadSize(i, model.sizes, nominalSizes)) > 1e-9 * (1 + abs(value)));
}

// Change sizes at the pose that is held, as far as the machine can be there.
function moveToSizes(sizes) {
  const from = current, before = [...model.sizes], side = measureSide(from), guarded = isGuarded(from, side);
  const mix = share => before.map((size, i) => size + share * (sizes[i] - size));
  let state = from;
  const {reason, low} = goOn(share => {
    setSizes(mix(share));
    const next = stateAtPose(from.pose, from.signs, state);
    if (!next) return describeUnreached(from.pose, from.signs);
    const obstacle = guarded ? findObstacle(next, side) : null;
    if (obstacle === null) state = next;
    return obstacle;
  });
  setSizes(mix(reason === null ? 1 : low));
  setState(state, reason);
}
