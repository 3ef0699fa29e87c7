// Dragging: the tool by its handle, a drive by its strut, the part by its arrows, else the camera.

const raycaster = new THREE.Raycaster(), pointer = new THREE.Vector2();
const pointers = new Map(); // those that are down, by their identity
const PER_PIXEL = 0.006; // rad, or of the machine's size
const STILL = 1e-3; // px: a place that moves less with 1e-3 rad, or of the machine's size, stands still in the picture
let grip = null; // what is dragged

function aimRay(event) {
  const box = canvas.getBoundingClientRect();
  pointer.set(2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height);
  raycaster.setFromCamera(pointer, camera);
}

function findGrip(event, reach = 2.2) { // of the tool's handle, in its radii
  aimRay(event);
  scene.updateMatrixWorld();
  const arrow = arrows.visible && raycaster.intersectObjects(arrows.children)[0];
  if (arrow) return {kind: "part", axis: arrow.object.userData.axis};
  const near = raycaster.ray.distanceToPoint(handle.position) < reach * handle.scale.x;
  if (near) return {kind: "tool", offset: null};
  const hits = raycaster.intersectObjects(machineGroup.children);
  const hit = hits.find(({object}) => object.userData.drive >= 0 && object.visible);
  return hit ? {kind: "drive", drive: hit.object.userData.drive, point: hit.point.clone(), mesh: hit.object} : null;
}

// Where the pointer is in the plane through the tip: the machine's own, or that which faces the camera.
function locatePointer(event) {
  aimRay(event);
  const normal = machine.normal ? new THREE.Vector3(...machine.normal) : camera.getWorldDirection(new THREE.Vector3());
  const plane = new THREE.Plane().setFromNormalAndCoplanarPoint(normal, handle.position);
  return raycaster.ray.intersectPlane(plane, new THREE.Vector3());
}

function dragTool(event) {
  if (event.shiftKey) return turnTool(event);
  const place = locatePointer(event);
  if (!place) return;
  if (!grip.offset) grip.offset = handle.position.clone().sub(place);
  place.add(grip.offset).applyMatrix4(frame.clone().invert());
  const pose = [...current.pose];
  machine.axes.forEach((axis, i) => { if ("XYZ".includes(axis.name)) pose[i] = place.getComponent("XYZ".indexOf(axis.name)); });
  moveToPose(pose);
}

function turnTool(event) {
  const turning = axisNumbers.filter(i => machine.axes[i].unit === "rad"), pose = [...current.pose];
  const [right, up] = [event.clientX - grip.x, event.clientY - grip.y].map(pixels => PER_PIXEL * pixels);
  if (!turning.length) return;
  const [across, upright] = turning.length === 1 ? [turning[0], turning[0]] : [turning[turning.length - 1], turning[turning.length - 2]];
  pose[across] += right;
  if (upright !== across) pose[upright] += up;
  grip.offset = null;
  moveToPose(pose);
}

// Move a drive so that the place of its strut that was taken follows the pointer, as the picture shows it; where that does not
// move in the picture, as on the axis of a turn, to the right.
function dragDrive(event) {
  const unit = machine.joints[grip.drive].unit === "rad" ? 1 : size, before = seeGrip(current);
  const found = followDrive(1e-3 * unit) ?? followDrive(-1e-3 * unit); // at an end it goes one way only
  if (!found) return;
  const {step, state} = found, after = seeGrip(state);
  const g = [(after[0] - before[0]) / step, (after[1] - before[1]) / step], square = g[0] * g[0] + g[1] * g[1];
  placeMachine(current);
  const way = [event.clientX - grip.x, event.clientY - grip.y];
  const most = unit === 1 ? 0.2 : 0.1 * size;
  const asked = square * step * step < STILL * STILL ? PER_PIXEL * unit * way[0] : (way[0] * g[0] + way[1] * g[1]) / square;
  const change = max(-most, min(most, asked));
  moveToJoints(current.joints.map((q, i) => i === grip.drive ? q + change : q));
}

