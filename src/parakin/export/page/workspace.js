// The workspace at the orientation and in the mode in force, drawn in the frame in which poses are given.

const places = axisNumbers.filter(i => machine.axes[i].unit === "mm");
const workspaceMaterial = new THREE.MeshStandardMaterial({color: new THREE.Color("#4b8fd6").convertSRGBToLinear(), transparent: true, opacity: 0.34,
  side: THREE.DoubleSide, depthWrite: false, roughness: 0.8});
const workspaceMesh = new THREE.Mesh(new THREE.BufferGeometry(), workspaceMaterial);
workspaceMesh.frustumCulled = false;
workspaceMesh.renderOrder = 1;
workGroup.add(workspaceMesh);
const workspaceSection = addSection("Workspace");
const workspaceSwitch = makeElement("input", {type: "checkbox", id: "workspace"});
const workspaceNote = makeElement("p", {className: "note"});
workspaceSection.append(makeElement("label", {}, workspaceSwitch, " its surface at this orientation"), workspaceNote);
const surface = {level: -1, volume: NaN, milliseconds: NaN}; // the last one that was drawn
let surfaceWorker = null, requestNumber = 0, requestedKey = "", requestTime = 0;

function startWorker() {
  const source = ["core", "worker"].map(id => document.getElementById(id).textContent).join("\n");
  surfaceWorker = new Worker(URL.createObjectURL(new Blob([source], {type: "text/javascript"})));
  surfaceWorker.onmessage = event => drawSurface(event.data);
}

// Ask for the surface anew where what it depends on has changed: turns of the pose, and the mode.
function requestSurface() {
  workspaceMesh.visible = workspaceSwitch.checked;
  if (!workspaceSwitch.checked) return;
  const turns = current.pose.filter((_, i) => machine.axes[i].unit === "rad").map(turn => turn.toFixed(6));
  const key = [...turns, ...current.signs, ...model.sizes].join(" ");
  if (key === requestedKey) return;
  requestedKey = key;
  requestTime = performance.now();
  if (!surfaceWorker) startWorker();
  surfaceWorker.postMessage({id: ++requestNumber, pose: current.pose, signs: current.signs, sizes: [...model.sizes], bounds: machine.limits.map(limit => limit.bound)});
}

function drawSurface({id, level, last, volume, positions, normals}) {
  if (id !== requestNumber) return;
  const geometry = new THREE.BufferGeometry(), points = new Float32Array(positions.length / places.length * 3);
  for (let n = 0; n < points.length / 3; n++) {
    for (let i = 0; i < 3; i++) points[3 * n + i] = machine.tip[i];
    places.forEach((axis, k) => { points[3 * n + "XYZ".indexOf(machine.axes[axis].name)] = positions[places.length * n + k]; });
  }
  geometry.setAttribute("position", new THREE.BufferAttribute(points, 3));
  if (normals.length) geometry.setAttribute("normal", new THREE.BufferAttribute(normals, 3));
  else geometry.computeVertexNormals();
  workspaceMesh.geometry.dispose();
  workspaceMesh.geometry = geometry;
  Object.assign(surface, {level, volume, last, milliseconds: performance.now() - requestTime});
  const [power, unit] = places.length === 3 ? [1e9, "m³"] : [1e6, "m²"];
  workspaceNote.textContent = volume > 0 ? `About ${(volume / power).toPrecision(3)} ${unit}, counted on a lattice${last ? "" : ", being refined"}. Assemblies are not told apart.`
    : "Nothing is allowed at this orientation.";
  if (last) fitOrbit(geometry);
  requestPicture();
}

// Step back, once, as far as the whole surface asks for.
let fitted = false;
function fitOrbit(geometry) {
  if (fitted || !geometry.attributes.position.count) return;
  fitted = true;
  const before = shownSize;
  widenView(geometry);
  orbit.target.addVectors(low, high).multiplyScalar(0.5);
  zoomCamera(shownSize / before);
}

workspaceSwitch.addEventListener("change", () => { requestSurface(); requestPicture(); });
listeners.push(requestSurface);
