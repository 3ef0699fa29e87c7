// The camera turns about a target, with Z upright.

const low = new THREE.Vector3(...machine.box[0]), high = new THREE.Vector3(...machine.box[1]);
const orbit = {target: new THREE.Vector3(), azimuth: 0, elevation: 0, distance: 1};
let shownSize = size;

// Show, beside the machine's own box, what stands in the frame of poses.
function widenView(geometry) {
  geometry.computeBoundingBox();
  const box = geometry.boundingBox.clone().applyMatrix4(frame).union(new THREE.Box3(low, high));
  low.copy(box.min);
  high.copy(box.max);
  shownSize = max(shownSize, 0.95 * low.distanceTo(high));
}

function resetOrbit() {
  orbit.target.addVectors(low, high).multiplyScalar(0.5);
  orbit.azimuth = -0.95;
  orbit.elevation = 0.32;
  if (machine.normal) {
    const across = machine.normal.map(abs).indexOf(max(...machine.normal.map(abs)));
    orbit.azimuth = across === 0 ? 0 : -PI / 2;
    orbit.elevation = across === 2 ? PI / 2 - 1e-4 : 0;
  }
  const half = 0.5 * camera.fov * PI / 180;
  orbit.distance = 0.56 * shownSize / Math.tan(half) / min(1, camera.aspect * 1.02);
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
