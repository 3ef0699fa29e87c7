// A surface from elsewhere, drawn in the frame in which poses are given: the studio shows proved workspaces by it.

const shownMesh = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshStandardMaterial({
  color: new THREE.Color("#2e9e6b").convertSRGBToLinear(), transparent: true, opacity: 0.36, side: THREE.DoubleSide, depthWrite: false, roughness: 0.8}));
shownMesh.frustumCulled = false;
shownMesh.renderOrder = 1;
workGroup.add(shownMesh);

// Draw triangles, nine numbers each, mm; none for nothing.
function showSurface(corners) {
  replaceGeometry(shownMesh, {position: new Float32Array(corners)}).computeVertexNormals();
  if (corners.length) fitOrbit(shownMesh.geometry, "proved");
  rememberShown();
  requestPicture();
}
