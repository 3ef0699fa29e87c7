// The workspace's surface at one orientation, in a worker: a lattice of the least margin, refined from coarse to fine,
// and marching tetrahedra (in the plane, triangles). What a lattice steps over is not seen.

const places = [...machine.axes.keys()].filter(i => machine.axes[i].unit === "mm");
const LEVELS = places.length === 3 ? [14, 26, 50] : [40, 160], SECTION_LEVELS = [24, 64], BORDER = 1.35;
const FOLLOW = {2: [[0, 1, 3], [0, 2, 3]], 3: [[0, 1, 3, 7], [0, 1, 5, 7], [0, 2, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 6, 7]]};
let wanted = null, refining = false; // the request in force, and whether one is being worked on

// Of each end of a drive's range: the joint, its sign, and the limit.
const driveLimits = machine.limits.flatMap(limit => {
  const joint = machine.joints.findIndex(({name}) => limit.name === `${name}.${limit.side}`);
  return joint < 0 ? [] : [[joint, limit.side === "max" ? -1 : 1, limit]];
});
const FAR_OUTSIDE = -0.5; // of home's margin: where a drive is so far off its range the other limits are not looked at

// Over home's: the least of all margins, negative where a limit is broken or a leg can't close.
function measureLeastMargin(pose, signs) {
  const joints = model.inverse(pose, signs);
  let far = 0;
  for (const [joint, sign, limit] of driveLimits) far = min(far, sign * (joints[joint] - limit.bound) / limit.atHome);
  if (far < FAR_OUTSIDE) return far;
  const margins = model.margins(pose, joints, signs);
  let least = Infinity;
  for (let i = 0; i < margins.length; i++) {
    const share = margins[i] / machine.limits[i].atHome;
    if (share === share) least = share < least ? share : least;
    else least = min(least, -1e-3);
  }
  return least;
}

// A lattice over some axes of the pose.
function makeLattice(axes, low, high, count) {
  const d = axes.length, step = low.map((value, k) => (high[k] - value) / (count - 1));
  return {axes, low, step, count, values: new Float64Array(count ** d), d};
}

function findRanges(axes) {
  const ranges = axes.map(i => machine.axes[i]), middle = ranges.map(axis => 0.5 * (axis.low + axis.high));
  return [-1, 1].map(side => ranges.map((axis, k) => middle[k] + side * BORDER * 0.5 * (axis.high - axis.low)));
}

// Fill one layer of the lattice; what lies on its border counts as outside, so that the surface is closed.
function fillLayer(lattice, layer, request) {
  const {axes, low, step, count, values, d} = lattice, pose = [...request.pose], width = count ** (d - 1);
  for (let cell = 0; cell < width; cell++) {
    const index = d === 3 ? [layer, Math.floor(cell / count), cell % count] : [layer, cell];
    axes.forEach((axis, k) => { pose[axis] = low[k] + step[k] * index[k]; });
    const value = measureLeastMargin(pose, request.signs);
    values[layer * width + cell] = index.some(i => i === 0 || i === count - 1) ? min(value, -1e-6) : value;
  }
}

// The box of what is allowed, wider by one step; null where nothing is.
function findInside({low, step, count, values, d}) {
  const least = low.map(() => Infinity), greatest = low.map(() => -Infinity);
  values.forEach((value, number) => {
    if (!(value >= 0)) return;
    for (let k = d - 1, rest = number; k >= 0; k--, rest = Math.floor(rest / count)) {
      const i = rest % count;
      least[k] = min(least[k], i - 1.5);
      greatest[k] = max(greatest[k], i + 1.5);
    }
  });
  if (least[0] === Infinity) return null;
  return [least, greatest].map(ends => ends.map((i, k) => low[k] + step[k] * i));
}

const CROSSING_STEPS = 3; // by which the place between two points of the lattice is found where the least margin is zero

