// A section of the workspace through the tool, parallel to the first two axes, coloured by det A over home's: violet
// at a parallel singularity, yellow where the machine is farthest from one.

const sectionMesh = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshBasicMaterial({vertexColors: true, transparent: true, opacity: 0.72,
  side: THREE.DoubleSide, depthWrite: false}));
sectionMesh.frustumCulled = false;
workGroup.add(sectionMesh);
const sectionSwitch = makeElement("input", {type: "checkbox", id: "section"}), sectionNote = makeElement("p", {className: "note"});
workspaceSection.append(makeElement("label", {}, sectionSwitch, " a section through the tool, by det A"), sectionNote);
const section = {count: 0, corners: 0, least: NaN, most: NaN}; // the last one that was drawn, and how many were
// Viridis at five places.
const DEPTHS = ["#440154", "#3b528b", "#21918c", "#5ec962", "#fde725"].map(text => new THREE.Color(text).convertSRGBToLinear());
let sectionKey = "", sectionPose = null; // of what the worker is asked for, null while it is not

// Ask for the section anew where what it depends on has changed, one at a time: while the worker is at one the next waits.
function requestSection() {
  sectionMesh.visible = sectionSwitch.checked;
  if (!sectionSwitch.checked || sectionPose) return;
  const still = current.pose.filter((_, i) => i !== places[0] && i !== places[1]).map(value => value.toFixed(4));
  const key = [...still, ...current.signs, ...model.sizes].join(" ");
  if (key === sectionKey) return;
  sectionKey = key;
  sectionPose = [...current.pose];
  askWorker({kind: "section", homeSide: abs(homeSide) > 1e-9 ? homeSide : 1});
}

function drawSection({positions, shares}) {
  const pose = sectionPose;
  sectionPose = null;
  const [least, most] = shares.reduce(([low, high], share) => [min(low, share), max(high, share)], [Infinity, -Infinity]);
  const colours = new Float32Array(3 * shares.length), bottom = min(0, least), top = max(most, 1e-9);
  shares.forEach((share, n) => mixColours(DEPTHS, (share - bottom) / (top - bottom)).toArray(colours, 3 * n));
  replaceGeometry(sectionMesh, {position: placeCorners(positions, places.slice(0, 2), pose), color: colours});
  Object.assign(section, {count: section.count + 1, corners: shares.length, least, most});
  sectionNote.textContent = shares.length ? `det A over home’s is ${least.toFixed(2)} to ${most.toFixed(2)} there; violet is ${bottom < 0 ? "beyond a singularity" : "at a singularity"}.`
    : "Nothing is allowed in this plane.";
  fitOrbit(sectionMesh.geometry, "section");
  requestSection();
  requestPicture();
}

sectionSwitch.addEventListener("change", () => { requestSection(); requestPicture(); });
listeners.push(requestSection);
