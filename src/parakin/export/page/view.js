// The scene in 3D: what is drawn of the machine, and the camera's picture of it.

const canvas = document.getElementById("canvas"), overlay = document.getElementById("overlay");
const size = machine.size;
const scene = new THREE.Scene(), machineGroup = new THREE.Group(), workGroup = new THREE.Group();
workGroup.matrixAutoUpdate = false; // placed by the frame in which poses are given
scene.add(machineGroup, workGroup);
const camera = new THREE.PerspectiveCamera(machine.normal ? 18 : 32, 1, size / 200, size * 60);
camera.up.set(0, 0, 1);
const renderer = makeRenderer();
const key = new THREE.DirectionalLight(0xffffff, 0.72), fill = new THREE.DirectionalLight(0xdfe9ff, 0.28);
scene.add(new THREE.HemisphereLight(0xffffff, 0x8d99a3, 0.62), camera, key.target);
camera.add(key, fill);
key.position.set(-size, 1.4 * size, size);
fill.position.set(1.5 * size, -size, size);

function makeRenderer() {
  try {
    const made = new THREE.WebGLRenderer({canvas, antialias: true, alpha: true});
    made.setPixelRatio(min(2, window.devicePixelRatio || 1));
    made.outputEncoding = THREE.sRGBEncoding;
    return made;
  } catch (error) { // no WebGL here: sliders, limits and numbers still serve
    document.getElementById("hint").textContent = "This browser shows no 3D (WebGL is missing or switched off).";
    return null;
  }
}

const bar = new THREE.CylinderGeometry(1, 1, 1, 20), taper = new THREE.CylinderGeometry(0.25, 1, 1, 20);
const ball = new THREE.SphereGeometry(1, 20, 14), UP = new THREE.Vector3(0, 1, 0);
const materials = new Map(), driveMaterials = machine.joints.map(() => ({}));

function makeMaterial(colour) {
  return new THREE.MeshStandardMaterial({color: new THREE.Color(colour).convertSRGBToLinear(), roughness: 0.55, metalness: 0.15});
}

// The material of a kind of body; struts and carriages of a drive have their own, which limits colour.
function materialOf(kind, drive) {
  if (drive >= 0 && ["rod", "telescope", "arm", "carriage"].includes(kind)) {
    return driveMaterials[drive][kind] ??= makeMaterial(machine.looks[kind][0]);
  }
  if (!materials.has(kind)) materials.set(kind, makeMaterial(machine.looks[kind][0]));
  return materials.get(kind);
}

// Bodies with what places them from the points of an item.
const bodies = [];

// Replace what is drawn by new arrays of three numbers a corner, by the names of their attributes.
function replaceGeometry(drawn, arrays) {
  const geometry = new THREE.BufferGeometry();
  for (const [name, values] of Object.entries(arrays)) geometry.setAttribute(name, new THREE.BufferAttribute(values, 3));
  drawn.geometry.dispose();
  drawn.geometry = geometry;
  return geometry;
}

function addMesh(geometry, kind, item, place) {
  const drive = machine.joints.findIndex(joint => joint.name === item.name);
  const mesh = new THREE.Mesh(geometry, materialOf(kind, drive));
  mesh.userData = {drive: machine.joints[drive] ? drive : -1, kind};
  machineGroup.add(mesh);
  bodies.push({item, mesh, place: points => place(mesh, points)});
  return mesh;
}

const along = new THREE.Vector3();

function placeBar(mesh, a, b, radius) {
  along.subVectors(b, a);
  const length = along.length();
  mesh.visible = length > 1e-9;
  mesh.position.addVectors(a, b).multiplyScalar(0.5);
  mesh.quaternion.setFromUnitVectors(UP, along.multiplyScalar(1 / (length || 1)));
  mesh.scale.set(radius, length, radius);
}

const radiusOf = kind => machine.looks[kind][1] * size;

function addBar(kind, item, first, last, geometry = bar) {
  addMesh(geometry, kind, item, (mesh, p) => placeBar(mesh, p[first], p[last], radiusOf(kind)));
}

function addBall(kind, item, number, radius) {
  addMesh(ball, kind, item, (mesh, p) => {
    mesh.position.copy(p[number]);
    mesh.scale.setScalar(radius);
  });
}

function addTelescope(item) {
  const split = new THREE.Vector3();
  addMesh(bar, "telescope", item, (mesh, p) => placeBar(mesh, p[0], split.lerpVectors(p[0], p[1], 0.58), radiusOf("telescope")));
  addMesh(bar, "piston", item, (mesh, p) => placeBar(mesh, split.lerpVectors(p[0], p[1], 0.5), p[1], radiusOf("piston")));
}

