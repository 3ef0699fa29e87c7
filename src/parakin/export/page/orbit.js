// The camera turns about a target, with Z upright.

const orbit = {target: new THREE.Vector3(), azimuth: 0, elevation: 0, distance: 1};
const seen = []; // places that the picture shows at first: of what is drawn beside the machine
let machineSeen = null, shownSize = size; // and the machine's own, as it stood at first

// Show, beside the machine, what stands in the frame of poses.
function widenView(geometry) {
  geometry.computeBoundingBox();
  const {min: a, max: b} = geometry.boundingBox;
  for (let k = 0; k < 8; k++) seen.push(new THREE.Vector3(k & 1 ? b.x : a.x, k & 2 ? b.y : a.y, k & 4 ? b.z : a.z).applyMatrix4(frame));
}

function resetOrbit() {
  orbit.azimuth = -1.2;
  orbit.elevation = 0.32;
  if (machine.normal) {
    const across = machine.normal.map(abs).indexOf(max(...machine.normal.map(abs)));
    orbit.azimuth = across === 0 ? 0 : -PI / 2;
    orbit.elevation = across === 2 ? PI / 2 - 1e-4 : 0;
  }
  fitView();
}

// Aim at the middle of what is to be seen, as it looks from the camera's side, and step back until all of it is in the picture.
function fitView() {
  machineSeen ??= [handle.position, new THREE.Vector3().setFromMatrixPosition(frame), ...itemPoints.flat()].map(point => point.clone());
  const places = [...machineSeen, ...itemPoints.flat(), handle.position, ...seen]; // arms may have moved out of the picture
  placeCamera();
  const middle = new THREE.Vector3(), reach = [0, 0, 0], half = Math.tan(0.5 * camera.fov * PI / 180);
  for (let i = 0; i < 3; i++) {
    const way = new THREE.Vector3().setFromMatrixColumn(camera.matrix, i), along = places.map(point => point.dot(way));
    const [least, most] = [min(...along), max(...along)];
    middle.addScaledVector(way, 0.5 * (least + most));
    reach[i] = 0.5 * (most - least);
  }
  const [right, up, back] = reach;
  shownSize = max(size, 2 * hypot(right, up, back));
  orbit.target.copy(middle);
  orbit.distance = max(0.1 * size, 1.12 * max(up, right / camera.aspect) / half + back);
  placeCamera();
}

function placeCamera() {
  const {target, azimuth, elevation, distance} = orbit;
  camera.position.set(cos(elevation) * cos(azimuth), cos(elevation) * sin(azimuth), sin(elevation)).multiplyScalar(distance).add(target);
  camera.lookAt(target);
  camera.updateMatrixWorld();
  const seen = distance * Math.tan(0.5 * camera.fov * PI / 180);
  handle.scale.setScalar(0.026 * seen); // of one size in the picture
  arrows.scale.setScalar(0.3 * seen);
}

function turnCamera(right, up) {
  orbit.azimuth -= right;
  orbit.elevation = max(-PI / 2 + 1e-4, min(PI / 2 - 1e-4, orbit.elevation + up));
  placeCamera();
}

// Move the target by pixels of the picture.
function shiftCamera(right, up) {
  const scale = 2 * orbit.distance * Math.tan(0.5 * camera.fov * PI / 180) / canvas.clientHeight;
  const [x, y] = [0, 1].map(i => new THREE.Vector3().setFromMatrixColumn(camera.matrix, i));
  orbit.target.addScaledVector(x, -right * scale).addScaledVector(y, up * scale);
  placeCamera();
}

function zoomCamera(factor) {
  orbit.distance = max(0.02 * size, min(20 * shownSize, orbit.distance * factor));
  placeCamera();
}
