// All together: each change of the state is one picture.

function update() {
  const margins = unreached ? marginsOfPose(unreached.pose, unreached.signs) : marginsAt(current);
  placeMachine(current);
  updateFreeMotion(current);
  updatePanel(margins);
  requestPicture();
}

function fitCanvas() {
  const {clientWidth: width, clientHeight: height} = canvas.parentElement;
  if (renderer) renderer.setSize(width, height, false);
  camera.aspect = width / max(1, height);
  camera.updateProjectionMatrix();
  placeCamera();
  requestPicture();
}

const onClick = (id, act) => document.getElementById(id).addEventListener("click", act);
onClick("home", () => goHome());
onClick("view", () => { resetOrbit(); requestPicture(); });
onClick("labels", () => requestPicture());
onClick("stops", event => { options.stops = event.target.checked; });
onClick("theme", () => { document.documentElement.classList.toggle("dark"); requestPicture(); if (path) drawCurves(); });
if (window.matchMedia("(prefers-color-scheme: dark)").matches) document.documentElement.classList.add("dark");
document.addEventListener("keydown", event => {
  if (event.target.matches("input:not([type=checkbox]), select") || event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key === "h" || event.key === "H") goHome();
  if (event.key === "v" || event.key === "V") { resetOrbit(); requestPicture(); }
});

listeners.push(update);
new ResizeObserver(fitCanvas).observe(canvas.parentElement);
update();
if (path) widenView(pathLine.geometry);
resetOrbit();
if (proved) showSurface(unpackSurface(proved));
fitCanvas();

// Where the picture shows the tip, and the middle of a drive's strut, in pixels of the window.
function findInPicture(place) {
  const box = canvas.getBoundingClientRect(), seen = place.clone().project(camera);
  return [box.left + (0.5 + 0.5 * seen.x) * box.width, box.top + (0.5 - 0.5 * seen.y) * box.height];
}

function findStrut(drive) {
  const [first, second] = itemPoints[overlay.querySelector(`[data-drive="${drive}"]`).dataset.item];
  return first.clone().lerp(second, 0.4);
}

window.parakin = {
  machine, model, path, player, placing, movePath, writeWorkpiece, offerPosting, options, singularity, surface, section, orbit, shown, seek, stateAtTime, stateAtPose, followJoints, marginsAt, findRoot, measureSide, findFreeMotion,
  moveToPose, moveToJoints, moveToSizes, listOwnSizes, switchSign, showNextAssembly, searchAssemblies, goHome, nameSetting, showSurface, showValues, showBox, setPlaying,
  arrowInPicture: axis => findInPicture(arrows.localToWorld(new THREE.Vector3().setComponent(axis, 0.9))),
  tipInPicture: () => findInPicture(handle.position), strutInPicture: drive => findInPicture(findStrut(drive)),
  shownCorners: () => Array.from(shownMesh.geometry.attributes.position.array),
  get state() { return current; }, get stoppedBy() { return stoppedBy; }, get pictures() { return pictureCount; },
};
