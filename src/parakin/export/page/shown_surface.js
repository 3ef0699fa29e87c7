// A surface from elsewhere, drawn in the frame in which poses are given: the studio and notebooks show proved workspaces
// by it.

const decodeBytes = text => Uint8Array.from(atob(text), letter => letter.charCodeAt(0)).buffer;
const shownMesh = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshStandardMaterial({
  color: new THREE.Color("#2e9e6b").convertSRGBToLinear(), transparent: true, opacity: 0.36, side: THREE.DoubleSide, depthWrite: false, roughness: 0.8}));
shownMesh.frustumCulled = false;
shownMesh.renderOrder = 1;
workGroup.add(shownMesh);

// Draw triangles, nine numbers each, mm; none for nothing.
function showSurface(corners, setting = nameSetting()) {
  replaceGeometry(shownMesh, {position: new Float32Array(corners)}).computeVertexNormals();
  if (corners.length) fitOrbit(shownMesh.geometry, "proved");
  rememberSetting(shownMesh, setting);
  requestPicture();
}

// Unpack the triangles of a surface over some axes of the pose: corners in steps from the lowest one, and their numbers.
function unpackSurface({axes, low, step, corners, faces, wide}) {
  const steps = new Uint16Array(decodeBytes(corners)), numbers = new (wide ? Uint32Array : Uint16Array)(decodeBytes(faces)), positions = [];
  for (const number of numbers) axes.forEach((_, k) => positions.push(low[k] + step * steps[axes.length * number + k]));
  return placeCorners(positions, axes, begin);
}
