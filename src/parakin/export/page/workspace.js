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
workspaceSection.hidden = places.length < 2; // a line has neither surface nor section
workspaceSection.append(makeElement("label", {}, workspaceSwitch, " its surface at this orientation"), workspaceNote);
const surface = {level: -1, volume: NaN, milliseconds: NaN}; // the last one that was drawn
let latticeWorker = null, requestNumber = 0, requestedKey = "", requestTime = 0;

function askWorker(request) {
  if (!latticeWorker) {
    const source = ["core", "worker"].map(id => document.getElementById(id).textContent).join("\n");
    latticeWorker = new Worker(URL.createObjectURL(new Blob([source], {type: "text/javascript"})));
    latticeWorker.onmessage = ({data}) => data.kind === "section" ? drawSection(data) : drawSurface(data);
  }
  const {pose, signs} = current;
  latticeWorker.postMessage({pose, signs, sizes: [...model.sizes], bounds: machine.limits.map(limit => limit.bound), ...request});
}

// Points of lattices over the first axes of the pose, as places in the frame of poses.
function placeCorners(positions, axes, pose) {
  const corners = new Float32Array(positions.length / axes.length * 3), place = locateTip(pose).toArray();
  for (let n = 0; n < corners.length / 3; n++) {
    corners.set(place, 3 * n);
    axes.forEach((axis, k) => { corners[3 * n + "XYZ".indexOf(machine.axes[axis].name)] = positions[axes.length * n + k]; });
  }
  return corners;
}

// The orientation, the mode and the sizes, as text: what a workspace depends on.
function nameSetting() {
  const turns = current.pose.filter((_, i) => machine.axes[i].unit === "rad").map(turn => turn.toFixed(6));
  return [...turns, ...current.signs, ...model.sizes].join(" ");
}

// Ask for the surface anew where what it depends on has changed: turns of the pose, and the mode.
function requestSurface() {
  workspaceMesh.visible = workspaceSwitch.checked;
  if (!workspaceSwitch.checked) return;
  const key = nameSetting();
  if (key === requestedKey) return;
  requestedKey = key;
  requestTime = performance.now();
  askWorker({kind: "surface", id: ++requestNumber});
}

function drawSurface({id, level, last, volume, positions, normals}) {
  if (id !== requestNumber && level > 0) return;
  const position = placeCorners(positions, places, current.pose);
  const geometry = replaceGeometry(workspaceMesh, normals.length ? {position, normal: normals} : {position});
  if (!normals.length) geometry.computeVertexNormals();
  Object.assign(surface, {level, volume, last, milliseconds: performance.now() - requestTime});
  const [power, unit] = places.length === 3 ? [1e9, "m³"] : [1e6, "m²"];
  workspaceNote.textContent = volume > 0 ? `About ${(volume / power).toPrecision(3)} ${unit}, counted on a lattice${last ? "" : ", being refined"}. Assemblies are not told apart.`
    : "Nothing is allowed at this orientation.";
  if (last) fitOrbit(geometry, "surface");
  requestPicture();
}

// Step back, once for each kind of what is drawn, as far as all of it asks for.
const fitted = new Set();
function fitOrbit(geometry, kind) {
  if (fitted.has(kind) || !geometry.attributes.position.count) return;
  fitted.add(kind);
  widenView(geometry);
  fitView();
}

workspaceSwitch.addEventListener("change", () => { requestSurface(); requestPicture(); });
listeners.push(requestSurface);