// The share of the way between two places, with their margins, at which the margin is zero: by false position, each end's
// margin halved where the other one has been moved twice. Where a leg can't close the margin jumps.
function findCrossing(measure, inside, outside) {
  let [low, high] = [0, 1], share = inside / (inside - outside), moved = 0;
  for (let k = 0; k < CROSSING_STEPS; k++) {
    const value = measure(share);
    if (value >= 0) {
      [low, inside] = [share, value];
      if (moved > 0) outside *= 0.5;
      moved = 1;
    } else {
      [high, outside] = [share, value];
      if (moved < 0) inside *= 0.5;
      moved = -1;
    }
    share = low + (high - low) * inside / (inside - outside);
  }
  return share;
}

// Triangles of the surface with normals (in the plane: of the area itself, with the lattice points that each corner lies
// between, and their weights), and the volume inside.
function marchLattice(lattice, request) {
  const {axes, low, step, count, values, d} = lattice, pose = [...request.pose], crossings = new Map(), corners = 2 ** d, strides = d === 3 ? [count * count, count, 1] : [count, 1];
  const offsets = Array.from({length: corners}, (_, c) => strides.reduce((sum, stride, k) => sum + ((c >> (d - 1 - k)) & 1) * stride, 0));
  const positions = [], normals = [], between = [], locate = number => strides.map((stride, k) => low[k] + step[k] * (Math.floor(number / stride) % count));
  const cellVolume = step.reduce((product, length) => product * length, 1);
  let inside = 0;
  const slope = (number, k) => (values[number + strides[k]] - values[number - strides[k]]) / step[k];
  const makeCrossing = (a, b) => {
    const [p, q] = [locate(a), locate(b)], place = share => p.map((x, k) => x + share * (q[k] - x));
    const share = findCrossing(share => {
      place(share).forEach((x, k) => { pose[axes[k]] = x; });
      return measureLeastMargin(pose, request.signs);
    }, values[a], values[b]);
    return {at: place(share), ends: [[a, 1 - share], [b, share]]};
  };
  const cross = (a, b) => {
    const key = a * values.length + b, known = crossings.get(key);
    if (known) return known;
    const made = makeCrossing(a, b);
    crossings.set(key, made);
    return made;
  };
  const isInner = number => strides.every(stride => { const i = Math.floor(number / stride) % count; return i > 0 && i < count - 1; });
  const findNormal = ({ends}) => {
    const inner = ends.filter(([number]) => isInner(number));
    const g = strides.map((_, k) => -inner.reduce((sum, [number, weight]) => sum + weight * slope(number, k), 0)), length = hypot(...g) || 1;
    return g.map(x => x / length);
  };
  const put = vertices => {
    if (d !== 3) {
      vertices.forEach(({at, ends}) => { positions.push(...at); between.push(ends); });
      return;
    }
    const outward = vertices.map(findNormal); // a triangle's corners go round as its normals say
    const order = measureTurn(vertices.map(({at}) => at), outward) < 0 ? [0, 2, 1] : [0, 1, 2];
    for (const i of order) {
      positions.push(...vertices[i].at);
      normals.push(...outward[i]);
    }
  };
  const cells = count - 1;
  for (let number = 0; number < values.length; number++) {
    if (strides.some(stride => Math.floor(number / stride) % count === cells)) continue;
    let within = 0;
    for (let c = 0; c < corners; c++) within += values[number + offsets[c]] >= 0;
    inside += within / corners;
    if (within === 0 || d === 3 && within === corners) continue;
    for (const simplex of FOLLOW[d]) {
      const all = simplex.map(c => number + offsets[c]), ins = all.filter(n => values[n] >= 0), outs = all.filter(n => !(values[n] >= 0));
      if (d === 3) marchTetrahedron(ins, outs, cross, put);
      else fillTriangle(ins, outs, cross, put, locate);
    }
  }
  return {positions, normals, between, volume: inside * cellVolume};
}

// Positive where a triangle's corners go round its normals to the left.
function measureTurn([a, b, c], normals) {
  const [u, v] = [b, c].map(point => point.map((x, i) => x - a[i]));
  const across = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  return across.reduce((sum, x, i) => sum + x * (normals[0][i] + normals[1][i] + normals[2][i]), 0);
}

