// Values at places, and a box, from elsewhere, drawn in the frame in which poses are given: the studio shows an atlas
// and a proved box by them.

const valueMesh = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshBasicMaterial({vertexColors: true, transparent: true, opacity: 0.8,
  side: THREE.DoubleSide, depthWrite: false}));
const shownBox = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({color: new THREE.Color("#d1701a").convertSRGBToLinear()}));
valueMesh.frustumCulled = shownBox.frustumCulled = false;
workGroup.add(valueMesh, shownBox);
const valueNote = makeElement("p", {className: "note"});
workspaceSection.append(valueNote);
const shown = {values: 0, box: null, visible: []}; // what was drawn last, and which of values, box and surface are seen

// Each is of a setting: sizes, mode and orientation; where the machine stands in another one it is hidden.
function rememberSetting(mesh, setting) {
  mesh.userData.setting = setting;
  hideOthers();
}

function hideOthers() {
  const setting = nameSetting();
  const meshes = [valueMesh, shownBox, shownMesh];
  for (const mesh of meshes) mesh.visible = mesh.userData.setting === setting;
  shown.visible = meshes.map(mesh => mesh.visible);
}

listeners.push(hideOthers);

// Draw a square of a grid's step about the tip of each pose, mm and rad, parallel to the first two axes, coloured by a
// value from 0, violet, to 1, yellow; none for nothing.
function showValues(poses, values, step, title, setting = nameSetting()) {
  const place = new THREE.Vector3(), colour = new THREE.Color(), positions = new Float32Array(18 * poses.length), colours = new Float32Array(18 * poses.length);
  const [a, b] = places.map(axis => "XYZ".indexOf(machine.axes[axis].name));
  poses.forEach((pose, n) => {
    const middle = locateTip(pose, place).toArray();
    colour.copy(mixColours(DEPTHS, values[n]));
    [[-1, -1], [1, -1], [1, 1], [1, 1], [-1, 1], [-1, -1]].forEach(([u, v], k) => {
      const corner = [...middle];
      corner[a] += 0.5 * step * u;
      corner[b] += 0.5 * step * v;
      positions.set(corner, 18 * n + 3 * k);
      colour.toArray(colours, 18 * n + 3 * k);
    });
  });
  replaceGeometry(valueMesh, {position: positions, color: colours});
  valueNote.textContent = poses.length ? `${title}, violet 0 to yellow 1: ${min(...values).toPrecision(3)} to ${max(...values).toPrecision(3)}.` : "";
  shown.values = poses.length;
  if (poses.length) fitOrbit(valueMesh.geometry, "values");
  rememberSetting(valueMesh, setting);
  requestPicture();
}

// Draw the edges of a box between two corners along the axes that move, mm.
function showBox(low, high, setting = nameSetting()) {
  const ends = [low, high].map(values => {
    const pose = current.pose.slice();
    places.forEach((axis, k) => { pose[axis] = values[k]; });
    return locateTip(pose).toArray();
  });
  const corners = [...Array(8).keys()].map(k => [0, 1, 2].map(i => ends[k >> i & 1][i])), edges = [];
  for (let k = 0; k < 8; k++) for (let i = 0; i < 3; i++) if (!(k >> i & 1)) edges.push(...corners[k], ...corners[k | 1 << i]);
  replaceGeometry(shownBox, {position: new Float32Array(edges)});
  shown.box = [low, high];
  fitOrbit(shownBox.geometry, "box");
  rememberSetting(shownBox, setting);
  requestPicture();
}
