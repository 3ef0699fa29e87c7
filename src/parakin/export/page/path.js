// The tool path of a posted part: its line, coloured by what counts, and its samples over time.

const decodeColumn = text => new Float32Array(decodeBytes(text));
const pathColumns = path && Object.fromEntries(Object.entries(path.columns).map(([name, text]) => [name, decodeColumn(text)]));
const player = {time: 0, playing: false, speed: 1, colours: "margin"};
const pathLine = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({vertexColors: true}));
const offenceDots = new THREE.Points(new THREE.BufferGeometry(), new THREE.PointsMaterial({color: 0xd50000, size: 8, sizeAttenuation: false}));
pathLine.frustumCulled = offenceDots.frustumCulled = false;

const rowOf = (name, i, width) => Array.from(pathColumns[name].subarray(i * width, (i + 1) * width));
const sampledPose = i => rowOf("poses", i, machine.axes.length);
const sampledJoints = i => rowOf("joints", i, machine.joints.length);

// Blue where there is room, through yellow to red at a limit; it reads in grey and for the colour-blind.
const SCALE = ["#b2182b", "#ef8a62", "#fddb86", "#67a9cf", "#2166ac"].map(text => new THREE.Color(text).convertSRGBToLinear());
const OFF_LIMITS = new THREE.Color(0xd50000).convertSRGBToLinear();

const bindingColour = number => path.bindings[number].colour ?? "#9fb3c0";

function colourSample(i, most) {
  const {margins, feed, binding, rapid, broken} = pathColumns;
  if (broken[i]) return OFF_LIMITS;
  if (player.colours === "margin") return mixColours(SCALE, margins[i] / most.margin);
  if (player.colours === "feed") return mixColours(SCALE, feed[i] / most.feed);
  if (player.colours === "pace") return new THREE.Color(bindingColour(binding[i])).convertSRGBToLinear();
  return new THREE.Color(rapid[i] ? "#90a4ae" : "#00695c").convertSRGBToLinear();
}

const greatestOf = (name, least) => pathColumns[name].reduce((most, x, i) => Number.isFinite(x) && !pathColumns.rapid[i] ? max(most, x) : most, least);

function drawPath() {
  const count = path.samples, positions = new Float32Array(3 * count), colours = new Float32Array(3 * count);
  const most = {margin: greatestOf("margins", 0.05), feed: greatestOf("feed", 1e-6)}, place = new THREE.Vector3();
  for (let i = 0; i < count; i++) {
    locateTip(sampledPose(i), place).toArray(positions, 3 * i);
    colourSample(i, most).toArray(colours, 3 * i);
  }
  replaceGeometry(pathLine, {position: positions, color: colours});
  const marked = path.offences.flatMap(({sample}) => Array.from(positions.subarray(3 * sample, 3 * sample + 3)));
  replaceGeometry(offenceDots, {position: new Float32Array(marked)});
  requestPicture();
}

// The sample at or before a time.
function findSample(time) {
  const {times} = pathColumns;
  let [begin, end] = [0, path.samples - 1];
  while (begin < end) {
    const middle = (begin + end + 1) >> 1;
    if (times[middle] <= time) begin = middle;
    else end = middle - 1;
  }
  return begin;
}

// The machine as it stands at a time: between two samples pose and joints change evenly.
function stateAtTime(time) {
  const i = findSample(time), j = min(i + 1, path.samples - 1), {times} = pathColumns;
  const share = j > i ? max(0, min(1, (time - times[i]) / (times[j] - times[i]))) : 0;
  const mix = (one, other) => one.map((value, k) => value + share * (other[k] - value));
  return {pose: mix(sampledPose(i), sampledPose(j)), joints: mix(sampledJoints(i), sampledJoints(j)), signs: path.signs};
}

function seek(time) {
  player.time = max(0, min(path.end, time));
  const state = stateAtTime(player.time); // without joints where the next sample is out of reach
  const reached = isFinitePose(state.joints) ? state : stateAtPose(state.pose, path.signs, current);
  if (reached) setState(reached);
  else missPose(state.pose, path.signs);
}