function marchTetrahedron(ins, outs, cross, put) {
  if (ins.length === 1) put(outs.map(out => cross(ins[0], out)));
  else if (ins.length === 3) put(ins.map(n => cross(n, outs[0])));
  else if (ins.length === 2) {
    const [a, b, c, d] = [cross(ins[0], outs[0]), cross(ins[0], outs[1]), cross(ins[1], outs[1]), cross(ins[1], outs[0])];
    put([a, b, c]);
    put([a, c, d]);
  }
}

function fillTriangle(ins, outs, cross, put, locate) {
  const corners = ins.map(n => ({at: locate(n), ends: [[n, 1]]}));
  if (ins.length === 3) put(corners);
  else if (ins.length === 1) put([corners[0], cross(ins[0], outs[0]), cross(ins[0], outs[1])]);
  else if (ins.length === 2) {
    const [a, b] = ins.map(n => cross(n, outs[0]));
    put([corners[0], corners[1], b]);
    put([corners[0], b, a]);
  }
}

const rest = () => new Promise(resolve => setTimeout(resolve, 0));

async function refineSurface(request) {
  let ends = findRanges(places);
  useMachine(request);
  for (const [level, count] of LEVELS.entries()) {
    const lattice = makeLattice(places, ...ends, count);
    let begin = performance.now();
    for (let layer = 0; layer < count; layer++) {
      fillLayer(lattice, layer, request);
      if (performance.now() - begin < 12) continue;
      await rest(); // a newer request may have come: only the coarse surface is finished before it
      if (wanted !== request && level > 0) return;
      begin = performance.now();
    }
    const {positions, normals, volume} = marchLattice(lattice, request);
    const surface = {id: request.id, level, last: level === LEVELS.length - 1, volume, positions: new Float32Array(positions), normals: new Float32Array(normals)};
    postMessage(surface, [surface.positions.buffer, surface.normals.buffer]);
    ends = findInside(lattice);
    if (ends === null || wanted !== request) return;
  }
}

// Refine the surface that is wanted, and then what was wanted since.
async function keepRefining() {
  refining = true;
  for (let done = null; done !== wanted;) {
    done = wanted;
    await refineSurface(done);
  }
  refining = false;
}

function useMachine({sizes, bounds}) {
  sizes.forEach((size, i) => { model.sizes[i] = size; });
  machine.limits.forEach((limit, i) => { limit.bound = bounds[i]; });
}

// What is allowed in the plane of the first two axes through the pose, with det A over home's at each corner.
function computeSection(request) {
  let ends = findRanges(places.slice(0, 2)), lattice = null;
  for (const count of SECTION_LEVELS) {
    lattice = makeLattice(places.slice(0, 2), ...ends, count);
    for (let layer = 0; layer < count; layer++) fillLayer(lattice, layer, request);
    ends = findInside(lattice);
    if (ends === null) return {positions: new Float32Array(0), shares: new Float32Array(0)};
  }
  const {axes, low, step, count, values} = lattice, pose = [...request.pose], {positions, between} = marchLattice(lattice, request);
  const shareAt = Float64Array.from(values, (value, number) => {
    if (!(value >= 0)) return NaN; // the corners of the border take the value of their inner end
    axes.forEach((axis, k) => { pose[axis] = low[k] + step[k] * (k ? number % count : Math.floor(number / count)); });
    return measureSide({pose, joints: model.inverse(pose, request.signs)}) / request.homeSide;
  });
  const shares = between.map(ends => {
    const known = ends.filter(([number]) => values[number] >= 0), whole = known.reduce((sum, [, weight]) => sum + weight, 0);
    return whole > 0 ? known.reduce((sum, [number, weight]) => sum + weight / whole * shareAt[number], 0) : shareAt[known[0][0]];
  });
  return {positions: new Float32Array(positions), shares: new Float32Array(shares)};
}

onmessage = ({data: request}) => {
  if (request.kind === "section") {
    useMachine(request);
    postMessage({kind: "section", ...computeSection(request)});
    if (refining) useMachine(wanted);
  } else {
    wanted = request;
    if (!refining) keepRefining();
  }
};