// The state where the drive that was taken has gone a step; null where it can't.
function followDrive(step) {
  const {state, complete} = followJoints(current, current.joints.map((q, i) => i === grip.drive ? q + step : q));
  return complete ? {step, state} : null;
}

// Where the picture shows the place that was taken, in pixels, for a state.
function seeGrip(state) {
  placeMachine(state);
  grip.mesh.updateMatrixWorld();
  const place = grip.local.clone().applyMatrix4(grip.mesh.matrixWorld).project(camera);
  return [0.5 * place.x * canvas.clientWidth, -0.5 * place.y * canvas.clientHeight];
}

// The strut of a drive that was taken by its name, at its middle; the tool and the part where a name lies over their handles.
function findNamed(event) {
  const {drive, item} = event.target.dataset, beneath = findGrip(event, 1);
  if (beneath && beneath.kind !== "drive") return beneath;
  const {mesh} = bodies.find(body => body.item === machine.items[item]);
  return {kind: "drive", drive: Number(drive), point: mesh.position.clone(), mesh};
}

function takeHold(event, find) {
  canvas.setPointerCapture(event.pointerId);
  document.getElementById("hint").hidden = renderer !== null;
  pointers.set(event.pointerId, event);
  scene.updateMatrixWorld();
  grip = event.button === 0 && pointers.size === 1 ? find() : null;
  if (grip) Object.assign(grip, {x: event.clientX, y: event.clientY});
  if (grip?.mesh) grip.local = grip.mesh.worldToLocal(grip.point.clone());
}

canvas.addEventListener("pointerdown", event => takeHold(event, () => findGrip(event)));
overlay.addEventListener("pointerdown", event => takeHold(event, () => findNamed(event)));

canvas.addEventListener("pointermove", event => {
  const before = pointers.get(event.pointerId);
  if (!before) {
    canvas.style.cursor = findGrip(event) ? "grab" : "";
    return;
  }
  if (pointers.size === 2) pinch(event, before);
  else if (grip?.kind === "tool") dragTool(event);
  else if (grip?.kind === "drive") dragDrive(event);
  else if (grip?.kind === "part") dragArrow(event);
  else if (event.buttons & 2 || event.shiftKey) shiftCamera(event.clientX - before.clientX, event.clientY - before.clientY);
  else turnCamera(PER_PIXEL * (event.clientX - before.clientX), PER_PIXEL * (event.clientY - before.clientY));
  if (grip) Object.assign(grip, {x: event.clientX, y: event.clientY});
  pointers.set(event.pointerId, event);
  requestPicture();
});

function pinch(event, before) {
  const other = [...pointers.values()].find(one => one.pointerId !== event.pointerId);
  const [was, is] = [before, event].map(one => hypot(one.clientX - other.clientX, one.clientY - other.clientY));
  if (was > 0 && is > 0) zoomCamera(was / is);
  shiftCamera(0.5 * (event.clientX - before.clientX), 0.5 * (event.clientY - before.clientY));
}

for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, event => {
  pointers.delete(event.pointerId);
  if (grip?.kind === "part") movePath(placing.shift);
  grip = null;
});
canvas.addEventListener("contextmenu", event => event.preventDefault());
for (const place of [canvas, overlay]) place.addEventListener("wheel", event => {
  event.preventDefault();
  zoomCamera(Math.exp(0.0012 * max(-400, min(400, event.deltaY))));
  requestPicture();
}, {passive: false});

const VIEW_KEYS = {
  ArrowLeft: () => turnCamera(0.08, 0), ArrowRight: () => turnCamera(-0.08, 0), ArrowUp: () => turnCamera(0, 0.08),
  ArrowDown: () => turnCamera(0, -0.08), "+": () => zoomCamera(0.9), "-": () => zoomCamera(1.1),
};
canvas.addEventListener("keydown", event => {
  const act = VIEW_KEYS[event.key];
  if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  act();
  requestPicture();
});
