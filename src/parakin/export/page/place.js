// Placing the part: the path is moved along the axes, by arrows at its middle or by sliders, and the machine's equations
// tell at once where it is off limits there. Feeds and what sets the pace stay those of the path as it was posted.

const placing = {shift: [0, 0, 0], broken: 0, columns: pathColumns, post: null}; // post: what a studio does with the option --workpiece
const shiftable = ["X", "Y", "Z"].filter(letter => machine.axes.some(axis => axis.name === letter));
const posted = path && Object.fromEntries(["poses", "joints", "margins", "broken"].map(name => [name, pathColumns[name].slice()]));
const arrows = new THREE.Group();
let placeSliders = [], placeNote = null;

// The least margin of a state, each over half its range: zero at a limit.
function measureRoom(margins) {
  return margins.reduce((least, margin, i) => machine.limits[i].span ? min(least, margin / machine.limits[i].span) : least, 1);
}

const MOST_DRAGGED = 350; // samples that are found again while the part is dragged

// Move the path from where it was posted, mm, and find again what its samples ask of the machine: of all of them, or
// while it is dragged of every few, which stand for those after them.
function movePath(shift, stride = 1) {
  for (const [name, values] of Object.entries(posted)) pathColumns[name].set(values);
  const still = shift.every(value => value === 0), {broken} = pathColumns;
  if (!still) {
    const states = followSamples(machine.axes.map(axis => "XYZ".includes(axis.name) ? shift["XYZ".indexOf(axis.name)] : 0), stride);
    fitTurns(states.filter(state => state));
    writeSamples(states, stride);
  }
  Object.assign(placing, {shift: [...shift], broken: broken.reduce((sum, value) => sum + value, 0)});
  curveBounds = null;
  offenceDots.visible = still;
  arrows.position.copy(middle).add(new THREE.Vector3(...shift));
  drawPath();
  drawLegend();
  seek(player.time);
  showPlace();
}

// Move the samples' poses. Returns the states of every few, null out of reach. Turns go on by the steps that they take
// as posted: where they begin, where they are rewound, and over a pole.
function followSamples(moves, stride) {
  const number = machine.axes.length, count = machine.joints.length, states = [];
  let before = stateAtPose(everyHome(), path.signs, null).joints, from = null;
  for (let i = 0; i < path.samples; i++) {
    const pose = rowOf("poses", i, number).map((value, k) => value + moves[k]);
    pathColumns.poses.set(pose, i * number);
    if (i % stride) continue;
    const own = Array.from(posted.joints.subarray(i * count, (i + 1) * count));
    const near = from ? before.map((q, k) => q + own[k] - from[k]) : own;
    const state = stateAtPose(pose, path.signs, {joints: isFinitePose(near) ? near : before});
    states.push(state);
    if (state) [before, from] = [state.joints, own];
  }
  return states;
}

// Turn the joints of all states by whole turns into their ranges, where there they have room, as posting does.
function fitTurns(states) {
  machine.joints.forEach((joint, k) => {
    if (!isTurning[k] || joint.low === null || joint.high === null || !states.length) return;
    const [low, high] = states.reduce(([a, b], {joints}) => [min(a, joints[k]), max(b, joints[k])], [Infinity, -Infinity]);
    if (low >= joint.low && high <= joint.high) return;
    const turns = Math.round((joint.low + joint.high - low - high) / (2 * TURN));
    for (const {joints} of states) joints[k] += turns * TURN;
  });
}

// Write what the states of every few samples ask of the machine; those on the other side of a singularity are broken.
function writeSamples(states, stride) {
  const count = machine.joints.length, {joints, margins, broken} = pathColumns, first = states.find(state => state);
  const side = first ? measureSide(first) : NaN;
  for (let i = 0; i < path.samples; i++) {
    if (i % stride) {
      joints.set(rowOf("joints", i - 1, count), i * count);
      [margins[i], broken[i]] = [margins[i - 1], broken[i - 1]];
      continue;
    }
    const state = states[i / stride], own = state ? marginsAt(state) : [];
    joints.set(state ? state.joints : Array(count).fill(NaN), i * count);
    margins[i] = state ? measureRoom(own) : NaN;
    broken[i] = !state || findBroken(own) >= 0 || measureSide(state) * side < 0 ? 1 : 0;
  }
}