// A plate over a ring of corners, which need not lie in one plane.
function addPlate(kind, item) {
  const geometry = new THREE.BufferGeometry(), n = item.points;
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(12 * n * 3), 3));
  addMesh(geometry, kind, item, (mesh, p) => placePlate(geometry, p, radiusOf(kind)));
}

function placePlate(geometry, p, half) {
  const n = p.length, middle = p.reduce((sum, x) => sum.add(x), new THREE.Vector3()).multiplyScalar(1 / n);
  const normal = new THREE.Vector3(), edge = new THREE.Vector3();
  for (let i = 0; i < n; i++) normal.add(edge.subVectors(p[i], middle).cross(p[(i + 1) % n].clone().sub(middle)));
  normal.normalize().multiplyScalar(half);
  const values = geometry.attributes.position, put = [];
  const [low, high] = [-1, 1].map(side => [...p, middle].map(x => x.clone().addScaledVector(normal, side)));
  for (let i = 0; i < n; i++) {
    const j = (i + 1) % n;
    put.push(high[n], high[i], high[j], low[n], low[j], low[i], low[i], low[j], high[j], low[i], high[j], high[i]);
  }
  put.forEach((x, i) => values.setXYZ(i, x.x, x.y, x.z));
  values.needsUpdate = true;
  geometry.computeVertexNormals();
  geometry.computeBoundingSphere();
}

function addItem(item) {
  const {kind, points, closed} = item;
  if ((kind === "platform" || kind === "table") && closed) addPlate(kind, item);
  else if (points === 1) addBall(kind, item, 0, 2 * radiusOf(kind));
  else if (kind === "telescope") addTelescope(item);
  else {
    const bars = closed ? points : points - 1;
    for (let i = 0; i < bars; i++) addBar(kind, item, i, (i + 1) % points, kind === "tool" ? taper : bar);
    if (bars > 1 && kind !== "rail") for (let i = 0; i < points; i++) addBall(kind, item, i, radiusOf(kind));
  }
  if (["telescope", "rod", "arm"].includes(kind)) {
    const foot = kind === "telescope" ? "joint" : "carriage";
    addBall(foot, item, 0, radiusOf(foot));
    addBall("joint", item, 1, radiusOf("joint"));
  }
}

machine.items.forEach(addItem);
const itemPoints = machine.items.map(item => Array.from({length: item.points}, () => new THREE.Vector3()));
const frame = new THREE.Matrix4();

// The handle by which the tool is dragged, at its tip.
const handle = new THREE.Mesh(ball, new THREE.MeshStandardMaterial({color: 0xd81b60, transparent: true, opacity: 0.55, roughness: 0.3}));
handle.userData = {drive: -1, kind: "handle"};
scene.add(handle);

// A colour between those of a scale, by a share of its length; what is no number is at its beginning.
function mixColours(scale, share) {
  const at = max(0, min(1, Number.isFinite(share) ? share : 0)) * (scale.length - 1), i = min(scale.length - 2, Math.floor(at));
  return scale[i].clone().lerp(scale[i + 1], at - i);
}

// The place of a pose's tip in M.
function locateTip(pose, into = new THREE.Vector3()) {
  const place = [...machine.tip];
  machine.axes.forEach((axis, i) => { if ("XYZ".includes(axis.name)) place["XYZ".indexOf(axis.name)] = pose[i]; });
  return into.set(...place);
}

function placeMachine(state) {
  const values = model.placePoints(state.pose, state.joints);
  let at = 0;
  for (const points of itemPoints) for (const point of points) point.fromArray(values, 3 * at++);
  const [r, o] = [values.slice(3 * at, 3 * at + 9), values.slice(3 * at + 9)];
  frame.set(r[0], r[1], r[2], o[0], r[3], r[4], r[5], o[1], r[6], r[7], r[8], o[2], 0, 0, 0, 1);
  workGroup.matrix.copy(frame);
  workGroup.matrixWorldNeedsUpdate = true;
  bodies.forEach(body => body.place(itemPoints[machine.items.indexOf(body.item)]));
  locateTip(state.pose, handle.position).applyMatrix4(frame);
}

const AMBER = new THREE.Color("#e8a11c").convertSRGBToLinear(), RED = new THREE.Color("#cf2a1e").convertSRGBToLinear();

// Colour a drive's struts by the nearest of its limits: its own colour, amber as one nears, red where it is broken.
function colourDrive(drive, level, broken) {
  for (const [kind, material] of Object.entries(driveMaterials[drive])) {
    material.color.set(machine.looks[kind][0]).convertSRGBToLinear();
    if (broken) material.color.copy(RED);
    else material.color.lerp(AMBER, 1 - level);
  }
}

function render() {
  if (renderer) renderer.render(scene, camera);
}