// The option that puts the part where the path lies now.
function writeWorkpiece() {
  const placed = path.workpiece.map((value, i) => i < 3 ? value + placing.shift[i] : value / DEGREE);
  return placed.map((value, i) => [`${"XYZABC"[i]}=`, Number(value.toFixed(4))]).filter(([, value]) => value !== 0)
    .map(([name, value]) => name + value).join(",") || "X=0";
}

function showPlace() {
  placeSliders.forEach((slider, i) => slider.show(path.workpiece["XYZ".indexOf(shiftable[i])] + placing.shift["XYZ".indexOf(shiftable[i])]));
  const moved = placing.shift.some(value => value !== 0);
  placeNote.className = `note ${placing.broken ? "bad" : ""}`;
  placeNote.textContent = !moved ? "As it was posted."
    : placing.broken ? `${placing.broken} of ${path.samples} samples are off limits here.`
    : `All ${path.samples} samples keep the limits here; between them only posting tells.`;
  document.getElementById("workpiece").textContent = `--workpiece ${writeWorkpiece()}`;
}

const middle = new THREE.Vector3();

function buildArrows() {
  pathLine.geometry.computeBoundingSphere();
  middle.copy(pathLine.geometry.boundingSphere.center);
  for (const letter of shiftable) {
    const axis = "XYZ".indexOf(letter), unit = new THREE.Vector3().setComponent(axis, 1);
    const material = new THREE.MeshBasicMaterial({color: AXIS_COLOURS[axis], depthTest: false, transparent: true, opacity: 0.85});
    const shaft = new THREE.Mesh(bar, material), head = new THREE.Mesh(new THREE.ConeGeometry(1, 1, 20), material);
    placeBar(shaft, new THREE.Vector3(), unit.clone().multiplyScalar(0.8), 0.02);
    head.position.copy(unit).multiplyScalar(0.9);
    head.quaternion.setFromUnitVectors(UP, unit);
    head.scale.set(0.07, 0.2, 0.07);
    for (const mesh of [shaft, head]) {
      mesh.userData = {drive: -1, kind: "arrow", axis};
      mesh.renderOrder = 2;
      arrows.add(mesh);
    }
  }
  arrows.visible = false;
  arrows.position.copy(middle);
  workGroup.add(arrows);
}

// Move the path along an arrow's axis so that the place that was taken stays under the pointer.
function dragArrow(event) {
  aimRay(event);
  const origin = arrows.position.clone().applyMatrix4(frame), way = new THREE.Vector3().setFromMatrixColumn(frame, grip.axis);
  const apart = origin.sub(raycaster.ray.origin), {direction} = raycaster.ray, along = way.dot(direction);
  const square = 1 - along * along;
  if (square < 1e-3) return; // seen from its end
  const share = (along * apart.dot(direction) - apart.dot(way)) / square;
  grip.share ??= share;
  const limit = FARTHEST * size, shift = [...placing.shift];
  shift[grip.axis] = max(-limit, min(limit, shift[grip.axis] + share - grip.share));
  movePath(shift, Math.ceil(path.samples / MOST_DRAGGED));
}

function buildPlacing() {
  const place = addSection("Place the part"), show = makeElement("input", {type: "checkbox", id: "arrows"});
  show.onchange = () => { arrows.visible = show.checked; requestPicture(); };
  place.append(makeElement("label", {}, show, " arrows that move it"));
  placeSliders = shiftable.map(letter => {
    const axis = "XYZ".indexOf(letter), at = path.workpiece[axis], reach = 0.5 * size;
    return addSlider(place, {name: letter, unit: "mm", low: at - reach, high: at + reach},
      value => movePath(placing.shift.map((old, i) => i === axis ? value - at : old)));
  });
  placeNote = makeElement("p", {className: "note", role: "status"});
  const option = makeElement("code", {id: "workpiece"}), post = makeElement("button", {id: "post", textContent: "Post it here", hidden: true});
  post.onclick = () => placing.post(writeWorkpiece());
  place.append(placeNote, makeElement("p", {className: "note"}, option), makeElement("div", {className: "buttons"},
    makeElement("button", {id: "unplace", textContent: "As posted", onclick: () => movePath([0, 0, 0])}),
    makeElement("button", {textContent: "Copy", onclick: () => navigator.clipboard?.writeText(option.textContent)}), post));
  panel.insertBefore(place, panel.children[1]);
  buildArrows();
  showPlace();
}

// Let a studio post the part again where it was put.
function offerPosting(act) {
  placing.post = act;
  document.getElementById("post").hidden = false;
}

if (path) buildPlacing();
